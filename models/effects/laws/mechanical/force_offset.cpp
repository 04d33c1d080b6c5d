#include "models/effects/builtin.h"

namespace sparflow {
namespace {

class ForceOffset final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "force_offset",
        .title = "constant force offset",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        .parameters = {{"offset",
                        "N",
                        1.0,
                        -200e3,
                        200e3,
                        6e3,
                        "measured minus static force, the same at rest and in motion",
                        true,
                        {}}},
        .equation = "F = F_static + offset",
        .signals = {"cylinder force or both chamber pressures"},
        .confused_with = {"pressure_offset", "unmodelled_mass"},
        .separated_by = "a zero check of the sensors; against a mass, poses from level to steep",
        .citation =
            "Janot, Gautier, Brunot (2019), data set and reference models of EMPS: offset "
            "of the drive force",
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>&, int at, std::span<const double> p, std::span<T> out) const {
    out[static_cast<std::size_t>(at)] += p[0];
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

}  // namespace

std::unique_ptr<Effect> make_force_offset() { return std::make_unique<ForceOffset>(); }

}  // namespace sparflow
