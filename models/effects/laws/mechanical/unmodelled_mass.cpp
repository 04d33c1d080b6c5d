#include <cmath>

#include "models/effects/builtin.h"

namespace sparflow {
namespace {

/// Sine of the angle between a link and the axis it turns about below which it has no side in the plane of its motion.
/// @threshold [1] 0..1e-2; numerical: rounding of the file's numbers
constexpr double kNoSide = 1e-6;

/// Distance of the tip from the joint up to which it gives no direction.
/// @threshold [m] 0..1e-2; numerical: rounding of the file's numbers
constexpr double kNoLever = 1e-6;

/// Position of the next joint, or of the tip, in the frame of a joint. [m]
Eigen::Vector3d link_end(const Machine& machine, int joint) {
  const auto next = static_cast<std::size_t>(joint) + 1;
  if (next < machine.joints.size()) return machine.joints[next].origin.translation();
  return machine.tip.joint == joint ? machine.tip.xyz : Eigen::Vector3d::Zero().eval();
}

class UnmodelledMass final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "unmodelled_mass",
        .title = "unmodelled mass",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kJoint,
        .parameters =
            {{"mass", "kg", 1.0, 0.0, 2000.0, 60.0, "mass on the link", true, {}},
             {"moment",
              "kg m",
              1.0,
              -6000.0,
              6000.0,
              100.0,
              "mass times the distance of its centre along the link; distance = moment / mass",
              true,
              {}},
             {"cross_moment",
              "kg m",
              1.0,
              -6000.0,
              6000.0,
              50.0,
              "mass times the distance of its centre beside the link, in the plane of its motion; "
              "positive where the joint "
              "turns the link to",
              true,
              {},
              false,
              true}},
        .equation =
            "F = F_static(masses + mass at moment/mass along the link and cross_moment/mass beside "
            "it)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"payload_error", "base_tilt", "force_offset"},
        .separated_by = "a sweep of the poses without payload",
        .citation =
            "virtual work; Khalil & Dombre (2002), Modeling, Identification and Control of Robots, "
            "ch. 12",
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool changes_machine() const override { return true; }
  void change_machine(Machine& machine, int at, std::span<const double> p) const override {
    // Mass and first moments set the static force. The moment of inertia also depends on where the mass is: at their
    // quotient where that lies on the link; elsewhere the mass is not determined, and the moment is that of a mass at
    // the link's end. A moment beside the link is a couple without inertia.
    const Eigen::Vector3d along = link_direction(machine, at), beside = link_normal(machine, at);
    const double cross = p.size() > 2 ? p[2] : 0.0, length = link_length(machine, at);
    if (p[0] > 0.0 && std::hypot(p[1], cross) <= p[0] * length) {
      machine.links.push_back(
          {"unmodelled mass", at, p[0], (p[1] * along + cross * beside) / p[0]});
      return;
    }
    const auto add = [&](double mass, const Eigen::Vector3d& where) {
      if (mass != 0.0) machine.links.push_back({"unmodelled mass", at, mass, where});
    };
    const double end = p[1] / length, half_couple = 0.5 * cross / length;
    add(p[0] - end, Eigen::Vector3d::Zero());
    add(end, length * along);
    add(half_couple, length * beside);
    add(-half_couple, -length * beside);
  }

 private:
  /// Distance of the next joint, or of the tip, from the link's joint; 1 m where that is not a length. [m]
  static double link_length(const Machine& machine, int joint) {
    const double length = link_end(machine, joint).norm();
    return length < kNoLever ? 1.0 : length;
  }
};

}  // namespace

Eigen::Vector3d link_direction(const Machine& machine, int joint) {
  Eigen::Vector3d d = link_end(machine, joint);
  const Joint& own = machine.joints[static_cast<std::size_t>(joint)];
  if (d.norm() < kNoLever)
    d = own.type == JointType::kPrismatic ? own.axis : Eigen::Vector3d::UnitX().eval();
  return d.normalized();
}

Eigen::Vector3d link_normal(const Machine& machine, int joint) {
  Eigen::Isometry3d to_link = Eigen::Isometry3d::Identity();  // from the frame of joint k
  for (int k = joint; k >= 0; --k) {
    const Joint& one = machine.joints[static_cast<std::size_t>(k)];
    if (one.type == JointType::kRevolute) {
      const Eigen::Vector3d beside =
          (to_link.linear() * one.axis).cross(link_direction(machine, joint));
      // a link along its own axis of rotation has no side
      return beside.norm() > kNoSide ? beside.normalized() : Eigen::Vector3d::Zero().eval();
    }
    to_link = to_link * one.origin.inverse();
  }
  return Eigen::Vector3d::Zero();
}

std::unique_ptr<Effect> make_unmodelled_mass() { return std::make_unique<UnmodelledMass>(); }

}  // namespace sparflow
