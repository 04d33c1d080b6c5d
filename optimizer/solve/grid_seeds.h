#pragma once
/// Seeds from the joint grid, for problems in which the planners find no path.
#include <string>
#include <vector>

#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Distance that starts keep from obstacles beyond the clearance.
/// @threshold [m] 0..0.5; chosen: inflation of the smooth clearance rows, and sag between two knots
inline constexpr double kRoomForTheRows = 0.04;

struct GridSeeds {
  std::vector<SeedMotion> motions;  ///< each in its shortest duration; empty = none was found
  std::string message;              ///< why there is none
};

/// Motions along paths of the joint grid (optimizer/grid/energy_grid.h): the cheapest and faster ones, and beside obstacles
/// also those with some room. @param nodes approximate number of nodes of the grid
GridSeeds grid_seeds(const CraneModel& model, const MotionProblem& problem, int nodes);

}  // namespace sparflow
