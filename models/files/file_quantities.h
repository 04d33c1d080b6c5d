#pragma once
/// Quantities, rotations and ranges that machine and problem files have in common.
#include <Eigen/Core>

#include "models/machine/machine.h"
#include "models/math/units.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow::quantities {

using Sign = Quantity::Sign;
/// Coordinates and lengths of machines are below 200 m; a larger number is in millimetres.
inline constexpr Quantity kCoordinate{"coordinate", "m", Sign::kAny, 1.0, 200.0};
inline constexpr Quantity kLength{"length", "m", Sign::kPositive, 1.0, 200.0};
inline constexpr Quantity kMass{"mass", "kg", Sign::kNonNegative};
inline constexpr Quantity kAngle{"angle", "rad"};
inline constexpr Quantity kFlow{"flow", "l/min", Sign::kPositive, units::kLitrePerMinute};
inline constexpr Quantity kPressure{"pressure", "bar", Sign::kPositive, units::kBar, 10000.0};

/// Position, velocity (order 1) or acceleration (order 2) of a joint.
Quantity joint_quantity(JointType type, int order);

/// [lo, hi] of a velocity or acceleration; a motion starts and ends at rest, so lo < 0 < hi.
Range read_range_around_zero(const YamlValue& value, const Quantity& what);

/// Rz(yaw) Ry(pitch) Rx(roll), the convention of URDF. @param rpy roll, pitch, yaw [rad]
Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy);

}  // namespace sparflow::quantities
