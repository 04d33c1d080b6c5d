#pragma once
/// Bending booms as hinges with a spring (pseudo-rigid bodies): each link behind a revolute joint that carries a further
/// joint gets one passive hinge, parallel to the joint, at a quarter of the way to the next one. What the drive's linkage
/// touches on the link stays before the hinge, everything else lies behind it.
/// Source: Howell (2001), Compliant Mechanisms, ch. 5 (pseudo-rigid-body model); De Luca, Siciliano (1991), IEEE Trans.
/// Systems, Man, Cybernetics 21(4), first bending mode of a link.
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::plant {

struct FlexibleBooms {
  Machine machine;                ///< with the hinges as further joints
  std::vector<int> joint_of;      ///< index in `machine` of each joint of the original
  std::vector<int> hinges;        ///< indices in `machine` of the hinges
  std::vector<double> stiffness;  ///< [N m/rad] by hinge
  std::vector<double> damping;    ///< [N m s/rad] by hinge
};

/// @param angle [rad] by which each hinge bends under the largest static torque over the joints' ranges with `payload`;
/// 0: no hinges @param damping_ratio of the bending with the machine stretched out
FlexibleBooms flexible_booms(const Machine& machine, double angle, double damping_ratio,
                             double payload);

}  // namespace sparflow::plant
