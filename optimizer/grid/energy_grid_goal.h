#pragma once
/// Goal configurations of a problem in relation to a grid.
#include <vector>

#include "optimizer/grid/energy_grid_lattice.h"

namespace sparflow {

/// A goal configuration and the node it is reached from.
struct GoalEnd {
  long node = 0;
  Eigen::VectorXd q;  ///< [rad] or [m]
};

/// Goal configurations through which a grid should have lines: those that leave one or more joints at their start, and
/// the nearest one. Empty when no posture reaches the goal.
std::vector<Eigen::VectorXd> anchor_postures(const MotionProblem& problem, const Machine& machine);

/// Goal configurations within about a cell of a node: those reached with all joints free, and those reached with any set
/// of joints left on the node's lines.
std::vector<GoalEnd> goal_ends(const MotionProblem& problem, const Machine& machine,
                               const Lattice& lattice);

}  // namespace sparflow
