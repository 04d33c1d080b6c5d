#pragma once
/// Joint paths along which the tip follows the straight line from its start to the goal.
#include <Eigen/Dense>
#include <vector>

#include "planners/tip_goal.h"

namespace sparflow {

struct TipLinePaths {
  std::vector<Eigen::MatrixXd> paths;  ///< waypoints x joints; not yet checked for obstacles
  double furthest = 0.0;  ///< largest share of the line that was reached, 1 when there are paths
};

/// Divides the line into waypoints and solves each from the one before: with least joint motion, with each joint held
/// (redundant arms), and attracted to each of `ends`. The division is refined until the tip between waypoints stays within
/// a quarter of the problem's tolerance.
TipLinePaths follow_tip_line(const MotionProblem& problem, const TipSolver& solver,
                             const std::vector<Eigen::VectorXd>& ends);

}  // namespace sparflow
