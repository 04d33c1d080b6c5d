#include "optimizer/solve/grid_seeds.h"

#include <fmt/format.h>

#include "optimizer/grid/energy_grid.h"
#include "problems/clearance.h"

namespace sparflow {

GridSeeds grid_seeds(const CraneModel& model, const MotionProblem& problem, int nodes) {
  GridSeeds seeds;
  if (!problem.waypoints.empty()) {
    seeds.message = "a grid cannot pass waypoints";
    return seeds;
  }
  const auto search = [&](const MotionProblem& p) {
    EnergyGrid grid(model, p, {nodes});
    // From unlimited time to a price far above any pump's power: the cheapest path, one between, and the fastest.
    for (const double price : {0.0, 1e4, 1e7}) {
      const GridPath path = grid.cheapest_path(price);
      if (!path.found) {
        if (seeds.motions.empty()) seeds.message = path.message;
        break;
      }
      if (path.leg_durations.size() == 0) continue;  // the start is the goal
      seeds.motions.push_back({fmt::format("grid path {}", seeds.motions.size() + 1),
                               timed_grid_path(model, problem, path, path.duration_s),
                               path.duration_s, path.leg_durations.size() == 1});
    }
  };
  search(problem);
  if (!problem.obstacles.empty()) {
    MotionProblem wider = problem;
    wider.clearance = capsule_radius(problem) + kRoomForTheRows;
    search(wider);
  }
  return seeds;
}

}  // namespace sparflow
