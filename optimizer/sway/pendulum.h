#pragma once
/// A load on a rope that hangs from the tip, along a motion: a spherical pendulum without damping whose upper end is driven.
///   rho'' = g - p'' - lambda rho,   lambda = (|rho'|^2 + rho . (g - p'')) / l^2
/// with rho [m] from the tip to the load, |rho| = l, p the tip and lambda the rope's tension over mass and length. The load does
/// not act back on the machine, whose cylinders hold their positions. Exact up to the integration (Runge-Kutta of order 4);
/// tests/optimizer/sway/ integrates the same load in angles with CVODES.
#include <Eigen/Dense>
#include <vector>

#include "models/machine/machine.h"
#include "models/machine/trajectory.h"

namespace sparflow {

/// The rope in the base frame.
struct RopeState {
  Eigen::Vector3d rope = Eigen::Vector3d::Zero();  ///< from the tip to the load [m]
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< its rate [m/s]
};

/// Angle of the rope from the vertical. [rad]
double rope_angle(const Machine& machine, const RopeState& s);
/// Largest angle to which the load would swing from this state if the tip went on at a constant velocity. [rad]
double swing_amplitude(const Machine& machine, const RopeState& s);

/// The load along a motion.
struct RopeCourse {
  std::vector<RopeState> knots;  ///< at the motion's instants
  Eigen::VectorXd stiffness;     ///< [1/s^2] mean of lambda in every interval
  double largest_angle = 0.0;    ///< [rad]
  double largest_at = 0.0;       ///< [s]
};

/// The load hangs still below the tip at first, and moves with it.
/// @param cable length of the rope [m] > 0  @param parts steps of the integration in an interval, at which angles are seen
RopeCourse rope_course(const Machine& machine, const Trajectory& motion, double cable, int parts);

}  // namespace sparflow
