#pragma once
/// Turns obstacles of a motion problem into shapes of a crane drawing.
#include <vector>

#include "apps/report/charts/charts.h"
#include "problems/problem.h"

namespace sparflow {

/// Returns the section of each obstacle with the plane; obstacles that it misses are left out. For a crane that swings
/// the sections are those at the swing angle of `plane`.
std::vector<DrawingObstacle> cut_obstacles(const std::vector<Obstacle>& obstacles,
                                           const DrawingPlane& plane);

}  // namespace sparflow
