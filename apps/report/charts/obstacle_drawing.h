#pragma once
/// Obstacles of a motion problem as shapes of a crane drawing.
#include <vector>

#include "apps/report/charts/charts.h"
#include "problems/problem.h"

namespace sparflow {

/// What the plane cuts out of each obstacle; obstacles it misses are left out. For a crane that swings the
/// cut holds for the one swing angle of `plane`.
std::vector<DrawingObstacle> cut_obstacles(const std::vector<Obstacle>& obstacles,
                                           const DrawingPlane& plane);

}  // namespace sparflow
