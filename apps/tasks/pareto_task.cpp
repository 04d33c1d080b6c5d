#include "apps/tasks/pareto_task.h"

#include "apps/tasks/argument_range.h"

namespace sparflow {

void check_ranges(const ParetoTask& task) {
  require_range("pareto: --points", task.points, 3, 200);
  require_range("pareto: --longest", task.longest, 1.2, 100.0);
  for (const double kw : task.idle_kw) require_range("pareto: --idle", kw, 0.0, 1000.0);
  require_range("pareto: --paths", task.seeds.count, 1, 64);
  require_range_or("pareto: --intervals", task.intervals, 0, 10, 5000);
  require_range("pareto: --processes", task.processes, 0, 256);
}

ParetoCurve pareto_task(const ProblemAndModel& both, const ParetoTask& task, Journal& journal,
                        const Listener& listener) {
  check_ranges(task);
  require_one_move("pareto", both.problem);
  const auto& [problem, model] = both;
  ParetoOptions options;
  options.points = task.points;
  options.longest = task.longest;
  options.idle_powers.clear();
  options.idle_powers.reserve(task.idle_kw.size());
  for (const double kw : task.idle_kw) options.idle_powers.push_back(1e3 * kw);
  OptimizeOptions& optimize = options.strategies.optimize;
  optimize.intervals = intervals_of(problem, task.intervals);
  optimize.processes = task.processes > 0 ? task.processes : 2;
  optimize.interrupted = listener.interrupted;
  options.strategies.smooth_seeds = 2;
  options.strategies.baselines.intervals = optimize.intervals;
  options.strategies.baselines.polished_orders = 2;
  options.strategies.baselines.optimize = optimize;
  options.strategies.journal = &journal;
  /// Share of the work that the search of paths is, of which only the progress that is told depends.
  /// @threshold [1] 0..0.5; chosen: it takes some seconds at most
  constexpr double kSearchShare = 0.1;
  SeedOptions paths = task.seeds;
  paths.progress = part_of(listener.progress, 0.0, kSearchShare);
  const Seeds seeds = make_seeds(problem, paths, optimize.intervals);
  if (task.searching) task.searching();
  const WorkProgress rest = part_of(listener.progress, kSearchShare, 1.0);
  options.progress = [&](double share, const std::string& what) {
    if (rest) rest(share, what);
    return !listener.stop();
  };
  ParetoCurve curve;
  if (seeds.motions.empty()) {
    curve.message = "infeasible. " + seeds.paths.message;
  } else {
    curve = energy_against_time(model, problem, seeds.motions, options);
  }
  curve.interrupted = curve.interrupted || listener.stop();
  return curve;
}

}  // namespace sparflow
