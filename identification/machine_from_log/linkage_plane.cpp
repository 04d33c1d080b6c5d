#include "identification/machine_from_log/linkage_plane.h"

#include <algorithm>

namespace sparflow::from_log {

Eigen::Vector3d to_next_joint(const Machine& machine, int joint) {
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  if (joint + 1 < machine.joint_count()) {
    to = machine.joints[static_cast<std::size_t>(joint + 1)].origin.translation();
  }
  if (to.norm() < 1e-6 && machine.tip.joint == joint) to = machine.tip.xyz;
  return to;
}

LinkagePlane::LinkagePlane(const Machine& machine, int cylinder) {
  const int j = machine.cylinders[static_cast<std::size_t>(cylinder)].joint;
  const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
  origin_ = joint.origin;
  axis_ = joint.axis;
  turns_ = joint.type == JointType::kRevolute;
  const Eigen::Vector3d next = to_next_joint(machine, j);
  along_ = next - axis_ * axis_.dot(next);
  if (along_.norm() < 1e-6) {
    const Eigen::Vector3d any = axis_.cross(Eigen::Vector3d::UnitX());
    along_ = any.norm() > 0.1 ? any : Eigen::Vector3d(axis_.cross(Eigen::Vector3d::UnitY()));
  }
  along_.normalize();
  across_ = axis_.cross(along_);
  reach_ = std::max({next.norm(), origin_.translation().norm(), 0.5});
}

Eigen::Vector3d LinkagePlane::on_child(const Eigen::Vector2d& place, double height) const {
  return place.x() * along_ + place.y() * across_ + height * axis_;
}

Eigen::Vector3d LinkagePlane::on_parent(const Eigen::Vector2d& place, double height) const {
  return origin_ * on_child(place, height);
}

Eigen::Vector2d LinkagePlane::of_child(const Eigen::Vector3d& pin) const {
  return {along_.dot(pin), across_.dot(pin)};
}

Eigen::Vector2d LinkagePlane::of_parent(const Eigen::Vector3d& pin) const {
  return of_child(origin_.inverse() * pin);
}

double LinkagePlane::height_parent(const Eigen::Vector3d& pin) const {
  return height_child(origin_.inverse() * pin);
}

}  // namespace sparflow::from_log
