#include <cmath>

#include "models/effects/builtin.h"

namespace sparflow {
namespace {

/// This is the part of breakaway friction that decays with speed; the part that remains is Coulomb friction.
class StribeckFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "stribeck_friction",
        .title = "Stribeck friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters = {{"Fs",
                        "N",
                        1.0,
                        0.0,
                        100e3,
                        10e3,
                        "friction beyond Coulomb friction at zero speed",
                        true,
                        {}},
                       {"vs",
                        "mm/s",
                        1e-3,
                        1e-3,
                        0.1,
                        10e-3,
                        "speed at which it has decayed to 1/e (37 %)",
                        false,
                        {2e-3, 4e-3, 8e-3, 15e-3, 30e-3}}},
        .equation = "F = F_static + Fs sign(v) exp(-|v|/vs)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"coulomb_friction", "presliding", "viscous_friction"},
        .separated_by = "very slow starts and slow motions at several speeds in both directions",
        .citation =
            "R. Stribeck (1902), Z. VDI 46; Bo & Pavelescu (1982), Wear 82, exponential "
            "form; Armstrong-Helouvry, Dupont, Canudas de Wit (1994)",
        .form_error = 0.2,
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    using std::abs;
    using std::exp;
    const auto i = static_cast<std::size_t>(at);
    if (s.side[i] == 0) return;
    out[i] += (p[0] * s.side[i]) * exp(abs(s.speed[i]) * (-1.0 / p[1]));
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_stribeck_friction() { return std::make_unique<StribeckFriction>(); }

}  // namespace sparflow
