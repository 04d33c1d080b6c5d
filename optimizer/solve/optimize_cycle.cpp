#include "optimizer/solve/optimize_cycle.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "models/math/error.h"
#include "optimizer/solve/grid_seeds.h"
#include "optimizer/solve/optimize_outcome.h"

namespace sparflow {
namespace {

/// Share of the work that the legs on their own are, of which only the progress that is told depends.
/// @threshold [1] 0.1..0.9; tuned: on the bundled cycle of the loader crane they take two thirds of the time
constexpr double kLegShare = 0.65;

/// A leg as it was found on its own.
struct FoundLeg {
  MotionProblem problem;
  OptimizeResult result;
};

/// Phases and motion of a leg.
struct LegStart {
  PhasePlan plan;
  Trajectory motion;
};

/// Appends legs, with a phase at rest where the stop before asks for one.
class Joined {
 public:
  explicit Joined(const MotionProblem& problem) : problem_(problem) {}

  void add(const LegStart& leg, std::size_t number) {
    const double begin = times_.empty() ? 0.0 : times_.back();
    if (number > 0) {
      stops_.push_back(begin);
      plan_.waypoint_after.push_back(static_cast<int>(modes_.size()) - 1);
      if (const double dwell = problem_.stops[number - 1].dwell; dwell > 0.0) rest(dwell);
    }
    for (Eigen::Index p = 0; p < leg.plan.modes.rows(); ++p) {
      const auto row = leg.plan.modes.row(p);
      // At rest only stops are; a rest within a leg joins its neighbour.
      if ((row.array() == CylinderMode::kRest).all() && leg.plan.count() > 1) {
        owed_ += leg.plan.durations[p];
        continue;
      }
      modes_.emplace_back(row);
      durations_.push_back(leg.plan.durations[p] + owed_);
      owed_ = 0.0;
    }
    durations_.back() += owed_;
    owed_ = 0.0;
    const double from = times_.empty() ? 0.0 : times_.back();
    for (Eigen::Index k = 0; k < leg.motion.size(); ++k)
      knot(leg.motion, k, from + leg.motion.t[k] - leg.motion.t[0]);
  }

  PhasedStart start(const std::string& name, bool overlaps) const {
    PhasedStart s{name, plan_, {}, overlaps};
    const auto phases = static_cast<Eigen::Index>(modes_.size());
    s.plan.modes.resize(phases, modes_.front().size());
    for (Eigen::Index p = 0; p < phases; ++p)
      s.plan.modes.row(p) = modes_[static_cast<std::size_t>(p)];
    s.plan.durations = Eigen::Map<const Eigen::VectorXd>(durations_.data(), phases);
    const auto rows = static_cast<Eigen::Index>(times_.size());
    Trajectory& m = s.guess;
    m.t = Eigen::Map<const Eigen::VectorXd>(times_.data(), rows);
    m.q.resize(rows, q_.front().size());
    m.qd.resize(rows, m.q.cols());
    m.qdd.resize(rows, m.q.cols());
    for (Eigen::Index k = 0; k < rows; ++k) {
      m.q.row(k) = q_[static_cast<std::size_t>(k)];
      m.qd.row(k) = qd_[static_cast<std::size_t>(k)];
      m.qdd.row(k) = qdd_[static_cast<std::size_t>(k)];
    }
    m.stops = stops_;
    return s;
  }

 private:
  void rest(double dwell) {
    modes_.emplace_back(Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>::Constant(
        modes_.front().size(), CylinderMode::kRest));
    durations_.push_back(dwell);
    qdd_.back().setZero();
    times_.push_back(times_.back() + dwell);
    q_.push_back(q_.back());
    qd_.push_back(qd_.back());
    qdd_.push_back(qdd_.back());
  }

  void knot(const Trajectory& motion, Eigen::Index k, double t) {
    if (!times_.empty() && k == 0) {  // the knot of the stop is there already
      qdd_.back() = motion.qdd.row(0);
      return;
    }
    times_.push_back(t);
    q_.emplace_back(motion.q.row(k));
    qd_.emplace_back(motion.qd.row(k));
    qdd_.emplace_back(motion.qdd.row(k));
  }

  const MotionProblem& problem_;
  PhasePlan plan_;
  std::vector<Eigen::Matrix<CylinderMode, 1, Eigen::Dynamic>> modes_;
  std::vector<double> durations_, times_, stops_;
  std::vector<Eigen::RowVectorXd> q_, qd_, qdd_;
  double owed_ = 0.0;
};

class Cycle {
 public:
  Cycle(const CraneModel& model, const MotionProblem& problem, const SeedsOfLeg& seeds_of,
        const OptimizeOptions& options)
      : model_(model),
        problem_(problem),
        seeds_of_(seeds_of),
        options_(options),
        legs_(problem.stops.size() + 1) {}

  OptimizeResult run() {
    const auto begin = std::chrono::steady_clock::now();
    if (first_times() && legs_alone()) together();
    result_.solve_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return std::move(result_);
  }

 private:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }

  std::string name_of(std::size_t leg) const {
    return fmt::format("leg {} of {}, to {}", leg + 1, legs_, end_of_leg(problem_, leg));
  }

  void refuse(const std::string& why) {
    result_.status = OptimizeStatus::kInfeasible;
    result_.message = fmt::format("{}: infeasible. {}", problem_.name, why);
  }

  LegSeeds seeds(const MotionProblem& leg) const {
    if (seeds_of_) {
      LegSeeds given = seeds_of_(leg);
      if (!given.motions.empty()) return given;
      const GridSeeds grid = grid_seeds(model_, leg, options_.grid_nodes);
      if (!grid.motions.empty()) return {grid.motions, ""};
      return given;
    }
    const GridSeeds grid = grid_seeds(model_, leg, options_.grid_nodes);
    return {grid.motions, grid.message};
  }

  /// Shortest times of the seeds, leg by leg, which say how the time is split at first.
  bool first_times() {
    Eigen::VectorXd at = problem_.start;
    for (std::size_t i = 0; i < legs_; ++i) {
      const MotionProblem leg = leg_of(problem_, i, at);
      const LegSeeds found = seeds(leg);
      const double shortest = shortest_seed(found.motions);
      if (shortest <= 0.0) {
        refuse(fmt::format(
            "{}: {}", name_of(i),
            found.message.empty() ? "no motion within the limits was found" : found.message));
        return false;
      }
      shortest_.push_back(shortest);
      at = found.motions.front().motion.q.bottomRows(1).transpose();
    }
    return true;
  }

  /// The leg's share of the time, in proportion to the legs' shortest times.
  Duration share(std::size_t leg) const {
    if (problem_.duration.free()) return problem_.duration;
    double sum = 0.0;
    for (const double s : shortest_) sum += s;
    const double part = shortest_[leg] / sum, dwell = total_dwell(problem_);
    return {std::max(0.0, problem_.duration.min - dwell) * part,
            (problem_.duration.max - dwell) * part};
  }

  /// Each leg on its own, one after the other. Where one does not fit its share, the shares follow the times that are needed.
  bool legs_alone() {
    if (problem_.duration.max <= total_dwell(problem_)) {
      refuse(
          fmt::format("The machine rests for {:g} s at its stops; {:g} s was asked for the whole",
                      total_dwell(problem_), problem_.duration.max));
      return false;
    }
    /// Number of times that the time is split anew.
    /// @threshold [1] 1..10; chosen: the shortest times of the legs are known after the first
    constexpr int kMostSplits = 3;
    for (int attempt = 0; attempt < kMostSplits; ++attempt) {
      bool fits = true;
      found_.clear();
      Eigen::VectorXd at = problem_.start;
      for (std::size_t i = 0; i < legs_ && fits; ++i) {
        FoundLeg found{leg_of(problem_, i, at), {}};
        found.problem.duration = share(i);
        const LegSeeds from = seeds(found.problem);
        OptimizeOptions own = options_;
        own.progress = part_of(options_.progress, kLegShare * static_cast<double>(i) / legs_count(),
                               kLegShare * static_cast<double>(i + 1) / legs_count());
        found.result = optimize(model_, found.problem, from.motions, own);
        const OptimizeResult& r = found.result;
        if (interrupted()) {
          result_.status = OptimizeStatus::kInterrupted;
          result_.message = problem_.name + ": interrupted before any motion was found";
          return false;
        }
        if (r.motion.size() < 2) {
          fits = false;
          if (r.shortest_duration <= found.problem.duration.max || attempt + 1 == kMostSplits) {
            refuse(fmt::format("{}: {}", name_of(i), r.message));
            result_.checks = r.checks;
            return false;
          }
          /// Time that a leg gets over its shortest one, where a motion would be dear.
          /// @threshold [1] 1..3; chosen: within a tenth of the shortest time energies rise steeply
          constexpr double kRoom = 1.1;
          shortest_[i] = std::max(shortest_[i], kRoom * r.shortest_duration);
          double needed = total_dwell(problem_);
          for (const double s : shortest_) needed += s / kRoom;
          if (needed > problem_.duration.max) {
            result_.shortest_duration = needed;
            refuse(
                fmt::format("The legs need about {:.2f} s together; {:g} s was asked for ({}: {})",
                            needed, problem_.duration.max, name_of(i), r.message));
            return false;
          }
          scale_to_needed(i);
          break;
        }
        at = r.motion.q.bottomRows(1).transpose();
        found_.push_back(std::move(found));
      }
      if (fits) return true;
    }
    refuse("no split of the time among the legs was found in which each is possible");
    return false;
  }

  double legs_count() const { return static_cast<double>(legs_); }

  /// Raises a leg's weight until its share of the time is what it needs.
  void scale_to_needed(std::size_t leg) {
    double others = 0.0;
    for (std::size_t i = 0; i < legs_; ++i) others += i == leg ? 0.0 : shortest_[i];
    const double time = problem_.duration.max - total_dwell(problem_), need = shortest_[leg];
    if (time > need) shortest_[leg] = std::max(need, others * need / (time - need));
  }

  LegStart start_of(const FoundLeg& leg, const StartResult& s) const {
    LegStart out{s.plan, s.motion};
    if (out.plan.count() == 0)
      out.plan =
          plan_of(modes_of(model_, leg.problem, s.motion, options_.mode_options), s.motion.t);
    return out;
  }

  const StartResult& best_of_leg(std::size_t leg) const {
    const OptimizeResult& r = found_[leg].result;
    return r.starts[static_cast<std::size_t>(r.best_start)];
  }

  /// The legs joined: all at their best, and with one of them on another of its good sequences.
  std::vector<PhasedStart> joined_starts() const {
    const auto join = [&](std::size_t other, const StartResult* with) {
      Joined all(problem_);
      for (std::size_t i = 0; i < legs_; ++i)
        all.add(start_of(found_[i], i == other && with != nullptr ? *with : best_of_leg(i)), i);
      return all;
    };
    std::vector<PhasedStart> starts = {join(0, nullptr).start("legs one after the other", true),
                                       join(0, nullptr).start("legs, phases as they are", false)};
    /// Cost over a leg's best up to which another sequence of it is tried in the whole.
    /// @threshold [1] 1..1.5; chosen: other postures at its ends can make up for as much
    constexpr double kWorthTrying = 1.05;
    /// Number of other sequences of a leg that are tried.
    /// @threshold [1] 0..20; chosen: a solve of the whole takes as long as those of its legs
    constexpr int kMostOthers = 2;
    for (std::size_t i = 0; i < legs_; ++i) {
      const OptimizeResult& r = found_[i].result;
      int taken = 0;
      std::vector<const StartResult*> known = {&best_of_leg(i)};
      for (const int k : ranking(r, options_.limit_tolerance)) {
        const StartResult& s = r.starts[static_cast<std::size_t>(k)];
        const bool same = std::any_of(known.begin(), known.end(), [&](const StartResult* o) {
          return plan_text(model_.machine, o->plan) == plan_text(model_.machine, s.plan);
        });
        if (same || s.plan.count() == 0 || s.cost > kWorthTrying * known.front()->cost) continue;
        known.push_back(&s);
        starts.push_back(join(i, &s).start(fmt::format("{}: {}", name_of(i), s.seed), true));
        if (++taken == kMostOthers) break;
      }
    }
    return starts;
  }

  TimeWindow window(double guess) const {
    const double longest =
        std::isfinite(problem_.duration.max) ? problem_.duration.max : 6.0 * guess;
    return {guess, std::max(problem_.duration.min, 0.05 * guess), longest};
  }

  void solve(const std::vector<PhasedStart>& starts, const OptimizeOptions& options, double from,
             double to, bool last) {
    const auto at = [&](int i) -> const PhasedStart& {
      return starts[static_cast<std::size_t>(i)];
    };
    StartJobs jobs;
    jobs.count = static_cast<int>(starts.size());
    jobs.start = [&](int i) {
      return optimize_with_phases(model_, problem_, at(i), window(at(i).guess.duration()), options);
    };
    jobs.name = [&](int i) { return at(i).name; };
    jobs.last = last;
    solve_starts(jobs, problem_, options_.processes, part_of(options_.progress, from, to), result_);
  }

  void together() {
    OptimizeOptions coarse = options_;
    // The mesh is the whole cycle's, so that each leg has as many intervals as it had on its own.
    const int legs = static_cast<int>(legs_);
    coarse.intervals = legs * (options_.search_intervals > 0
                                   ? std::min(options_.search_intervals, options_.intervals)
                                   : options_.intervals);
    /// Relative tolerance of solves that only compare starts.
    /// @threshold [1] 1e-8..1e-2; chosen: as in the search of one move
    constexpr double kComparing = 1e-4;
    coarse.tolerance = std::max(options_.tolerance, kComparing);
    solve(joined_starts(), coarse, kLegShare, 0.9, false);
    const std::vector<int> ranked = ranking(result_, options_.limit_tolerance);
    if (!ranked.empty() && !interrupted()) {
      OptimizeOptions fine = options_;
      fine.intervals = legs * options_.intervals;
      std::vector<PhasedStart> again;
      for (const int i : ranked) {
        const StartResult& s = result_.starts[static_cast<std::size_t>(i)];
        if (s.plan.count() == 0) continue;
        again.push_back({"finer: " + s.seed, s.plan, s.motion, false});
        if (static_cast<int>(again.size()) == options_.searched_starts) break;
      }
      if (!again.empty()) solve(again, fine, 0.9, 1.0, true);
    }
    conclude();
  }

  void conclude() {
    result_.legwise_energy = 0.0;
    for (const FoundLeg& leg : found_) result_.legwise_energy += leg.result.energy.total;
    const std::vector<int> ranked = ranking(result_, options_.limit_tolerance);
    if (ranked.empty()) {
      const StartResult* nearest = nearest_start(result_);
      std::string worst;
      if (nearest != nullptr) {
        result_.checks = check_limits(model_, problem_, nearest->motion, options_.refine);
        worst = " Worst: " + limit_text(worst_limit(result_.checks)) + ".";
      }
      refuse(
          "Its legs are possible on their own, but no motion of the whole within all limits was "
          "found." +
          worst);
      return;
    }
    result_.best_start = best_of(result_, ranked);
    const StartResult& best = result_.starts[static_cast<std::size_t>(result_.best_start)];
    const bool confirmed = std::any_of(ranked.begin(), ranked.end(), [&](int i) {
      const StartResult& r = result_.starts[static_cast<std::size_t>(i)];
      return r.solved && r.cost <= best.cost + options_.confirmed_within * std::abs(best.cost);
    });
    result_.status = interrupted() ? OptimizeStatus::kInterrupted
                     : confirmed   ? OptimizeStatus::kOptimal
                                   : OptimizeStatus::kFeasible;
    result_.motion = best.motion;
    result_.duration = best.motion.duration();
    result_.energy_smooth = best.energy_smooth;
    result_.energy = exact_energy(model_, problem_, best.motion, options_.refine);
    result_.checks = check_limits(model_, problem_, best.motion, options_.refine);
    result_.mesh_error = std::numeric_limits<double>::quiet_NaN();
    result_.bound_note = kNoBoundOfCycles;
    result_.message = fmt::format("{}: {:.1f} kJ in {:.2f} s", problem_.name,
                                  result_.energy.total / 1e3, result_.duration);
    if (!confirmed)
      result_.message += "; it keeps all limits, but no solve converged to a cheaper motion";
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  const SeedsOfLeg& seeds_of_;
  const OptimizeOptions& options_;
  std::size_t legs_;
  std::vector<double> shortest_;  // [s] weights of the legs' shares of the time
  std::vector<FoundLeg> found_;
  OptimizeResult result_;
};

}  // namespace

OptimizeResult optimize_cycle(const CraneModel& model, const MotionProblem& problem,
                              const SeedsOfLeg& seeds_of, const OptimizeOptions& options) {
  require_complete(model, problem);
  return Cycle(model, problem, seeds_of, options).run();
}

std::vector<LegEnergy> leg_energies(const CraneModel& model, const MotionProblem& problem,
                                    const Trajectory& motion, int refine) {
  std::vector<LegEnergy> energies;
  for (const CycleLeg& leg : legs_of(problem, motion))
    energies.push_back({leg.to, leg.payload, leg.begin, leg.end,
                        exact_total_energy(model, leg.motion, leg.payload, refine)});
  return energies;
}

}  // namespace sparflow
