#pragma once
/// Speed profiles along a path of straight legs: each leg has a ramp, a constant speed and a ramp, with the
/// same instants for all joints.
#include <Eigen/Dense>

#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

struct LegProfile {
  Eigen::VectorXd ramp;    ///< [legs] duration of each of the two ramps [s]
  Eigen::MatrixXd cruise;  ///< [legs x n] speed between the ramps [rad/s] or [m/s]
  Eigen::MatrixXd
      corner_speed;  ///< [legs+1 x n] [rad/s] or [m/s], 0 where a joint stops or reverses
};

/// @param corners [legs+1 x n]  @param durations [legs] > 0 [s]
LegProfile leg_profile(const MotionProblem& problem, const Eigen::MatrixXd& corners,
                       const Eigen::VectorXd& durations);

/// Motion through the corners, with three intervals in each leg.
Trajectory profile_motion(const Eigen::MatrixXd& corners, const Eigen::VectorXd& durations,
                          const LegProfile& profile);

/// Durations of the legs with which speeds, flows and accelerations just keep their limits [s]. They are not optimal
/// across corners; any larger multiple of them keeps the limits, too.
Eigen::VectorXd shortest_leg_durations(const CraneModel& model, const MotionProblem& problem,
                                       const Eigen::MatrixXd& corners);

/// Modes of the cylinders in each leg, [legs x cylinders].
ModeTable leg_modes(const Machine& machine, const Eigen::MatrixXd& corners);

}  // namespace sparflow
