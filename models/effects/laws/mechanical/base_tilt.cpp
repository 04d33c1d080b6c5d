#include <cmath>

#include "models/effects/builtin.h"
#include "models/machine/kinematics.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

/// [-] Sine of 20 degrees, within which an axis counts as horizontal, so that a crane on a slope has a luffing joint.
/// @threshold [1] 0..1; chosen: the steepest slope on which a crane works
constexpr double kHorizontal = 0.35;

Eigen::Vector3d luffing_axis(const Machine& machine, int joint) {
  ChainGeometry chain(machine);
  const std::vector<double> zero(machine.joints.size(), 0.0);
  chain.update(machine, zero.data());
  return chain.axis[static_cast<std::size_t>(joint)];
}

class BaseTilt final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "base_tilt",
        .title = "base tilt",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters = {{"angle",
                        "deg",
                        units::kDegree,
                        -15 * units::kDegree,
                        15 * units::kDegree,
                        2 * units::kDegree,
                        "rotation of the base about the first luffing joint's axis, in that "
                        "joint's positive direction",
                        true,
                        {}}},
        .equation = "F = F_static(gravity rotated by -angle in the base frame)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"angle_offset", "unmodelled_mass", "payload_error"},
        .separated_by =
            "slewing: a tilt varies with the sine of the slewing angle, an offset does not",
        .citation =
            "Craig (2005), Introduction to Robotics, sec. 6.5: gravity as an acceleration "
            "of the base",
        // A base that tilts across the arm as well is part of this error.
        .form_error = 0.04,
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return first_luffing_joint(machine) < 0 ? std::vector<int>{} : std::vector<int>{-1};
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool changes_machine() const override { return true; }
  void change_machine(Machine& machine, int, std::span<const double> p) const override {
    const Eigen::Vector3d axis = luffing_axis(machine, first_luffing_joint(machine));
    machine.gravity = Eigen::AngleAxisd(-p[0], axis) * machine.gravity;
  }
};

}  // namespace

int first_luffing_joint(const Machine& machine) {
  ChainGeometry chain(machine);
  const std::vector<double> zero(machine.joints.size(), 0.0);
  chain.update(machine, zero.data());
  const double g = machine.gravity.norm();
  for (int k = 0; k < machine.joint_count(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (chain.revolute[i] && std::abs(chain.axis[i].dot(machine.gravity)) < kHorizontal * g)
      return k;
  }
  return -1;
}

std::unique_ptr<Effect> make_base_tilt() { return std::make_unique<BaseTilt>(); }

}  // namespace sparflow
