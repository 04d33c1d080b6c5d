#include "models/effects/builtin.h"

namespace sparflow {
namespace {

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
              {}}},
        .equation = "F = F_static(masses + mass at moment/mass along the link)",
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
    const Eigen::Vector3d along = link_direction(machine, at);
    if (p[0] != 0.0) {
      machine.links.push_back({"unmodelled mass", at, p[0], along * (p[1] / p[0])});
    } else {
      machine.links.push_back({"unmodelled moment", at, 1.0, along * p[1]});
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

std::unique_ptr<Effect> make_unmodelled_mass() { return std::make_unique<UnmodelledMass>(); }

}  // namespace sparflow
