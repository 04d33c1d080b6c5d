#pragma once
/// Lower bound of a grid potential over the goal set.
#include "optimizer/bounds/energy_bound_potential.h"

namespace sparflow {

struct GoalAccuracy {
  double value = 2e-4;  ///< relative, of the least value
  double tip = 2e-3;    ///< [m] how finely the goal set is resolved
  /// Boxes cut after which the search ends.
  /// @threshold [boxes] 1..1e9; chosen: the bundled reaches need some thousands; a million take a minute
  long most_cuts = 1000000;
};

struct LeastOnGoal {
  bool reachable = false;  ///< false: no box of the grid can hold a posture at the goal
  double lower =
      0.0;            ///< at most the least value over all postures at the goal, rounding aside [J]
  Eigen::VectorXd q;  ///< middle of the box with that value
  long boxes = 0;     ///< number of boxes examined
  /// Whether the search ended at its largest number of boxes. `lower` is then what was shown until then: it is below the
  /// least value, but perhaps far below.
  bool capped = false;
};

/// Best-first branch and bound over boxes of postures. Within a cell the interpolated potential is least at a corner; a
/// box is dropped when the tip, linearised at the box's middle with a bound of the second-order remainder, cannot be at
/// the goal. The goal set may have any dimension.
/// @param accuracy changes how close the answer is, not that it lies below
LeastOnGoal least_on_goal(const MotionProblem& problem, const Machine& machine,
                          const EnergyPotential& potential, const GoalAccuracy& accuracy);

}  // namespace sparflow
