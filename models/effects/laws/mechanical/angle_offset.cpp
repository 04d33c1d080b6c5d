#include <cmath>
#include <limits>
#include <stdexcept>

#include "models/effects/builtin.h"
#include "models/machine/linkage.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

class AngleOffset final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "angle_offset",
        .title = "joint angle offset",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kJoint,
        .parameters = {{"offset",
                        "deg",
                        units::kDegree,
                        -10 * units::kDegree,
                        10 * units::kDegree,
                        1 * units::kDegree,
                        "true angle minus logged angle",
                        true,
                        {}}},
        .equation = "F = F_static(q + offset), dx/dt = dx/dq(q + offset) dq/dt",
        .signals = {"cylinder force or both chamber pressures", "position",
                    "command, for the flow"},
        .confused_with = {"base_tilt", "unmodelled_mass", "payload_error"},
        .separated_by =
            "a sweep of the poses at two payloads; for the first joint also slewing, or the "
            "rod speed at constant command over the whole stroke",
        .citation =
            "Mooring, Roth, Driels (1991), Fundamentals of Manipulator Calibration; "
            "Khalil & Dombre (2002), ch. 11",
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    std::vector<int> revolute;
    for (int k = 0; k < machine.joint_count(); ++k) {
      if (machine.joints[static_cast<std::size_t>(k)].type == JointType::kRevolute) {
        revolute.push_back(k);
      }
    }
    return revolute;
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kForce, EvidenceKind::kFlow};
  }
  bool changes_machine() const override { return true; }
  void change_machine(Machine& machine, int at, std::span<const double> p) const override {
    Joint& joint = machine.joints[static_cast<std::size_t>(at)];
    joint.origin = joint.origin * Eigen::AngleAxisd(p[0], joint.axis);
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow) {
      return Effect::columns(log, measured, at, shape, columns);
    }
    const Machine& machine = *log.machine;
    const auto cylinder = static_cast<std::size_t>(measured.index);
    if (machine.cylinders[cylinder].joint != at || log.cylinders[cylinder].stroke_measured)
      return false;
    // The measured rod speed is dx/dq at the logged angle times dq/dt: the true speed less d2x/dq2 offset dq/dt.
    columns.setZero(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double q = log.q(k, at);
      columns(k, 0) = std::numeric_limits<double>::quiet_NaN();
      if (!std::isfinite(q)) continue;
      try {
        columns(k, 0) = -linkage_rates(machine, measured.index, q).d2 * log.qd(k, at);
      } catch (const std::domain_error&) {
        continue;  // The four-bar cannot close at this angle.
      }
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_angle_offset() { return std::make_unique<AngleOffset>(); }

}  // namespace sparflow
