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

/// Names of the obstacles that cut_obstacles() leaves out.
std::vector<std::string> obstacles_beside(const std::vector<Obstacle>& obstacles,
                                          const DrawingPlane& plane);

/// Returns the outline of each obstacle as seen along the plane's normal, wherever it stands; half-spaces are cut, and left
/// out where their border is parallel to the plane (the ground from above).
std::vector<DrawingObstacle> outline_obstacles(const std::vector<Obstacle>& obstacles,
                                               const DrawingPlane& plane);

}  // namespace sparflow
