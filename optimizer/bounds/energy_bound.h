#pragma once
/// A certified lower bound of the energy of every motion from the start to the goal, whatever its time, its path and what
/// moves together, under the quasi-static law of the model (pump = max(standby, demands), rest costs nothing). Proof,
/// figures and what is left out: docs/energy_bound.md.
///
/// In short: max_i(d_i) sum Q_i >= sum d_i Q_i, so power >= sum_j W_j(q, sign) |dq_j/dt| with W_j the least price of moving
/// joint j alone. A potential with -W_j- <= d phi/d q_j <= W_j+ everywhere then gives E >= phi(end) - phi(start). It is
/// built on a grid from the start outwards with edge costs that stay below the weights, and interpolated.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "problems/problem.h"

namespace sparflow {

struct EnergyBoundOptions {
  long nodes = 250000;          ///< of the grid, about
  int most_joints = 4;          ///< beyond, no bound
  double goal_accuracy = 2e-4;  ///< relative, of the least potential over the goal set
};

struct EnergyBound {
  bool valid = false;  ///< false: no bound, `message` says why
  std::string message;
  double lower_bound_J = 0.0;  ///< idle power not included
  Eigen::VectorXd end;  ///< posture at the goal where the potential is (nearly) least [rad] or [m]
  std::vector<int> lines;  ///< of the grid, by joint
  double checked_scale =
      1.0;  ///< factor <= 1 the potential was multiplied by after its inequality was tested
  double seconds = 0.0;  ///< wall time
};

/// Obstacles, the tip line, speeds and times are left out: without them motions can only be cheaper.
/// @param model without effects that act along the chain (machine effects are in): else there is no bound
EnergyBound energy_bound(const CraneModel& model, const MotionProblem& problem,
                         const EnergyBoundOptions& options = {});

/// Why there can be no bound, empty when there can.
std::string no_bound_reason(const CraneModel& model, const MotionProblem& problem, int most_joints);

}  // namespace sparflow
