/// The search at one duration, or in one window of durations: its starts are solved in child processes, mode sequences beside
/// the best are searched, and the best are solved again on finer meshes.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "optimizer/solve/optimize.h"
#include "optimizer/solve/optimize_outcome.h"
#include "optimizer/solve/start_candidates.h"

namespace sparflow {
namespace {

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
    solve_candidates(StartCandidates(model_, problem_, seeds_, time_, coarse_).all());
    solve_seeds(seeds_worth_solving());
    if (options_.modes && options_.free_phases) {
      if (ranking(result_, options_.limit_tolerance).empty()) rescue();
      search_sequences();
      refine();
    }
    conclude();
    result_.solve_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return std::move(result_);
  }

 private:
  bool interrupted() const { return options_.interrupted && options_.interrupted(); }

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

  /// Progress of the next part of the work. @param of_rest its share of what is left [1]
  WorkProgress next_part(double of_rest) {
    const double from = done_;
    done_ += of_rest * (1.0 - done_);
    return part_of(options_.progress, from, done_);
  }

  /// @param of_rest share of the work left that these starts are expected to be [1]
  void solve(double of_rest, int count, const std::function<StartResult(int)>& start,
             const std::function<std::string(int)>& name) {
    solve_starts({count, start, name, time_.guess, !searching_}, problem_, options_.processes,
                 next_part(of_rest), result_);
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

OptimizeResult optimize_in(const CraneModel& model, const MotionProblem& problem,
                           const std::vector<SeedMotion>& seeds, const TimeWindow& time,
                           const OptimizeOptions& options) {
  return Search(model, problem, seeds, time, options).run();
}

}  // namespace sparflow
