#include "optimizer/solve/optimize.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "models/math/error.h"
#include "optimizer/grid/energy_grid.h"
#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/grid_seeds.h"
#include "optimizer/solve/optimize_cycle.h"
#include "optimizer/solve/optimize_outcome.h"
#include "optimizer/solve/start_bytes.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

bool time_is_everything(const MotionProblem& problem) {
  return problem.objective.energy == 0.0 && problem.objective.time > 0.0;
}

bool same_plan(const PhasePlan& a, const PhasePlan& b) {
  return a.count() == b.count() && a.modes.cols() == b.modes.cols() &&
         (a.modes.array() == b.modes.array()).all();
}

/// Below this multiple of the shortest duration some cylinders must move together: sequential motions need about twice.
/// @threshold [1] 1..10; chosen: below it sequences with overlap are started from slower motions, too
constexpr double kShortOfTime = 2.0;

/// Where time is short, mode sequences of motions with these multiples of the duration are tried too.
/// @threshold [1] 1..5; chosen: about a quarter and two thirds more time, up to the duration of sequential motions
constexpr double kSlower[] = {1.25, 1.6};

/// Relative tolerance of solves that only compare starts and sequences.
/// @threshold [1] 1e-8..1e-2; chosen: below kWorthAnotherRound and the mesh error of the search; the best are solved again
constexpr double kSearchTolerance = 1e-4;

// Shares of the work left, on which only the progress that is told depends.
/// Of the sequential motions and the paths of the grid.
/// @threshold [1] 0.1..0.9; tuned: on the bundled reaches they take a third of the time
constexpr double kCandidates = 0.3;
/// Of the seeds.
/// @threshold [1] 0.1..0.9; chosen: mostly few of them are solved, or all
constexpr double kStarts = 0.2;
/// Of the search for the shortest motion, and of the starts from it.
/// @threshold [1] 0.1..0.9; chosen: it has as many starts as the search before it
constexpr double kRescue = 0.3;
/// Of a round of sequences.
/// @threshold [1] 0.1..0.9; tuned: on five bundled reaches sequences take 30 to 50 % of the time, mostly in one round
constexpr double kRound = 0.6;
/// Of a mesh of the results.
/// @threshold [1] 0.1..0.9; tuned: on five bundled reaches the first mesh is the last and takes 5 to 15 % of the time
constexpr double kMesh = 0.7;

/// All solves for one problem in one window of durations.
class Search {
 public:
  Search(const CraneModel& model, const MotionProblem& problem,
         const std::vector<SeedMotion>& seeds, const TimeWindow& time,
         const OptimizeOptions& options)
      : model_(model),
        problem_(problem),
        seeds_(seeds),
        time_(time),
        options_(options),
        coarse_(options) {
    if (options.modes && options.free_phases && options.search_intervals > 0)
      coarse_.intervals = std::min(options.intervals, options.search_intervals);
    coarse_.phase_iterations = options.phase_iterations / 2;
    /// Solves of a start with renewed planes in the search.
    /// @threshold [solves] 1..10; chosen: starts need only be compared; the last meshes go on
    constexpr int kPlaneSolves = 2;
    coarse_.plane_solves = std::min(options.plane_solves, kPlaneSolves);
    if (options.modes && options.free_phases)
      coarse_.tolerance = std::max(options.tolerance, kSearchTolerance);
    // Near obstacles a solve takes ten times longer, and seeds differ more than neighbouring sequences do.
    searched_ = problem.obstacles.empty() ? options.searched_starts : 1;
  }

  OptimizeResult run() {
    const auto begin = std::chrono::steady_clock::now();
    searching_ = options_.modes && options_.free_phases;
    std::vector<ModeCandidate> one_by_one = sequences(time_.guess);
    if (short_of_time()) {
      for (const double slower : kSlower) {
        for (ModeCandidate& c : sequences(slower * time_.guess)) {
          c.name = fmt::format("shortened {:g} times: {}", slower, c.name);
          c.guess = with_duration(c.guess, time_.guess);
          one_by_one.push_back(std::move(c));
        }
      }
    }
    drop_repeated(one_by_one);
    solve_candidates(one_by_one);
    solve_seeds(seeds_worth_solving());
    if (options_.modes && options_.free_phases) {
      if (ranking(result_, options_.limit_tolerance).empty()) rescue();
      search_sequences();
      refine();
    }
    conclude();
    result_.solve_s = seconds_since(begin);
    return std::move(result_);
  }

 private:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }

  /// Whether time is too short for sequential motions. Then the mode sequence of a slower motion with overlapping phases is
  /// cheap, which neither the seeds (all joints at once) nor the grid at this duration contain. Near obstacles it is not
  /// used: there paths differ in how they pass the obstacles, and a solve takes ten times longer.
  bool short_of_time() const {
    const double shortest = shortest_seed(seeds_);
    return problem_.objective.energy > 0.0 && problem_.obstacles.empty() &&
           time_.lower == time_.upper && time_.guess < kShortOfTime * shortest;
  }

  void solve_candidates(const std::vector<ModeCandidate>& candidates) {
    if (candidates.empty()) return;
    solve(
        searching_ ? kCandidates : 0.5, static_cast<int>(candidates.size()),
        [&](int i) {
          return optimize_with_modes(model_, problem_, candidates[static_cast<std::size_t>(i)],
                                     time_, start_options(options_.smooth_starts + i));
        },
        [&](int i) { return candidates[static_cast<std::size_t>(i)].name; });
  }

  void solve_seeds(const std::vector<int>& chosen) {
    if (chosen.empty()) return;
    const auto seed = [&](int i) -> const SeedMotion& {
      return seeds_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])];
    };
    solve(
        searching_ ? kStarts : 1.0, static_cast<int>(chosen.size()),
        [&](int i) { return optimize_from(model_, problem_, seed(i), time_, start_options(i)); },
        [&](int i) { return seed(i).name; });
  }

  /// Options of the start with this number: the later ones do without the smooth law.
  OptimizeOptions start_options(int number) const {
    OptimizeOptions options = coarse_;
    if (number >= options.smooth_starts && options.modes) options.schedule.clear();
    return options;
  }

  /// Seeds that can lead to a better motion than the starts solved before them. Sequential motions and paths of the grid are
  /// made for little energy and are solved first; a seed is solved where these give no motion that keeps all limits, where
  /// something else is minimised, or where the seed itself is hardly dearer than the best of them.
  std::vector<int> seeds_worth_solving() const {
    const std::vector<int> ranked = ranking(result_, options_.limit_tolerance);
    const ObjectiveWeights& w = problem_.objective;
    const bool made_for_it = w.energy > 0.0 && w.commands <= 0.0;
    std::vector<int> chosen;
    for (int i = 0; i < static_cast<int>(seeds_.size()); ++i) {
      const SeedMotion& seed = seeds_[static_cast<std::size_t>(i)];
      if (!ranked.empty() && made_for_it) {
        const double least = result_.starts[static_cast<std::size_t>(ranked.front())].cost;
        const Trajectory motion = with_duration(seed.motion, time_.guess);
        const double energy = exact_total_energy(model_, problem_, motion, options_.refine);
        const double cost = exact_cost(model_, problem_, motion, energy, options_.refine);
        if (cost > options_.seeds_within * std::abs(least)) continue;
      }
      chosen.push_back(i);
    }
    return chosen;
  }

  /// Sequential starts for this duration, and the cheapest paths of the joint grid.
  std::vector<ModeCandidate> sequences(double duration) const {
    std::vector<ModeCandidate> found;
    if (options_.sequential_starts > 0 && options_.modes && !problem_.tip_line &&
        problem_.waypoints.empty()) {
      const Eigen::VectorXd times =
          Eigen::VectorXd::LinSpaced(coarse_.intervals + 1, 0.0, duration);
      found = sequential_candidates(model_, problem_, times, end_postures(seeds_),
                                    options_.sequential_starts);
    }
    for (ModeCandidate& c : grid_candidates(duration)) found.push_back(std::move(c));
    return found;
  }

  /// Of candidates with the same phases to (nearly) the same goal configuration the first is kept: the phases' durations are
  /// variables, so that the others would lead to the same motion. Beside obstacles the way counts as well, because the first
  /// solve holds the times.
  void drop_repeated(std::vector<ModeCandidate>& candidates) const {
    /// Difference of a joint's position, as share of its range, up to which goal configurations (or ways) count as the same.
    /// @threshold [1] 0..0.5; chosen: a solve moves the end along the goal set by more than that
    constexpr double kSamePlace = 0.05;
    if (!options_.free_phases) return;
    const bool ends_only = problem_.obstacles.empty();
    std::vector<PhasePlan> plans;
    std::vector<ModeCandidate> kept;
    const auto same_way = [&](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
      const Eigen::Index rows = ends_only ? 1 : a.rows();
      if (!ends_only && a.rows() != b.rows()) return false;
      for (Eigen::Index j = 0; j < a.cols(); ++j) {
        const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
        const auto apart = (a.col(j).tail(rows) - b.col(j).tail(rows)).cwiseAbs().maxCoeff();
        if (apart > kSamePlace * (r.hi - r.lo)) return false;
      }
      return true;
    };
    for (ModeCandidate& c : candidates) {
      PhasePlan plan = plan_of(c.modes, c.guess.t);
      bool known = false;
      for (std::size_t k = 0; k < kept.size() && !known; ++k)
        known = same_plan(plan, plans[k]) && same_way(c.guess.q, kept[k].guess.q);
      if (known) continue;
      plans.push_back(std::move(plan));
      kept.push_back(std::move(c));
    }
    candidates = std::move(kept);
  }

  /// @param wanted duration of the paths [s]; if it is longer than the window allows, the caller shortens the motion
  std::vector<ModeCandidate> grid_candidates(double wanted) const {
    std::vector<ModeCandidate> found;
    const EnergyGridOptions size{options_.grid_nodes};
    if (options_.grid_starts <= 0 || !options_.modes || problem_.tip_line ||
        !problem_.waypoints.empty() || model_.machine.joint_count() > size.most_joints)
      return found;
    const auto search = [&](const MotionProblem& problem, int most) {
      EnergyGrid grid(model_, problem, size);
      std::vector<GridPath> paths;
      if (problem.objective.energy > 0.0) {
        paths = grid.paths_for_duration(wanted, most);
      } else if (time_is_everything(problem)) {
        /// Price of time of a path that is only fast.
        /// @threshold [W] 1e6..1e12; derived: ten megawatts, far above the power of any pump
        constexpr double kTimeIsEverything = 1e7;
        paths.push_back(grid.cheapest_path(kTimeIsEverything));
      }
      for (const GridPath& path : paths) {
        if (!path.found) continue;
        double duration = std::max(wanted, path.duration_s);
        if (wanted <= time_.upper) duration = std::clamp(duration, time_.lower, time_.upper);
        found.push_back(grid_path_candidate(model_, problem, path, duration, coarse_.intervals));
      }
    };
    search(problem_, options_.grid_starts);
    if (!problem_.obstacles.empty()) {
      // The smooth clearance rows keep a larger distance than the exact check, so paths with that distance are sought.
      MotionProblem wider = problem_;
      wider.clearance = capsule_radius(problem_) + kRoomForTheRows;
      search(wider, options_.grid_starts);
    }
    return found;
  }

  /// Progress of the next part of the work. @param of_rest its share of what is left [1]
  WorkProgress next_part(double of_rest) {
    const double from = done_;
    done_ += of_rest * (1.0 - done_);
    return part_of(options_.progress, from, done_);
  }

  /// @param of_rest share of the work left that these starts are expected to be [1]
  void solve(double of_rest, int count, const std::function<StartResult(int)>& start,
             const std::function<std::string(int)>& name) {
    const WorkProgress progress = next_part(of_rest);
    const auto done = [&](int index, int finished, const ChildResult&) {
      if (progress) progress(static_cast<double>(finished) / count, name(index));
    };
    const std::vector<ChildResult> children = run_in_children(
        count, options_.processes, [&](int i) { return pack_start(start(i)); }, done);
    for (int i = 0; i < count; ++i) {
      const ChildResult& child = children[static_cast<std::size_t>(i)];
      StartResult r;
      if (child.ok) {
        r = unpack_start(child.bytes);
        // A solve of the search is not one to the tolerance of results.
        r.solved = r.converged;
        r.converged = r.converged && !searching_;
      } else {
        r.seed = name(i);
        r.message = child.error;
        r.duration = time_.guess;
      }
      for (std::size_t k = 0; k < result_.starts.size() && r.same_as < 0; ++k) {
        if (same_motion(problem_, r.motion, result_.starts[k].motion))
          r.same_as = static_cast<int>(k);
      }
      result_.starts.push_back(std::move(r));
    }
  }

  /// Called when no start kept all limits. The shortest motion found shows whether the duration is the reason; if it is
  /// not, this motion, driven slower, becomes a start.
  void rescue() {
    if (interrupted() || time_is_everything(problem_)) return;
    OptimizeOptions told = options_;
    told.progress = next_part(kRescue);
    const OptimizeResult shortest = shortest_motion(model_, problem_, seeds_, told);
    if (shortest.best_start < 0) return;
    result_.shortest_duration = shortest.duration;
    if (shortest.duration > time_.upper) return;
    const StartResult& fast = shortest.starts[static_cast<std::size_t>(shortest.best_start)];
    const TimeWindow time{std::max(time_.guess, shortest.duration), time_.lower, time_.upper};
    const Trajectory slow = with_duration(fast.motion, time.guess);
    PhasePlan plan = fast.plan;
    if (plan.count() > 0) plan.durations *= time.guess / plan.total();
    const std::string name = "the shortest motion, slower";
    solve(
        kRescue, 2,
        [&](int i) {
          return i == 0 || plan.count() == 0
                     ? optimize_from(model_, problem_, {name, slow, shortest.duration, false}, time,
                                     coarse_)
                     : optimize_with_phases(model_, problem_,
                                            {name + ", its phases", plan, slow, true}, time,
                                            coarse_);
        },
        [&](int) { return name; });
  }

  /// Local search over mode sequences: neighbours of the best few motions are solved as long as one of them is cheaper.
  void search_sequences() {
    std::vector<PhasePlan> tried;
    const auto known = [&](const PhasePlan& plan) {
      return std::any_of(tried.begin(), tried.end(),
                         [&](const PhasePlan& t) { return same_plan(t, plan); });
    };
    for (const StartResult& s : result_.starts) {
      if (s.plan.count() > 0 && !known(s.plan)) tried.push_back(s.plan);
    }
    for (int round = 0; round < options_.sequence_rounds && !interrupted(); ++round) {
      struct Job {
        int from;
        PhasePlan plan;
      };
      std::vector<Job> jobs;
      int searched = 0;
      const std::vector<int> ranked = ranking(result_, options_.limit_tolerance);
      if (ranked.empty()) return;
      const double best_before = result_.starts[static_cast<std::size_t>(ranked.front())].cost;
      for (const int i : ranked) {
        const StartResult& s = result_.starts[static_cast<std::size_t>(i)];
        /// Cost over the best up to which a motion's neighbours are searched.
        /// @threshold [1] 1..2; chosen: a motion dearer by more would have to gain as much by one change
        constexpr double kWorthSearching = 1.05;
        if (s.plan.count() == 0 || s.cost > kWorthSearching * best_before) continue;
        if (searched++ == searched_) break;
        for (PhasePlan& plan : neighbours(s.plan)) {
          if (known(plan)) continue;
          tried.push_back(plan);
          jobs.push_back({i, std::move(plan)});
        }
      }
      if (jobs.empty()) return;
      const std::vector<StartResult> from = result_.starts;
      solve(
          kRound, static_cast<int>(jobs.size()),
          [&](int i) {
            const Job& job = jobs[static_cast<std::size_t>(i)];
            const StartResult& s = from[static_cast<std::size_t>(job.from)];
            const TimeWindow time{s.duration, time_.lower, time_.upper};
            return optimize_with_phases(
                model_, problem_,
                {"sequence " + plan_text(model_.machine, job.plan), job.plan, s.motion, true}, time,
                coarse_);
          },
          [&](int i) { return "sequence " + std::to_string(i + 1); });
      const std::vector<int> now = ranking(result_, options_.limit_tolerance);
      /// Relative gain of a round from which another one follows.
      /// @threshold [1] 0..0.1; chosen: ten times the mesh error
      constexpr double kWorthAnotherRound = 1e-3;
      if (now.empty() || result_.starts[static_cast<std::size_t>(now.front())].cost >
                             (1.0 - kWorthAnotherRound) * best_before)
        return;
    }
  }

  /// Error of the trapezoidal rule on this mesh, less the smoothing of the maximum, which is known.
  double mesh_error(const StartResult& s) const {
    const ObjectiveWeights& w = problem_.objective;
    if (s.energy_exact <= 0.0 || w.energy <= 0.0 || w.commands > 0.0) return 0.0;
    const double excess = s.energy_smooth - s.energy_exact;
    double volume = 0.0;  // [m^3]
    for (int c = 0; c < model_.machine.cylinder_count(); ++c) {
      const Cylinder& cylinder = model_.machine.cylinders[static_cast<std::size_t>(c)];
      for (Eigen::Index k = 0; k + 1 < s.motion.size() && cylinder.hydraulic(); ++k) {
        const double way =
            linkage_rates(model_.machine, c, s.motion.q(k + 1, cylinder.joint)).value -
            linkage_rates(model_.machine, c, s.motion.q(k, cylinder.joint)).value;
        volume += way > 0.0 ? way * cylinder.area_piston() : -way * cylinder.area_rod();
      }
    }
    const double softness =
        options_.pressure_in_modes * std::log(1.0 + model_.machine.cylinder_count()) * volume;
    return std::max(0.0, std::max(excess - softness, -excess)) / s.energy_exact;
  }

  /// A motion without phases and the modes that it has, on a mesh of equal intervals.
  ModeCandidate on_mesh(const std::string& name, const Trajectory& motion,
                        const OptimizeOptions& options) const {
    ModeCandidate c;
    c.name = name;
    c.guess = resampled(motion, Eigen::VectorXd::LinSpaced(options.intervals + 1, motion.t[0],
                                                           motion.t[motion.size() - 1]));
    c.modes = modes_of(model_, problem_, c.guess, options.mode_options);
    return c;
  }

  /// Solves the best motions again on the result's mesh, refined until the trapezoidal error is below `mesh_error`.
  void refine() {
    std::vector<int> best = ranking(result_, options_.limit_tolerance);
    std::vector<int> chosen;
    for (const int i : best) {
      const StartResult& s = result_.starts[static_cast<std::size_t>(i)];
      const double least = result_.starts[static_cast<std::size_t>(best.front())].cost;
      /// Cost over the best up to which a motion is solved on the finer mesh.
      /// @threshold [1] 1..1.2; chosen: errors of the coarse mesh may exchange motions this close
      constexpr double kWorthRefining = 1.005;
      if ((s.plan.count() > 0 || problem_.waypoints.empty()) && s.same_as < 0 &&
          s.cost < kWorthRefining * least)
        chosen.push_back(i);
      if (static_cast<int>(chosen.size()) == searched_) break;
    }
    /// Largest number of meshes.
    /// @threshold [meshes] 1..10; derived: each halves the intervals: at most eight times the first, as
    /// OptimizeOptions::intervals says
    constexpr int kMostMeshes = 4;
    bool reached = true;  // whether the best motion of the last mesh is of a solve that converged
    for (int intervals = options_.intervals, round = 0;
         !chosen.empty() && round < kMostMeshes && !interrupted(); intervals *= 2, ++round) {
      OptimizeOptions fine = options_;
      fine.intervals = intervals;
      searching_ = false;
      /// Factor on the smoothing of the maximum where no solve converged to less than a guess costs.
      /// @threshold [1] 0.01..1; chosen: the smoothed optimum may cost more than the guess by this smoothing alone
      constexpr double kSharper = 0.2;
      if (round > 0 && !reached) fine.pressure_in_modes *= kSharper;
      const std::vector<StartResult> from = result_.starts;
      const std::size_t first = result_.starts.size();
      const auto source = [&](int i) -> const StartResult& {
        return from[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])];
      };
      const auto name = [&](int i) {
        const std::string& seed = source(i).seed;
        return seed.starts_with("finer: ") ? seed : "finer: " + seed;
      };
      solve(
          kMesh, static_cast<int>(chosen.size()),
          [&](int i) {
            const StartResult& s = source(i);
            const TimeWindow time{s.duration, time_.lower, time_.upper};
            if (s.plan.count() > 0) {
              return optimize_with_phases(model_, problem_, {name(i), s.plan, s.motion, false},
                                          time, fine);
            }
            const ModeCandidate c = on_mesh(name(i), s.motion, fine);
            StartResult r = optimize_with_modes(model_, problem_, c, time, fine);
            if (r.converged) return r;
            // With the switching times held nothing may be near; with free ones the phases can give way.
            return optimize_with_phases(
                model_, problem_, {c.name, plan_of(c.modes, c.guess.t), c.guess, true}, time, fine);
          },
          name);
      // The coarse motion stays in the list for comparison, but is not a candidate of its own.
      std::size_t winner = first;
      for (std::size_t i = first; i < result_.starts.size(); ++i) {
        if (result_.starts[i].usable(options_.limit_tolerance) &&
            result_.starts[i].cost < result_.starts[winner].cost)
          winner = i;
      }
      const StartResult& best_fine = result_.starts[winner];
      if (!best_fine.usable(options_.limit_tolerance)) return;
      if (best_fine.converged && mesh_error(best_fine) <= options_.mesh_error) return;
      reached = best_fine.converged;
      // A finer mesh mends the mesh error; what did not converge twice does not converge on more intervals.
      if (!best_fine.converged && round > 0) return;
      chosen = {static_cast<int>(winner)};
    }
  }

  void conclude() {
    const std::vector<int> ranked = ranking(result_, options_.limit_tolerance);
    const bool stopped = interrupted() || std::any_of(result_.starts.begin(), result_.starts.end(),
                                                      [](const StartResult& r) {
                                                        return r.status == NlpStatus::kInterrupted;
                                                      });
    if (!ranked.empty()) {
      result_.best_start = best_of(result_, ranked);
      const StartResult& best = result_.starts[static_cast<std::size_t>(result_.best_start)];
      const bool confirmed = std::any_of(ranked.begin(), ranked.end(), [&](int i) {
        const StartResult& r = result_.starts[static_cast<std::size_t>(i)];
        return r.solved && r.cost <= best.cost + options_.confirmed_within * std::abs(best.cost);
      });
      result_.status = stopped     ? OptimizeStatus::kInterrupted
                       : confirmed ? OptimizeStatus::kOptimal
                                   : OptimizeStatus::kFeasible;
      result_.mesh_error =
          best.converged ? mesh_error(best) : std::numeric_limits<double>::quiet_NaN();
      result_.motion = best.motion;
      result_.duration = best.motion.duration();
      result_.energy_smooth = best.energy_smooth;
      result_.energy = exact_energy(model_, problem_, best.motion, options_.refine);
      result_.checks = check_limits(model_, problem_, best.motion, options_.refine);
      result_.message = fmt::format("{}: {:.1f} kJ in {:.2f} s", problem_.name,
                                    result_.energy.total / 1e3, result_.duration);
      if (!confirmed)
        result_.message += "; it keeps all limits, but no solve converged to a cheaper motion";
      set_baselines(model_, problem_, seeds_, options_.refine, result_);
      return;
    }
    result_.duration = time_.guess;
    set_baselines(model_, problem_, seeds_, options_.refine, result_);
    if (const StartResult* nearest = nearest_start(result_))
      result_.checks = check_limits(model_, problem_, nearest->motion, options_.refine);
    if (stopped) {
      result_.status = OptimizeStatus::kInterrupted;
      result_.message = problem_.name + ": interrupted before any motion was found";
    } else {
      say_why_infeasible(problem_, seeds_, time_.guess, result_);
    }
  }

  const CraneModel& model_;
  const MotionProblem& problem_;
  const std::vector<SeedMotion>& seeds_;
  TimeWindow time_;
  const OptimizeOptions& options_;
  OptimizeOptions coarse_;
  OptimizeResult result_;
  int searched_ = 1;
  double done_ = 0.0;      // share of the work, as told
  bool searching_ = true;  // whether solves only compare starts
};

}  // namespace

std::vector<Eigen::VectorXd> end_postures(const std::vector<SeedMotion>& seeds) {
  std::vector<Eigen::VectorXd> ends;
  ends.reserve(seeds.size());
  for (const SeedMotion& s : seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  return ends;
}

OptimizeResult optimize_in(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, const TimeWindow& time,
                           const OptimizeOptions& options) {
  return Search(model, problem, seeds, time, options).run();
}

OptimizeResult shortest_motion(const CraneModel& model, const MotionProblem& problem,
                               const std::vector<SeedMotion>& seeds,
                               const OptimizeOptions& options) {
  MotionProblem fastest = problem;
  fastest.objective = {0.0, 1e3, 0.0, problem.objective.smoothness};
  const double shortest = shortest_seed(seeds);
  const double guess = shortest > 0.0 ? 1.1 * shortest : std::max(problem.duration.min, 1.0);
  fastest.duration = {0.0, 20.0 * guess};
  OptimizeOptions direct = options;
  direct.schedule.clear();
  direct.sequential_starts = 0;
  direct.sequence_rounds = 0;
  return optimize_in(model, fastest, seeds, {guess, 0.02 * guess, 20.0 * guess}, direct);
}

OptimizeResult optimize_at(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, double duration,
                           const OptimizeOptions& options) {
  return optimize_in(model, problem, seeds, TimeWindow::fixed(duration), options);
}

void require_complete(const CraneModel& model, const MotionProblem& problem) {
  const std::vector<std::string> missing = model.missing();
  if (missing.empty()) return;
  throw InputError({problem.file, 0, 0}, "model",
                   fmt::format("the model has no working pressure for {}; fit it on a log in "
                               "which that movement occurs",
                               fmt::join(missing, ", ")));
}

OptimizeResult optimize(const CraneModel& model, const MotionProblem& problem,
                        const std::vector<SeedMotion>& seeds, const OptimizeOptions& options) {
  require_complete(model, problem);
  if (!problem.stops.empty()) return optimize_cycle(model, problem, {}, options);
  if (seeds.empty()) {
    const GridSeeds found = grid_seeds(model, problem, options.grid_nodes);
    if (!found.motions.empty()) return optimize(model, problem, found.motions, options);
    OptimizeResult none;
    none.status = OptimizeStatus::kInfeasible;
    none.message = fmt::format("{}: infeasible. {}", problem.name, found.message);
    return none;
  }
  if (problem.duration.fixed())
    return optimize_at(model, problem, seeds, problem.duration.min, options);

  // A free duration is a variable of every start. Its result depends on the initial duration, so two are tried.
  const auto begin = std::chrono::steady_clock::now();
  const double shortest = shortest_seed(seeds);
  const double lo = std::max(problem.duration.min, 0.05 * shortest);
  // An endless window is cut off where the search begins, and widened while the result lies at its end.
  const bool endless = std::isinf(problem.duration.max);
  double hi = endless ? std::max(6.0 * shortest, 2.0 * lo) : std::max(problem.duration.max, lo);
  OptimizeResult best;
  int durations = 0;
  const auto cost = [](const OptimizeResult& o) {
    return o.best_start < 0 ? std::numeric_limits<double>::infinity()
                            : o.starts[static_cast<std::size_t>(o.best_start)].cost;
  };
  double told = 0.0;
  const auto search = [&](double guess, double told_to) {
    const TimeWindow window{std::clamp(guess, lo, hi), lo, hi};
    OptimizeOptions part = options;
    part.progress = part_of(options.progress, told, told_to);
    told = told_to;
    OptimizeResult r = optimize_in(model, problem, seeds, window, part);
    ++durations;
    if (durations == 1 || cost(r) < cost(best)) best = std::move(r);
  };
  const auto stopped = [&] { return options.interrupted && options.interrupted(); };
  // Where time costs nothing the longest motion is the cheapest, which may be far from either.
  const bool time_is_free = problem.idle_power <= 0.0 && problem.objective.time <= 0.0;
  /// Longest duration over the shortest from which the search begins there as well.
  /// @threshold [1] 2..20; chosen: beyond the two others, which are 1.3 and 3 times the shortest
  constexpr double kFarFromBoth = 4.0;
  const bool from_longest = time_is_free && !endless && hi > kFarFromBoth * shortest;
  const double each = from_longest ? 1.0 / 3.0 : endless ? 0.45 : 0.5;  // the rest for widenings
  search(1.3 * shortest, each);
  if (!stopped()) search(3.0 * shortest, 2.0 * each);
  if (!stopped() && from_longest) search(hi, 1.0);
  /// Share of a window's end from which a result lies at it.
  /// @threshold [1] 0.9..1; chosen: an optimum inside the window is flat, so its duration is not exact
  constexpr double kAtTheEnd = 0.98;
  /// Factor by which an endless window is widened then.
  /// @threshold [1] 1.5..10; chosen: few searches lead to any duration
  constexpr double kWider = 4.0;
  /// Largest number of widenings.
  /// @threshold [1] 0..20; chosen: a thousand times the first window; ends a search in which time costs next to nothing
  constexpr int kMostWidenings = 5;
  for (int i = 0; endless && i < kMostWidenings && !stopped(); ++i) {
    if (best.best_start < 0 || best.duration < kAtTheEnd * hi) break;
    hi *= kWider;
    search(2.0 * best.duration, 0.5 * (1.0 + told));
  }
  best.evaluated_durations = durations;
  best.solve_s = seconds_since(begin);
  return best;
}

}  // namespace sparflow
