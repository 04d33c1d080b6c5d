#pragma once
/// The plane normal to a joint's axis, in which its cylinder's pins lie: x from the joint towards the next joint or the tip.
#include "models/machine/machine.h"

namespace sparflow::from_log {

/// Direction and length from a joint to the next one, or to the tip, in the joint's frame [m].
Eigen::Vector3d to_next_joint(const Machine& machine, int joint);

class LinkagePlane {
 public:
  LinkagePlane(const Machine& machine, int cylinder);
  bool turns() const { return turns_; }
  /// Size of the two links [m], by which coordinates of pins are judged.
  double reach() const { return reach_; }
  /// A pin from its place in the plane at joint position 0, and its height above the joint's origin along the axis [m].
  Eigen::Vector3d on_parent(const Eigen::Vector2d& place, double height) const;  ///< parent's frame
  Eigen::Vector3d on_child(const Eigen::Vector2d& place, double height) const;   ///< joint's frame
  Eigen::Vector2d of_parent(const Eigen::Vector3d& pin) const;
  Eigen::Vector2d of_child(const Eigen::Vector3d& pin) const;
  double height_parent(const Eigen::Vector3d& pin) const;
  double height_child(const Eigen::Vector3d& pin) const { return axis_.dot(pin); }

 private:
  Eigen::Isometry3d origin_;
  Eigen::Vector3d axis_, along_, across_;
  double reach_ = 1.0;
  bool turns_ = true;
};

}  // namespace sparflow::from_log
