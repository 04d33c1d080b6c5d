#include <cmath>

#include "models/effects/builtin.h"

namespace sparflow {
namespace {

class LoadFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "load_friction",
        .title = "load-dependent friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters = {{"mu",
                        "%",
                        0.01,
                        0.0,
                        0.4,
                        0.05,
                        "friction force per static force of the cylinder",
                        true,
                        {}}},
        .equation = "F = F_static + mu |F_static| sign(v)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"coulomb_friction", "pad_friction", "counterbalance"},
        .separated_by = "motions up and down through the same poses at three payloads",
        .citation =
            "Hamon, Gautier, Garrec (2010), IROS, dynamic identification of robots with a "
            "dry friction model depending on load and velocity",
        .form_error = 0.05,
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    using std::abs;
    const auto i = static_cast<std::size_t>(at);
    out[i] += (p[0] * s.side[i]) * abs(s.static_force[i]);
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_load_friction() { return std::make_unique<LoadFriction>(); }

}  // namespace sparflow
