#pragma once
/// Joint paths along which the tip follows the straight line from its start to the goal.
#include <Eigen/Dense>
#include <vector>

#include "planners/tip_goal.h"

namespace sparflow {

struct TipLinePaths {
  std::vector<Eigen::MatrixXd> paths;  ///< waypoints x joints; not yet checked for obstacles
  double furthest = 0.0;  ///< share of the line the best attempt reached, 1 when there are paths
};

/// The line is cut into waypoints and each is solved from the one before: with least joint motion, with each joint
/// held (redundant arms), and leaning towards each of `ends`. Cut finer until the tip between waypoints stays within a
/// quarter of the problem's tolerance.
TipLinePaths follow_tip_line(const MotionProblem& problem, const TipSolver& solver,
                             const std::vector<Eigen::VectorXd>& ends);

}  // namespace sparflow
