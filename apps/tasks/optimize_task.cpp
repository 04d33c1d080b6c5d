#include "apps/tasks/optimize_task.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>

#include "apps/tasks/argument_range.h"
#include "models/math/interruption.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/grid/driven_grid_path.h"
#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/child_progress.h"
#include "optimizer/solve/optimize_cycle.h"

namespace sparflow {
namespace {

/// Share of the work that the search of paths is, of which only the progress that is told depends.
/// @threshold [1] 0..0.5; chosen: it takes some seconds at most
constexpr double kPathShare = 0.2;

/// Without a seed path: from paths of the joint grid, unless the planner has shown that there is no motion.
OptimizeResult without_seeds(const CraneModel& model, const MotionProblem& problem,
                             const Seeds& seeds, const OptimizeOptions& options) {
  OptimizeResult result;
  if (may_have_a_path(problem, seeds.paths.status)) {
    result = optimize(model, problem, {}, options);
    if (result.motion.size() > 1 || !result.starts.empty()) return result;
  }
  result.status = OptimizeStatus::kInfeasible;
  result.message = fmt::format("{}: infeasible. {}", problem.name, seeds.paths.message);
  for (const std::string& r : seeds.refused) result.message += " " + r + ".";
  return result;
}

/// A part of the computation of the bound.
struct BoundPart {
  const char* words;
  double of_rest;  ///< share of the work left that it is expected to be [1]
};
/// Only the progress that is told depends on the shares.
/// @threshold [1] 0..1; chosen: a timed bound evaluates a hundred bounds, the first parts two grids
constexpr BoundPart kBoundParts[] = {{"path of the joint grid", 0.05},
                                     {"bound of any duration", 0.1},
                                     {"bound with the price of time", 0.5},
                                     {"bound of the longest duration", 1.0}};

/// Sets the energies found by dynamic programming alone, and the larger of two estimated lower bounds: that of any
/// motion and that of motions within the problem's largest duration.
/// @param begin called with the number of each part as it begins; gives the progress that the part is to tell
void set_bound(const CraneModel& model, const MotionProblem& problem,
               const std::function<WorkProgress(int part)>& begin, OptimizeResult& result) {
  begin(0);
  const DrivenGridPath path = driven_grid_path(model, problem, result.duration);
  result.grid_path_energy = path.energy;
  result.unlimited_energy = path.slow_energy;
  EnergyBoundOptions any;
  any.progress = begin(1);
  const EnergyBound bound = energy_bound(model, problem, any);
  result.bound_note = bound.message;
  if (!bound.valid) return;
  result.lower_bound = bound.lower_bound_J;
  TimedBoundOptions options;
  if (problem.idle_power > 0.0 && !problem.duration.fixed()) {
    options.progress = begin(2);
    const TimedBound cost = cost_bound(model, problem, problem.idle_power, options);
    if (cost.valid) result.lower_bound_cost = cost.value;
  }
  // Within half a percent of the bound of any motion, the limited time can raise the energy by no more than that.
  const double time = problem.duration.max;
  if (!std::isfinite(time) || result.energy.total < 1.005 * bound.lower_bound_J) return;
  options.progress = begin(3);
  options.any_duration = bound.lower_bound_J;
  options.known_energy = result.energy.total;
  const TimedBound timed = energy_bound_at(model, problem, time, options);
  if (timed.valid && timed.price_W > 0.0 && timed.value > result.lower_bound) {
    result.lower_bound = timed.value;
    result.lower_bound_time = time;
  }
}

/// Seeds of a warm start: the earlier motion, and beside it one path of the grid, because another goal or payload may ask for
/// another sequence of moves.
Seeds warm_seeds(const Trajectory& from, OptimizeOptions& options) {
  Seeds seeds;
  seeds.motions.push_back({"previous motion", from, from.duration(), false});
  options.sequential_starts = options.smooth_starts = 0;
  options.grid_starts = 1;
  options.sequence_rounds = 2;
  return seeds;
}

/// The legs' seed paths are sought one after the other, for a leg begins where the one before ends.
Optimized optimize_cycle_task(const CraneModel& model, const MotionProblem& problem,
                              const OptimizeTask& task, OptimizeOptions& options,
                              const Listener& listener) {
  if (task.from) require_one_move("a warm start (--from)", problem);
  if (task.smooth_only) require_one_move("the smooth law without modes (--smooth-only)", problem);
  if (task.searching) task.searching();
  options.progress = listener.progress;
  SeedOptions paths = task.seeds;
  paths.progress = {};
  const auto seeds_of = [&](const MotionProblem& leg) {
    const Seeds seeds = make_seeds(leg, paths, options.intervals);
    LegSeeds found{seeds.motions, seeds.paths.message};
    for (const std::string& r : seeds.refused) found.message += " " + r + ".";
    return found;
  };
  return {{}, optimize_cycle(model, problem, seeds_of, options)};
}

}  // namespace

void check_ranges(const OptimizeTask& task) {
  require_range("optimize: --paths", task.seeds.count, 1, 64);
  require_range("optimize: --seconds", task.seeds.seconds, 1e-3, 1e6);
  require_range_or("optimize: --intervals", task.intervals, 0, 10, 5000);
  require_range("optimize: --processes", task.processes, 0, 256);
}

Optimized optimize_task(const CraneModel& model, const MotionProblem& problem,
                        const OptimizeTask& task, const Listener& listener) {
  check_ranges(task);
  OptimizeOptions options;
  options.intervals = intervals_of(problem, task.intervals);
  options.processes = task.processes > 0 ? task.processes : 2;
  if (task.smooth_only) {
    options.modes = false;
    options.schedule.push_back({2e-3, 1e5});
    options.smooth_iterations = 1000;
  }
  options.interrupted = listener.interrupted;
  if (!problem.stops.empty()) return optimize_cycle_task(model, problem, task, options, listener);
  Optimized both;
  SeedOptions paths = task.seeds;
  paths.progress = part_of(listener.progress, 0.0, kPathShare);
  both.seeds =
      task.from ? warm_seeds(*task.from, options) : make_seeds(problem, paths, options.intervals);
  if (listener.stop()) throw Interruption();
  if (task.searching) task.searching();
  options.progress = part_of(listener.progress, kPathShare, 1.0);
  if (options.progress)
    options.progress(0.0, fmt::format("solving from {} paths", both.seeds.motions.size()));
  both.result = both.seeds.motions.empty() ? without_seeds(model, problem, both.seeds, options)
                                           : optimize(model, problem, both.seeds.motions, options);
  return both;
}

void add_bound(const CraneModel& model, const MotionProblem& problem, const Listener& listener,
               OptimizeResult& result) {
  if (listener.stop()) {
    result.interrupted = true;
    return;
  }
  if (!problem.stops.empty()) return;  // the result says that a cycle has no bound
  if (moves_at_an_end(problem)) {
    result.bound_note = "no bound for motions that begin or end moving: the bounds know rest only";
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  ChildProgress done(1);
  std::atomic<int>& part = done.step();
  const ChildResult child = run_in_child(
      [&] {
        OptimizeResult r = result;
        set_bound(
            model, problem,
            [&](int next) {
              const double from = done.share();
              part = next;
              return part_of([&](double share, const std::string&) { done.set(0, share); }, from,
                             from + kBoundParts[next].of_rest * (1.0 - from));
            },
            r);
        Packer p;
        p.number(r.grid_path_energy).number(r.unlimited_energy).number(r.lower_bound);
        p.number(r.lower_bound_time).number(r.lower_bound_cost).text(r.bound_note);
        return p.bytes();
      },
      [&] {
        if (listener.progress) listener.progress(done.share(), kBoundParts[part.load()].words);
        return listener.stop();
      });
  result.interrupted = listener.stop();
  result.bound_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  result.solve_s += result.bound_s;
  if (!child.ok) {
    result.bound_note = "no lower bound: " + child.error;
    return;
  }
  Unpacker u(child.bytes);
  result.grid_path_energy = u.number();
  result.unlimited_energy = u.number();
  result.lower_bound = u.number();
  result.lower_bound_time = u.number();
  result.lower_bound_cost = u.number();
  result.bound_note = u.text();
}

}  // namespace sparflow
