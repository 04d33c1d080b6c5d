#pragma once
/// Torques that accelerate the machine, M(q) qdd + C(q, qd) qd, without gravity: recursive Newton-Euler over the
/// chain, with telescope stages and the masses of cylinders and linkages.
/// Luh, Walker, Paul (1980), J. Dyn. Syst. Meas. Control 102; Craig (2005), sec. 6.5.
#include "models/machine/kinematics.h"
#include "models/math/jet.h"

namespace sparflow {

/// @param q, qd, qdd by joint  @param payload [kg], a point mass at the tip
/// A link's inertia acts about its joint's axis; for a prismatic joint about the axis of the last revolute joint before
/// it. Rods, barrels, rockers and couplers are point masses at their centres.
/// @return [N m] or [N] by joint, positive where the actuator must push towards +q
/// @throws std::domain_error when a four-bar cannot close at q
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> inertial_torque(const Machine& machine,
                                                    const Eigen::Matrix<T, Eigen::Dynamic, 1>& q,
                                                    const Eigen::Matrix<T, Eigen::Dynamic, 1>& qd,
                                                    const Eigen::Matrix<T, Eigen::Dynamic, 1>& qdd,
                                                    double payload);

}  // namespace sparflow
