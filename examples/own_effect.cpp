/// An effect of one's own in C++, added to the catalogue and to a model: Coulomb friction with a smooth change of sign.
/// own_effect_text.cpp has the same effect as text; docs/effects.md describes every member.
///   own_effect [MACHINE.yaml LOG.csv TEST.csv EFFECT:AT]
#include <fmt/format.h>

#include <cmath>
#include <exception>

#include "diagnosis/extension/extend.h"
#include "models/effects/registry.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

using namespace sparflow;

namespace {

class SmoothFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "smooth_friction",
        .title = "Smooth friction",
        .stage = EffectStage::kForce,
        .place = EffectPlace::kCylinder,
        // name, unit, its SI value, lower, upper, typical, meaning, linear, values to search [SI]
        .parameters = {{"Fc", "N", 1.0, 0.0, 20e3, 3e3, "friction force", true, {}},
                       {"v0", "mm/s", 1e-3, 5e-4, 0.05, 5e-3, "speed scale", false, {5e-4, 5e-3}}},
        .equation = "F = F_static + Fc tanh(v / v0)",
        .signals = {"cylinder force or both chamber pressures", "position"},
        .confused_with = {"coulomb_friction", "viscous_friction"},
        .separated_by = "slow moves at three speeds",
        .citation = "Andersson, Soederberg, Bjoerklund (2007), Tribology International 40(4)",
        .in_motion = "force"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }

  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    using std::tanh;
    const auto i = static_cast<std::size_t>(at);
    out[i] += p[0] * tanh(s.speed[i] * (1.0 / p[1]));
  }
  SPARFLOW_EFFECT_LAW(add_force)
};

void run(int argc, char** argv) {
  if (argc > 5) throw UsageError("usage: own_effect [MACHINE.yaml LOG.csv TEST.csv EFFECT:AT]");
  const auto file = [&](int i, const char* bundled) {
    return argc > i ? std::string(argv[i]) : bundled_file(bundled);
  };
  add_user_effect(std::make_unique<SmoothFriction>());
  const Machine machine = load_machine(file(1, "machines/loader_crane.yaml"));
  const Log log = load_log(file(2, "logs/loader_crane_friction_train.csv"), machine);
  const Log test = load_log(file(3, "logs/loader_crane_friction_test.csv"), machine);
  const EffectAt effect = parse_effect(argc > 4 ? argv[4] : "smooth_friction:boom", machine);

  const ExtendResult result = extend(fit(machine, {log}).model, {effect}, {{log}, {}, {test}});
  fmt::print("{}", result.table());
  const AppliedEffect& found = result.model.effects.front();
  fmt::print("{}: Fc = {:.0f} N, 95 % interval {:.0f} .. {:.0f}\n", found.key(machine),
             found.values[0], found.lower95[0], found.upper95[0]);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
