#pragma once
/// Least value of a grid potential over the goal set, from below.
#include "optimizer/bounds/energy_bound_potential.h"

namespace sparflow {

struct LeastOnGoal {
  bool reachable = false;  ///< false: no box of the grid can hold a posture at the goal
  double lower = 0.0;      ///< never above the least value over all postures at the goal [J]
  Eigen::VectorXd q;       ///< middle of the box that held it
  long boxes = 0;          ///< examined
};

/// Best-first branch and bound over boxes of postures: within a cell the interpolated potential is least at a corner; a
/// box is dropped when the tip, linear from its middle plus a bound of the rest, cannot be at the goal. Works for goal
/// sets of any dimension.
/// @param accuracy relative, and  @param tip_accuracy how finely the goal set is followed [m]; the answer is a bound
/// whatever they are
LeastOnGoal least_on_goal(const MotionProblem& problem, const Machine& machine,
                          const EnergyPotential& potential, double accuracy,
                          double tip_accuracy = 2e-3);

}  // namespace sparflow
