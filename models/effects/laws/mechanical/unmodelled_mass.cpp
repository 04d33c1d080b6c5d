#include "models/effects/builtin.h"

namespace sparflow {
namespace {

/// Sine of the angle between a link and the axis it turns about below which it has no side in the plane of its motion.
/// @threshold [1] 0..1e-2; numerical: rounding of the file's numbers
constexpr double kNoSide = 1e-6;

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
    // Mass and first moment enter the static force linearly, so that a point mass at the joint and a pure moment would
    // do; one link with one mass keeps the machine readable.
    const Eigen::Vector3d moment =
        p[1] * link_direction(machine, at) + (p.size() > 2 ? p[2] : 0.0) * link_normal(machine, at);
    if (p[0] != 0.0) {
      machine.links.push_back({"unmodelled mass", at, p[0], moment / p[0]});
    } else {
      machine.links.push_back({"unmodelled moment", at, 1.0, moment});
      machine.links.push_back({"unmodelled moment", at, -1.0, Eigen::Vector3d::Zero()});
    }
  }
};

}  // namespace

Eigen::Vector3d link_direction(const Machine& machine, int joint) {
  const auto next = static_cast<std::size_t>(joint) + 1;
  Eigen::Vector3d d = next < machine.joints.size()
                          ? machine.joints[next].origin.translation().eval()
                      : machine.tip.joint == joint ? machine.tip.xyz
                                                   : Eigen::Vector3d::Zero().eval();
  const Joint& own = machine.joints[static_cast<std::size_t>(joint)];
  /// Distance of the tip from the joint up to which it gives no direction.
  /// @threshold [m] 0..1e-2; numerical: rounding of the file's numbers
  constexpr double kNoLever = 1e-6;
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
