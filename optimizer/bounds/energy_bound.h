#pragma once
/// Estimated lower bound of the energy of every motion from the start to the goal, whatever its duration, its path and
/// which cylinders move together, under the quasi-static law of the model (pump = max(standby, demands), a cylinder at
/// rest costs nothing). Derivation, figures and what is left out: docs/energy_bound.md.
///
/// max_i(d_i) sum Q_i >= sum d_i Q_i, so power >= sum_j W_j(q, sign) |dq_j/dt| with W_j the least price of moving joint j
/// alone. A potential with -W_j- <= d phi/d q_j <= W_j+ everywhere then gives E >= phi(end) - phi(start). It is built on
/// a grid from the start outwards with edge costs below the weights, and interpolated.
///
/// These steps are proven. That the weights hold inside the cells is not: their allowances, and those of the tabulated
/// demands, are estimated from second differences, and |d phi/d q_j| <= W_j is tested at random postures only, with
/// the same tables; rounding is not enclosed. So the result is an estimated bound, not a proven one.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/math/work_progress.h"
#include "problems/problem.h"

namespace sparflow {

struct EnergyBoundOptions {
  /// Approximate number of grid nodes.
  /// @threshold [nodes] 1000..1e8; chosen: the bound rises and the time grows with it
  long nodes = 250000;
  /// A machine with more joints gets no bound.
  /// @threshold [joints] 1..8; chosen: the nodes of a grid grow with the power of the joints
  int most_joints = 4;
  /// Relative accuracy of the least potential over the goal set.
  /// @threshold [1] 1e-6..1e-2; chosen: far below what the grid costs the bound
  double goal_accuracy = 2e-4;
  /// Boxes of postures cut at most on the goal set (GoalAccuracy::most_cuts).
  /// @threshold [boxes] 1..1e9; chosen: the bundled reaches need some thousands; a million take a minute
  long most_goal_cuts = 1000000;
  WorkProgress progress = {};  ///< called after each part
};

struct EnergyBound {
  bool valid = false;  ///< false: no bound, `message` says why
  std::string message;
  double lower_bound_J = 0.0;  ///< idle power not included
  Eigen::VectorXd end;  ///< posture at the goal where the potential is (nearly) least [rad] or [m]
  std::vector<int> lines;  ///< number of grid lines by joint
  double checked_scale =
      1.0;  ///< factor <= 1 on the potential, by which its inequality holds at all sampled postures
  /// Whether the search on the goal set ended at EnergyBoundOptions::most_goal_cuts; then `message` says so, and the bound,
  /// which is valid, may be far below the least energy.
  bool capped = false;
  double seconds = 0.0;  ///< wall time
};

/// Obstacles, the tip line, and limits of speed and time are left out: without them motions can only be cheaper.
/// @param model a model with effects that act along the chain gets no bound; effects on the machine are included
EnergyBound energy_bound(const CraneModel& model, const MotionProblem& problem,
                         const EnergyBoundOptions& options = {});

/// Sentence that says why there can be no bound; empty when there can be one.
std::string no_bound_reason(const CraneModel& model, const MotionProblem& problem, int most_joints);

}  // namespace sparflow
