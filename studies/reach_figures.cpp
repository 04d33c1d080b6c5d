#include "studies/reach_figures.h"

#include <algorithm>

#include "bench/planned_seeds.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time.h"
#include "optimizer/grid/driven_grid_path.h"
#include "optimizer/solve/child_processes.h"

namespace sparflow::bench {
namespace {

/// Reads what --write-optima wrote about a problem: energies and times without the motions.
StrategyComparison earlier_comparison(const nlohmann::json& entry) {
  StrategyComparison c;
  if (!entry.contains("energies_J")) return c;
  c.shortest = entry.at("shortest_s").get<double>();
  c.solve_s = entry.at("solve_s").get<double>();
  StrategyRow row;
  row.name = "equal";
  for (const auto& [kind, energy] : entry.at("energies_J").items()) {
    StrategyOutcome o;
    o.kind = kind;
    o.duration = entry.at("duration_s").get<double>();
    o.energy.total = energy.get<double>();
    o.motion.t = Eigen::Vector2d(0.0, o.duration);  // Two instants mark the outcome as found.
    row.outcomes.push_back(std::move(o));
  }
  c.rows.push_back(std::move(row));
  return c;
}

void compare(const ReachTask& task, const ReachSettings& settings, ReachFigures& f) {
  SeedResult planned;
  const std::vector<SeedMotion> seeds =
      planned_seeds(task.problem, settings.paths, settings.intervals, 1, &planned);
  f.named = planned.message;
  // Every other failure of the planner names a limit, a reach or an obstacle.
  if (planned.status != SeedStatus::kFound && planned.status != SeedStatus::kNoPath)
    f.worst = planned.message;
  if (seeds.empty()) return;
  if (settings.faster_than > 0.0 && task.meant_feasible) {
    // A first estimate of the shortest time, with a margin because it is too long.
    constexpr double kRoom = 1.02;
    OptimizeOptions quick;
    quick.processes = 1;
    const OptimizeResult fast = shortest_motion(*task.model, task.problem, seeds, quick);
    f.left_out = fast.best_start >= 0 &&
                 task.problem.duration.min > kRoom * settings.faster_than * fast.duration;
    if (f.left_out) return;
  }
  StrategyOptions options;
  options.idle_power = task.problem.idle_power;
  options.least_control = false;
  options.baselines.intervals = options.optimize.intervals = settings.intervals;
  options.baselines.polished_orders = 2;
  options.optimize.processes = 1;
  options.baselines.optimize = options.optimize;
  f.comparison = compare_strategies(*task.model, task.problem, seeds, options);
  f.named = f.comparison.message;
  if (const StrategyRow* row = f.comparison.row("equal")) f.worst = row->outcomes.back().worst;
}

}  // namespace

ReachFigures solve_reach(const ReachTask& task, const ReachSettings& settings) {
  ReachFigures f;
  if (const auto earlier = settings.optima.find(task.problem.name);
      earlier != settings.optima.end()) {
    f.comparison = earlier_comparison(*earlier);
    f.named = earlier->value("named", "");
    f.worst = earlier->value("worst", "");
    f.bound = earlier->value("lower_bound_J", 0.0);
    f.slow_bound = earlier->value("lower_bound_any_time_J", 0.0);
    f.unlimited = earlier->value("unlimited_time_J", 0.0);
    f.grid_path = earlier->value("grid_path_J", 0.0);
  } else {
    compare(task, settings, f);
  }
  if (f.left_out) return f;
  f.comparison.problem = task.problem.name;
  f.comparison.file = task.problem.file;
  if (settings.bound) {
    const EnergyBound bound = energy_bound(*task.model, task.problem);
    if (bound.valid) f.bound = f.slow_bound = bound.lower_bound_J;
    const StrategyOutcome* best = f.optimum();
    if (settings.timed && bound.valid && best != nullptr) {
      TimedBoundOptions at_its_time;
      at_its_time.any_duration = bound.lower_bound_J;
      at_its_time.known_energy = best->energy.total;
      const TimedBound timed =
          energy_bound_at(*task.model, task.problem, best->duration, at_its_time);
      if (timed.valid) f.bound = std::max(f.bound, timed.value);
    }
  }
  if (settings.grid && task.problem.machine.joint_count() <= 4) {
    constexpr int kNodes = 20000;
    const StrategyOutcome* best = f.optimum();
    const double time = best != nullptr ? best->duration : task.problem.duration.min;
    const DrivenGridPath path = driven_grid_path(*task.model, task.problem, time, {kNodes});
    f.unlimited = path.slow_energy;
    f.grid_path = path.energy;
  }
  return f;
}

std::string pack_figures(const ReachFigures& f) {
  return Packer()
      .text(packed(f.comparison))
      .number(f.unlimited)
      .number(f.bound)
      .number(f.slow_bound)
      .number(f.grid_path)
      .text(f.named)
      .text(f.worst)
      .number(f.left_out ? 1.0 : 0.0)
      .bytes();
}

ReachFigures unpack_figures(const std::string& bytes) {
  Unpacker u(bytes);
  ReachFigures f;
  f.comparison = unpacked_comparison(u.text());
  f.unlimited = u.number();
  f.bound = u.number();
  f.slow_bound = u.number();
  f.grid_path = u.number();
  f.named = u.text();
  f.worst = u.text();
  f.left_out = u.number() > 0.0;
  return f;
}

}  // namespace sparflow::bench
