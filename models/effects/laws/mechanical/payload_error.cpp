#include "models/effects/builtin.h"

namespace sparflow {
namespace {

class PayloadError final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "payload_error",
        .title = "payload error",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kMachine,
        .parameters = {{"mass",
                        "kg",
                        1.0,
                        -2000.0,
                        10e3,
                        80.0,
                        "mass at the tip that the log does not contain: lifting gear, a rope",
                        true,
                        {}},
                       {"scale",
                        "%",
                        0.01,
                        -0.5,
                        0.5,
                        0.02,
                        "true payload / logged payload - 1; the stated accuracy of crane scales "
                        "is 1 to 5 %, a weight that somebody enters may be far off",
                        true,
                        {},
                        false,
                        true}},
        .equation = "F = F_static(payload (1 + scale) + mass)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"unmodelled_mass", "base_tilt", "angle_offset"},
        .separated_by = "the same poses with two or three weighed payloads and a change of reach",
        .citation =
            "virtual work; Swevers, Verdonck, De Schutter (2007), IEEE Control Systems "
            "Magazine 27(5)",
        .in_motion = "force"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return machine.tip.joint < 0 ? std::vector<int>{} : std::vector<int>{-1};
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool changes_machine() const override { return true; }
  void change_machine(Machine& machine, int, std::span<const double> p) const override {
    machine.tip.payload_scale *= 1.0 + p[1];
    if (p[0] == 0.0) return;
    Link load;
    load.name = "payload error";
    load.joint = machine.tip.joint;
    load.mass = p[0];
    load.cog = machine.tip.xyz;
    machine.links.push_back(load);
  }
};

}  // namespace

std::unique_ptr<Effect> make_payload_error() { return std::make_unique<PayloadError>(); }

}  // namespace sparflow
