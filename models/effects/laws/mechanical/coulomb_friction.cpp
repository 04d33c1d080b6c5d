#include "models/effects/builtin.h"

namespace sparflow {
namespace {

class CoulombFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "coulomb_friction",
        .title = "Coulomb friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters =
            {{"Fc", "N", 1.0, 0.0, 60e3, 8e3, "friction force, the same at every speed", true, {}}},
        .equation = "F = F_static + Fc sign(v)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"load_friction", "stribeck_friction", "presliding"},
        .separated_by = "slow motions up and down through the same poses",
        .citation =
            "C. A. Coulomb (1785); Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica "
            "30(7), sec. 2",
        .form_error = 0.05,
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    out[i] += p[0] * s.side[i];
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_coulomb_friction() { return std::make_unique<CoulombFriction>(); }

}  // namespace sparflow
