#pragma once
/// Goals that give the tip's position and the angle at which it points (a bucket's), as goal configurations.
#include <Eigen/Dense>
#include <vector>

#include "problems/problem.h"

namespace sparflow {

/// The tip points along the line from the last revolute joint to the tip point; its angle is measured in the vertical plane
/// through the base's z axis and the goal: 0 = horizontal and away from the base, -pi/2 = straight down.
struct OrientedTip {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< [m], base frame
  double angle = 0.0;                             ///< [rad]
};

/// Angle at which the tip points at a configuration, in the plane through the z axis and `tip`. [rad]
double tip_angle(const Machine& machine, const Eigen::VectorXd& q, const Eigen::Vector3d& tip);

/// Configurations within the position limits that put the tip there at that angle, found by Newton's method from the start
/// and from points all over the ranges; the nearest to the start first, in seconds of travel at full speed. With as many
/// joints as conditions these are all there are, up to the sampling; with more joints they are samples of a family.
std::vector<Eigen::VectorXd> oriented_postures(const MotionProblem& problem,
                                               const OrientedTip& goal);

}  // namespace sparflow
