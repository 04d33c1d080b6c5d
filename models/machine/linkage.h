#pragma once
/// Cylinder length as a function of the joint it drives, for every linkage type (paper eqs. 2-4).
/// All quantities are in the *parent link's* frame of the driven joint and depend on that one joint coordinate only, so
/// that Taylor numbers of one variable give all derivatives.
#include <stdexcept>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/taylor.h"

namespace sparflow {

/// A point fixed in the joint's link frame, seen from the parent link's frame [m].
template <class T>
Vector3<T> child_point_in_parent(const Joint& joint, const Eigen::Vector3d& point, const T& q) {
  using std::cos;
  using std::sin;
  Vector3<T> local;
  if (joint.type == JointType::kPrismatic) {
    for (int i = 0; i < 3; ++i) local[i] = point[i] + joint.axis[i] * q;
  } else {
    // Rodrigues: the part along the axis is constant, the rest rotates.
    const Eigen::Vector3d along = joint.axis * joint.axis.dot(point);
    const Eigen::Vector3d across = point - along;
    const Eigen::Vector3d turned = joint.axis.cross(point);
    const T c = cos(q), s = sin(q);
    for (int i = 0; i < 3; ++i) local[i] = along[i] + across[i] * c + turned[i] * s;
  }
  Vector3<T> result;
  const Eigen::Matrix3d rotation = joint.origin.linear();
  for (int i = 0; i < 3; ++i) {
    result[i] = joint.origin.translation()[i] + rotation(i, 0) * local[0] +
                rotation(i, 1) * local[1] + rotation(i, 2) * local[2];
  }
  return result;
}

/// Pins of a cylinder in the parent link's frame [m]; rocker and coupler pins only for a four-bar.
template <class T>
struct LinkagePins {
  Vector3<T> barrel, rod;
  Vector3<T> rocker, coupler;
  bool four_bar = false;
};

/// @throws std::domain_error when a four-bar cannot close at q
template <class T>
LinkagePins<T> linkage_pins(const Machine& machine, int cylinder, const T& q) {
  using std::sqrt;
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
  LinkagePins<T> pins;
  if (const auto* p = std::get_if<PinsLinkage>(&c.linkage)) {
    const Vector3<T> fixed = p->parent_pin.cast<T>();
    const Vector3<T> moving = child_point_in_parent(joint, p->child_pin, q);
    pins.barrel = p->barrel_on_parent ? fixed : moving;
    pins.rod = p->barrel_on_parent ? moving : fixed;
  } else if (const auto* f = std::get_if<FourBarLinkage>(&c.linkage)) {
    pins.four_bar = true;
    pins.barrel = f->barrel.cast<T>();
    pins.rocker = f->rocker.cast<T>();
    pins.coupler = child_point_in_parent(joint, f->coupler, q);
    const Vector3<T> axis = (joint.origin.linear() * joint.axis).eval().cast<T>();
    Vector3<T> between = pins.coupler - pins.rocker;
    const T along_axis = between.dot(axis);
    for (int i = 0; i < 3; ++i) between[i] = between[i] - along_axis * axis[i];
    const T distance2 = between.dot(between);
    const T distance = sqrt(distance2);
    const double r = f->rocker_length, k = f->coupler_length;
    const T a = (distance2 + (r * r - k * k)) / (2.0 * distance);
    const T h2 = r * r - a * a;
    if (!(plain(h2) > 0.0)) throw std::domain_error("the four-bar cannot close");
    const T h = static_cast<double>(f->branch) * sqrt(h2);
    Vector3<T> e, n;
    for (int i = 0; i < 3; ++i) e[i] = between[i] / distance;
    n = axis.cross(e);
    for (int i = 0; i < 3; ++i) pins.rod[i] = pins.rocker[i] + a * e[i] + h * n[i];
  } else {  // For rack and direct the pins only serve drawings, along the joint's axis.
    pins.barrel = joint.origin.translation().cast<T>();
    pins.rod = child_point_in_parent(joint, Eigen::Vector3d::Zero(), q);
  }
  return pins;
}

/// Pin-to-pin length of the cylinder [m]; for `rack` x = radius q, for `direct` x = q.
/// @throws std::domain_error when a four-bar cannot close at q
template <class T>
T cylinder_length(const Machine& machine, int cylinder, const T& q) {
  using std::sqrt;
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (const auto* rack = std::get_if<RackLinkage>(&c.linkage)) return rack->radius * q;
  if (std::holds_alternative<DirectLinkage>(c.linkage)) return q;
  const LinkagePins<T> pins = linkage_pins(machine, cylinder, q);
  const Vector3<T> d = pins.rod - pins.barrel;
  return sqrt(d.dot(d));
}

/// Length and its first three derivatives with respect to the joint coordinate.
/// @throws std::domain_error when a four-bar cannot close at q
Taylor3 linkage_rates(const Machine& machine, int cylinder, double q);

/// Measured stroke [m] = pin-to-pin length - length_at_zero_stroke.
double stroke_at(const Machine& machine, int cylinder, double q);

/// Joint coordinate at a measured stroke, the inverse C^-1 of paper eq. 3: bracketed Newton within the
/// joint's range widened by `slack` (sensors read a little past the stops).
/// @throws std::domain_error when no joint coordinate in that range has this stroke
double joint_at_stroke(const Machine& machine, int cylinder, double stroke, double slack = 0.15);

/// A mass carried by the linkage (barrel, rod, rocker, coupler), in the parent link's frame.
template <class T>
struct LinkageMass {
  double mass = 0.0;    ///< [kg]
  Vector3<T> position;  ///< [m]
};

/// The moving masses of a cylinder; none for racks. At most four.
template <class T>
void append_linkage_masses(const Machine& machine, int cylinder, const T& q,
                           std::vector<LinkageMass<T>>& out) {
  using std::sqrt;
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const auto* f = std::get_if<FourBarLinkage>(&c.linkage);
  const bool masses = c.barrel_mass > 0.0 || c.rod_mass > 0.0 ||
                      (f && (f->rocker_mass > 0.0 || f->coupler_mass > 0.0));
  if (!masses || std::holds_alternative<RackLinkage>(c.linkage)) return;
  const LinkagePins<T> pins = linkage_pins(machine, cylinder, q);
  Vector3<T> direction;
  if (std::holds_alternative<DirectLinkage>(c.linkage)) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(c.joint)];
    direction = (joint.origin.linear() * joint.axis).eval().cast<T>();
  } else {
    const Vector3<T> d = pins.rod - pins.barrel;
    const T length = sqrt(d.dot(d));
    for (int i = 0; i < 3; ++i) direction[i] = d[i] / length;
  }
  const auto between = [](const Vector3<T>& from, const Vector3<T>& to, double share) {
    Vector3<T> p;
    for (int i = 0; i < 3; ++i) p[i] = from[i] + share * (to[i] - from[i]);
    return p;
  };
  Vector3<T> p;
  if (c.barrel_mass > 0.0) {
    for (int i = 0; i < 3; ++i) p[i] = pins.barrel[i] + c.barrel_cog * direction[i];
    out.push_back({c.barrel_mass, p});
  }
  if (c.rod_mass > 0.0) {
    for (int i = 0; i < 3; ++i) p[i] = pins.rod[i] - c.rod_cog * direction[i];
    out.push_back({c.rod_mass, p});
  }
  if (f && f->rocker_mass > 0.0) {
    out.push_back(
        {f->rocker_mass, between(pins.rocker, pins.rod, f->rocker_cog / f->rocker_length)});
  }
  if (f && f->coupler_mass > 0.0) {
    out.push_back(
        {f->coupler_mass, between(pins.coupler, pins.rod, f->coupler_cog / f->coupler_length)});
  }
}

}  // namespace sparflow
