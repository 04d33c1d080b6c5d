#include "models/effects/builtin.h"

namespace sparflow {
namespace {

class ViscousFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "viscous_friction",
        .title = "viscous friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters =
            {{"B", "N s/m", 1.0, 0.0, 5e6, 1e5, "friction force per rod speed", true, {}}},
        .equation = "F = F_static + B v",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"line_loss", "sensor_delay", "coulomb_friction"},
        .separated_by = "the same stroke at three speeds",
        .citation =
            "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), sec. 2; "
            "Jelali & Kroll (2003), Hydraulic Servo-systems",
        .form_error = 0.05,
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    out[i] += p[0] * s.speed[i];
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_viscous_friction() { return std::make_unique<ViscousFriction>(); }

}  // namespace sparflow
