#include "apps/report/charts/drawing_geometry.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <variant>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using Frames = std::vector<Frame<double>>;

// A revolute joint swings the arm when its axis is within 45 degrees of the vertical, otherwise it lifts it.
constexpr double kUprightCosine = 0.7071;
// [-] Share of the shortest pin-to-pin length that the barrel takes; the rest is rod eye and gland.
constexpr double kBarrelShare = 0.86;

/// Drawings of one joint's way over its range.
/// @threshold [1] 4..500; chosen: 10 deg apart for a joint that turns around
constexpr int kFramesOfLeg = 36;

Vector3d axis_in_base(const Machine& machine, const Frames& frames, int joint) {
  const auto j = static_cast<std::size_t>(joint);
  return frames[j].rotation * machine.joints[j].axis;
}

/// Origin [m] of joint k's frame at coordinate zero, where it is mounted on its parent link.
Vector3d mount(const Machine& machine, const Frames& frames, int joint) {
  const Joint& j = machine.joints[static_cast<std::size_t>(joint)];
  return point_in_base(frames, joint - 1, Vector3d(j.origin.translation()));
}

Vector3d up_direction(const Machine& machine) {
  return machine.gravity.norm() > 0.0 ? Vector3d(-machine.gravity.normalized()) : Vector3d::UnitZ();
}

Vector3d horizontal_part(const Vector3d& v, const Vector3d& up) { return v - up * up.dot(v); }

VectorXd mid_range(const Machine& machine) {
  VectorXd q(machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Range& range = machine.joints[static_cast<std::size_t>(k)].position;
    const double middle = 0.5 * (range.lo + range.hi);
    q[k] = std::isfinite(middle) ? middle : 0.0;
  }
  return q;
}

/// Indices of the joint that lifts the arm and of the joint before it that swings it; -1 = none.
struct ArmJoints {
  int lift = -1;
  int swing = -1;
};

ArmJoints arm_joints(const Machine& machine, const Frames& frames, const Vector3d& up) {
  ArmJoints arm;
  for (int k = 0; k < machine.joint_count(); ++k) {
    if (machine.joints[static_cast<std::size_t>(k)].type != JointType::kRevolute) continue;
    if (std::abs(axis_in_base(machine, frames, k).dot(up)) > kUprightCosine) {
      if (arm.swing < 0) arm.swing = k;
    } else {
      arm.lift = k;
      return arm;
    }
  }
  return arm;
}

/// Horizontal direction of a machine without a lifting joint: along the first prismatic joint that is not vertical,
/// else along x or y.
Vector3d fallback_direction(const Machine& machine, const Frames& frames, const Vector3d& up) {
  for (int k = 0; k < machine.joint_count(); ++k) {
    if (machine.joints[static_cast<std::size_t>(k)].type != JointType::kPrismatic) continue;
    const Vector3d across = horizontal_part(axis_in_base(machine, frames, k), up);
    if (across.norm() > 0.1) return across.normalized();
  }
  const Vector3d along_x = horizontal_part(Vector3d::UnitX(), up);
  return (along_x.norm() > 0.1 ? along_x : horizontal_part(Vector3d::UnitY(), up)).normalized();
}

std::string base_axis_name(const Vector3d& direction, const char* otherwise) {
  const char* names[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    if (direction[i] > 0.9999) return names[i];
  }
  return otherwise;
}

void append_links(const Machine& machine, const Frames& frames, const Vector3d& up,
                  std::vector<MachinePart>& parts) {
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Vector3d to = mount(machine, frames, k);
    // The base is drawn as a column from the height of its frame's origin up to the first joint.
    const Vector3d from =
        k == 0 ? horizontal_part(to, up) : frames[static_cast<std::size_t>(k - 1)].position;
    parts.push_back({PartKind::kLink, {from, to}});
    if (machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute) continue;
    // The stages that share this joint's travel; each ends at its fraction of the travel.
    std::vector<double> ends;
    for (const Link& link : machine.links) {
      if (link.slides_with == k && link.fraction > 0.0 && link.fraction < 1.0) {
        ends.push_back(link.fraction);
      }
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    ends.push_back(1.0);
    const Vector3d travel = frames[static_cast<std::size_t>(k)].position - to;
    double begin = 0.0;
    for (const double end : ends) {
      parts.push_back({PartKind::kTelescope, {to + begin * travel, to + end * travel}});
      begin = end;
    }
  }
  if (machine.tip.xyz.norm() > 0.0) {
    const Vector3d from = point_in_base(frames, machine.tip.joint, Vector3d(Vector3d::Zero()));
    parts.push_back(
        {PartKind::kLink, {from, point_in_base(frames, machine.tip.joint, machine.tip.xyz)}});
  }
}

/// Shortest pin-to-pin length over the joint's range [m].
double shortest_length(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (c.length_at_zero_stroke) return *c.length_at_zero_stroke;
  const Range& range = machine.joints[static_cast<std::size_t>(c.joint)].position;
  double shortest = INFINITY;
  constexpr int kSamples = 32;
  for (int i = 0; i <= kSamples; ++i) {
    try {
      const double q = range.lo + (range.hi - range.lo) * i / kSamples;
      shortest = std::min(shortest, cylinder_length(machine, cylinder, q));
    } catch (const std::domain_error&) {
      continue;  // The four-bar does not close there.
    }
  }
  return shortest;
}

/// Where a mark lies at one configuration, in the base frame; empty where a four-bar does not close.
std::vector<Vector3d> mark_points(const Machine& machine, const Frames& frames, const VectorXd& q,
                                  const MarkedPlace& mark) {
  if (mark.link >= 0) {
    const Link& link = machine.links[static_cast<std::size_t>(mark.link)];
    Vector3d centre = point_in_base(frames, link.joint, link.cog);
    if (link.slides_with >= 0)
      centre +=
          link.fraction * q[link.slides_with] * axis_in_base(machine, frames, link.slides_with);
    return {centre};
  }
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(mark.cylinder)];
  if (!std::holds_alternative<FourBarLinkage>(c.linkage) &&
      !std::holds_alternative<PinsLinkage>(c.linkage))
    return {mount(machine, frames, c.joint), frames[static_cast<std::size_t>(c.joint)].position};
  try {
    const LinkagePins<double> local = linkage_pins(machine, mark.cylinder, q[c.joint]);
    return {point_in_base(frames, c.joint - 1, local.barrel),
            point_in_base(frames, c.joint - 1, local.rod)};
  } catch (const std::domain_error&) {
    return {};
  }
}

/// Parts of a machine in the order in which they are drawn: pins over everything.
struct DrawnParts {
  std::vector<MachinePart> parts, pins;
};

/// Appends bars, cylinder and their pins.
void append_cylinder(const Machine& machine, const Frames& frames, const VectorXd& q, int cylinder,
                     DrawnParts& drawn) {
  auto& [parts, pins] = drawn;
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  const bool four_bar = std::holds_alternative<FourBarLinkage>(c.linkage);
  if (!four_bar && !std::holds_alternative<PinsLinkage>(c.linkage)) return;

  std::vector<PartKind> kinds = {PartKind::kRod, PartKind::kBarrel};
  if (four_bar) kinds.insert(kinds.begin(), {PartKind::kRocker, PartKind::kCoupler});
  const std::size_t pin_count = four_bar ? 4 : 2;
  try {
    const LinkagePins<double> local = linkage_pins(machine, cylinder, q[c.joint]);
    const auto base = [&](const Vector3d& p) { return point_in_base(frames, c.joint - 1, p); };
    const Vector3d barrel = base(local.barrel), rod = base(local.rod);
    const double length = (rod - barrel).norm();
    const double barrel_length =
        std::min(length, kBarrelShare * shortest_length(machine, cylinder));
    if (four_bar) {
      parts.push_back({PartKind::kRocker, {base(local.rocker), rod}});
      parts.push_back({PartKind::kCoupler, {base(local.coupler), rod}});
    }
    parts.push_back({PartKind::kRod, {barrel, rod}});
    parts.push_back(
        {PartKind::kBarrel, {barrel, barrel + (rod - barrel) * (barrel_length / length)}});
    pins.push_back({PartKind::kPin, {barrel}});
    pins.push_back({PartKind::kPin, {rod}});
    if (four_bar) {
      pins.push_back({PartKind::kPin, {base(local.rocker)}});
      pins.push_back({PartKind::kPin, {base(local.coupler)}});
    }
  } catch (const std::domain_error&) {
    // A logged posture may lie a little outside the linkage's range; the other parts are still drawn.
    for (const PartKind kind : kinds) parts.push_back({kind, {}});
    for (std::size_t i = 0; i < pin_count; ++i) pins.push_back({PartKind::kPin, {}});
  }
}

}  // namespace

DrawingPlane drawing_plane(const Machine& machine, const VectorXd& q) {
  DrawingPlane plane;
  plane.up = up_direction(machine);
  const auto direction = [&](const Frames& frames, const ArmJoints& arm) -> Vector3d {
    if (arm.lift < 0) return fallback_direction(machine, frames, plane.up);
    return plane.up.cross(axis_in_base(machine, frames, arm.lift)).normalized();
  };
  const Frames frames = forward_kinematics<double>(machine, q);
  const ArmJoints arm = arm_joints(machine, frames, plane.up);
  plane.horizontal = direction(frames, arm);
  plane.turns = arm.swing >= 0;
  if (plane.turns) {
    const Vector3d on_axis = frames[static_cast<std::size_t>(arm.swing)].position;
    plane.origin = horizontal_part(on_axis, plane.up);
    // The sign is that at mid-range, not of this posture, so that an arm leaning back is drawn behind its column.
    const Frames middle = forward_kinematics<double>(machine, mid_range(machine));
    const Vector3d reach = point_in_base(middle, machine.tip.joint, machine.tip.xyz) - plane.origin;
    if (reach.dot(direction(middle, arm)) < 0.0) plane.horizontal = -plane.horizontal;
    plane.horizontal_name = "radius";
  } else {
    Eigen::Index largest = 0;
    plane.horizontal.cwiseAbs().maxCoeff(&largest);
    if (plane.horizontal[largest] < 0.0) plane.horizontal = -plane.horizontal;
    plane.horizontal_name = base_axis_name(plane.horizontal, "horizontal");
  }
  plane.vertical_name = base_axis_name(plane.up, "height");
  return plane;
}

std::vector<MachinePart> machine_parts(const Machine& machine, const VectorXd& q) {
  SPARFLOW_CHECK(q.size() == machine.joint_count(), "one coordinate a joint");
  const Frames frames = forward_kinematics<double>(machine, q);
  DrawnParts drawn;
  auto& [parts, pins] = drawn;
  append_links(machine, frames, up_direction(machine), parts);
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    append_cylinder(machine, frames, q, c, drawn);
  }
  for (int k = 0; k < machine.joint_count(); ++k) {
    if (machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute) {
      pins.push_back({PartKind::kPin, {frames[static_cast<std::size_t>(k)].position}});
    }
  }
  parts.insert(parts.end(), pins.begin(), pins.end());
  return std::move(parts);
}

DrawingPlane top_plane(const Machine& machine) {
  DrawingPlane plane;
  const Vector3d above = up_direction(machine);
  plane.horizontal = horizontal_part(Vector3d::UnitX(), above);
  if (plane.horizontal.norm() < 0.1) plane.horizontal = horizontal_part(Vector3d::UnitY(), above);
  plane.horizontal.normalize();
  plane.up = above.cross(plane.horizontal);
  plane.horizontal_name = base_axis_name(plane.horizontal, "ahead");
  plane.vertical_name = base_axis_name(plane.up, "to the left");
  return plane;
}

DrawingFrame drawing_frame(const Machine& machine, const VectorXd& q, double time,
                           const DrawingPlane& plane) {
  DrawingFrame frame;
  frame.time = time;
  frame.tip = plane.project(tip_position<double>(machine, q));
  for (const MachinePart& part : machine_parts(machine, q)) {
    DrawingPart flat{part.kind, {}};
    for (const Vector3d& p : part.points) flat.points.push_back(plane.project(p));
    frame.parts.push_back(std::move(flat));
  }
  return frame;
}

DrawingFrame drawing_frame(const Machine& machine, const VectorXd& q, double time) {
  return drawing_frame(machine, q, time, drawing_plane(machine, q));
}

std::vector<DrawingFrame> drawing_frames(const Machine& machine, const Trajectory& motion,
                                         int count, const std::optional<DrawingPlane>& fixed,
                                         const std::vector<MarkedPlace>& marks) {
  std::vector<DrawingFrame> frames;
  if (motion.size() == 0 || count < 1) return frames;
  const auto add = [&](const VectorXd& q, double time) {
    const DrawingPlane plane = fixed ? *fixed : drawing_plane(machine, q);
    frames.push_back(drawing_frame(machine, q, time, plane));
    if (marks.empty()) return;
    const Frames links = forward_kinematics<double>(machine, q);
    for (const MarkedPlace& mark : marks) {
      DrawingPart part{PartKind::kMark, {}};
      for (const Vector3d& p : mark_points(machine, links, q, mark))
        part.points.push_back(plane.project(p));
      frames.back().parts.push_back(std::move(part));
    }
  };
  if (motion.size() == 1 || count == 1) {
    const Eigen::Index last = motion.size() - 1;
    add(motion.q.row(last), motion.t[last]);
    return frames;
  }
  Eigen::Index k = 0;
  for (int i = 0; i < count; ++i) {
    const double time = motion.t[0] + motion.duration() * i / (count - 1);
    while (k + 2 < motion.size() && motion.t[k + 1] < time) ++k;
    const double step = motion.t[k + 1] - motion.t[k];
    const double share = step > 0.0 ? std::clamp((time - motion.t[k]) / step, 0.0, 1.0) : 1.0;
    const VectorXd q = (1.0 - share) * motion.q.row(k) + share * motion.q.row(k + 1);
    add(q, time);
  }
  return frames;
}

Trajectory joint_sweep(const Machine& machine, const VectorXd& posture) {
  std::vector<VectorXd> q = {posture};
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Range& range = machine.joints[static_cast<std::size_t>(j)].position;
    for (const double end : {range.lo, range.hi, posture[j]}) {
      VectorXd next = posture;
      next[j] = end;
      q.push_back(next);
    }
  }
  Trajectory motion;
  const auto n = static_cast<Eigen::Index>(q.size());
  motion.t = VectorXd::LinSpaced(n, 0.0, static_cast<double>(n - 1));
  motion.q.resize(n, machine.joint_count());
  for (Eigen::Index k = 0; k < n; ++k) motion.q.row(k) = q[static_cast<std::size_t>(k)].transpose();
  motion.qd = motion.qdd = Eigen::MatrixXd::Zero(n, machine.joint_count());
  return motion;
}

int joint_sweep_frames(const Trajectory& sweep) {
  return kFramesOfLeg * static_cast<int>(sweep.size() - 1);
}

}  // namespace sparflow
