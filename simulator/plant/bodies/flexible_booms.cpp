#include "simulator/plant/bodies/flexible_booms.h"

#include <cmath>

#include "models/machine/static_force.h"
#include "simulator/plant/bodies/rigid_bodies.h"

namespace sparflow::plant {
namespace {

constexpr double kHingeShare =
    0.25;  // of the way to the next joint; a cantilever's pseudo-rigid pivot is near its root

/// Moves a linkage's points that lie on the parent link into the frame of the hinge behind it.
void shift_parent_points(Linkage& linkage, const Eigen::Vector3d& by) {
  if (auto* pins = std::get_if<PinsLinkage>(&linkage)) pins->parent_pin -= by;
  if (auto* bar = std::get_if<FourBarLinkage>(&linkage)) {
    bar->barrel -= by;
    bar->rocker -= by;
  }
}

/// Inserts a hinge behind joint `j` at `place` in its link's frame.
void insert_hinge(FlexibleBooms& b, int j, const Eigen::Vector3d& place) {
  Machine& m = b.machine;
  const auto at = static_cast<std::size_t>(j);
  Joint hinge;
  hinge.name = m.joints[at].name + "_bending";
  hinge.axis = m.joints[at].axis;
  hinge.origin.translation() = place;
  hinge.position = {-0.5, 0.5};
  hinge.velocity = {-1.0, 1.0};
  hinge.acceleration = {-10.0, 10.0};
  const auto behind = [j](int& joint) { joint += joint > j ? 1 : 0; };
  if (at + 1 < m.joints.size()) m.joints[at + 1].origin.translation() -= place;
  for (Link& link : m.links) {
    if (link.joint == j) {
      link.joint = j + 1;
      link.cog -= place;
    } else {
      behind(link.joint);
    }
    behind(link.slides_with);
  }
  for (Cylinder& c : m.cylinders) {
    if (c.joint == j + 1) shift_parent_points(c.linkage, place);
    behind(c.joint);
  }
  if (m.tip.joint == j) {
    m.tip.joint = j + 1;
    m.tip.xyz -= place;
  } else {
    behind(m.tip.joint);
  }
  m.joints.insert(m.joints.begin() + j + 1, hinge);
  for (int& joint : b.joint_of) behind(joint);
  for (int& joint : b.hinges) behind(joint);
  b.hinges.push_back(j + 1);
}

/// Largest static torque of each hinge over the corners of the joints' ranges. [N m]
Eigen::VectorXd largest_torques(const FlexibleBooms& b, double payload) {
  const auto n = b.joint_of.size();
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(b.hinges.size()));
  // Postures on a lattice of three values for each joint, at most six joints of it.
  std::size_t postures = 1;
  for (std::size_t k = 0; k < std::min<std::size_t>(n, 6); ++k) postures *= 3;
  for (std::size_t p = 0; p < postures; ++p) {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(b.machine.joint_count());
    std::size_t rest = p;
    for (std::size_t k = 0; k < n; ++k) {
      const Range r = b.machine.joints[static_cast<std::size_t>(b.joint_of[k])].position;
      q[b.joint_of[k]] = r.lo + 0.5 * (r.hi - r.lo) * static_cast<double>(rest % 3);
      rest /= 3;
    }
    StaticForce force(b.machine);
    try {
      force.update(q.data(), payload, 0);
    } catch (const std::domain_error&) {
      continue;  // a four-bar that closes only without bending at the very end of its range
    }
    for (std::size_t h = 0; h < b.hinges.size(); ++h) {
      const auto i = static_cast<Eigen::Index>(h);
      largest[i] = std::max(largest[i], std::abs(force.torque()[b.hinges[h]]));
    }
  }
  return largest;
}

}  // namespace

FlexibleBooms flexible_booms(const Machine& machine, double angle, double damping_ratio,
                             double payload) {
  FlexibleBooms b;
  b.machine = machine;
  for (int k = 0; k < machine.joint_count(); ++k) b.joint_of.push_back(k);
  if (angle <= 0.0) return b;
  for (int k = machine.joint_count() - 2; k >= 0; --k) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(k)];
    const Eigen::Vector3d next =
        machine.joints[static_cast<std::size_t>(k) + 1].origin.translation();
    const Eigen::Vector3d across = next - joint.axis * joint.axis.dot(next);
    // A slewing column bends about no axis of its own joint, and a joint without an arm has no boom.
    const bool vertical =
        k == 0 &&
        std::abs((joint.origin.linear() * joint.axis).dot(machine.gravity.normalized())) > 0.9;
    if (joint.type != JointType::kRevolute || across.norm() < 0.1 || vertical) continue;
    insert_hinge(b, k, kHingeShare * next);
  }
  const Eigen::VectorXd torque = largest_torques(b, payload);
  RigidBodies bodies(b.machine, {}, payload);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(b.machine.joint_count()), still = q;
  for (const int k : b.joint_of) {
    const Range r = b.machine.joints[static_cast<std::size_t>(k)].position;
    q[k] = 0.5 * (r.lo + r.hi);
  }
  bodies.update(q.data(), still.data());
  for (std::size_t h = 0; h < b.hinges.size(); ++h) {
    const double stiffness = std::max(torque[static_cast<Eigen::Index>(h)], 1.0) / angle;
    const double inertia = bodies.mass()(b.hinges[h], b.hinges[h]);
    b.stiffness.push_back(stiffness);
    b.damping.push_back(2.0 * damping_ratio * std::sqrt(stiffness * inertia));
  }
  return b;
}

}  // namespace sparflow::plant
