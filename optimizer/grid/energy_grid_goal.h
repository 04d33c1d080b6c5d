#pragma once
/// Where the goal set of a problem lies on a grid.
#include <vector>

#include "optimizer/grid/energy_grid_lattice.h"

namespace sparflow {

/// A posture at the goal, and the node it is reached from.
struct GoalEnd {
  long node = 0;
  Eigen::VectorXd q;  ///< [rad] or [m]
};

/// Postures at the goal that a grid should have lines through: those that leave one or more joints where they start,
/// and the nearest. Empty when nothing reaches the goal.
std::vector<Eigen::VectorXd> anchor_postures(const MotionProblem& problem, const Machine& machine);

/// Postures at the goal within about a cell of a node: with all joints free to move there, and with every set of joints
/// left on the node's lines.
std::vector<GoalEnd> goal_ends(const MotionProblem& problem, const Machine& machine,
                               const Lattice& lattice);

}  // namespace sparflow
