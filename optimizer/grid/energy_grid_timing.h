#pragma once
/// Speeds along a path of straight legs: a ramp, a constant speed and a ramp in each, the same times for all joints.
#include <Eigen/Dense>

#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

struct LegProfile {
  Eigen::VectorXd ramp;          ///< [legs] both ramps' length [s]
  Eigen::MatrixXd cruise;        ///< [legs x n] speed between the ramps [rad/s] or [m/s]
  Eigen::MatrixXd corner_speed;  ///< [legs+1 x n], 0 where a joint stops or turns
};

/// @param corners [legs+1 x n]  @param durations [legs] > 0 [s]
LegProfile leg_profile(const MotionProblem& problem, const Eigen::MatrixXd& corners,
                       const Eigen::VectorXd& durations);

/// Motion with three intervals a leg that passes the corners.
Trajectory profile_motion(const Eigen::MatrixXd& corners, const Eigen::VectorXd& durations,
                          const LegProfile& profile);

/// Durations of the legs with which speeds, flows and accelerations just keep their limits [s]. Not optimal across
/// corners, but any longer multiple of them keeps the limits, too.
Eigen::VectorXd shortest_leg_durations(const CraneModel& model, const MotionProblem& problem,
                                       const Eigen::MatrixXd& corners);

/// Modes of the cylinders in each leg.
ModeTable leg_modes(const Machine& machine, const Eigen::MatrixXd& corners);

}  // namespace sparflow
