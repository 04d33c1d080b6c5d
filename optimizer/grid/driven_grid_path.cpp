#include "optimizer/grid/driven_grid_path.h"

#include "optimizer/crane/exact_energy.h"

namespace sparflow {

DrivenGridPath driven_grid_path(const CraneModel& model, const MotionProblem& problem,
                                double duration, const EnergyGridOptions& options) {
  DrivenGridPath out;
  if (problem.tip_line || !problem.waypoints.empty() ||
      model.machine.joint_count() > options.most_joints) {
    out.message = "no grid: a tip line, waypoints or too many joints";
    return out;
  }
  EnergyGrid grid(model, problem, options);
  const GridPath slow = grid.cheapest_path(0.0);
  if (slow.found) out.slow_energy = slow.slow_energy_J;
  const GridPath path = grid.path_for_duration(duration);
  if (!path.found || path.duration_s > duration) {
    out.message = "no path of the grid is this fast";
    return out;
  }
  /// Parts of a mesh interval at which limits are judged.
  /// @threshold [1] 2..64; chosen: as OptimizeOptions::refine
  constexpr int kDensity = 16;
  const Trajectory motion = timed_grid_path(model, problem, path, duration);
  const std::vector<LimitCheck> checks = check_limits(model, problem, motion, kDensity);
  if (worst_excess(checks) > kGridTolerance) {
    out.message = "the grid's path violates a limit: " + checks.front().what;
    return out;
  }
  out.energy = exact_total_energy(model, motion, problem.payload, kDensity);
  return out;
}

}  // namespace sparflow
