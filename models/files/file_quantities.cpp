#include "models/files/file_quantities.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

namespace sparflow::quantities {

Quantity joint_quantity(JointType type, int order) {
  const bool revolute = type == JointType::kRevolute;
  if (order == 0) return {revolute ? "angle" : "position", revolute ? "rad" : "m"};
  if (order == 1) return {"velocity", revolute ? "rad/s" : "m/s"};
  return {"acceleration", revolute ? "rad/s^2" : "m/s^2"};
}

Range read_range_around_zero(const YamlValue& value, const Quantity& what) {
  const Range r = value.range(what);
  if (!(r.lo < 0.0 && r.hi > 0.0)) {
    value.fail(
        fmt::format("got [{:g}, {:g}], expected lo < 0 < hi; every motion starts and ends at rest",
                    r.lo, r.hi));
  }
  return r;
}

Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

}  // namespace sparflow::quantities
