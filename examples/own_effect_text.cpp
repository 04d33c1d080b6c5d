/// An effect of one's own as text (docs/user_effects.md): read from a file, added to a model and saved with it, so that later
/// programs need the model file alone. own_effect.cpp has the same effect in C++.
///   own_effect_text [MACHINE.yaml LOG.csv TEST.csv EFFECTS.yaml EFFECT:AT MODEL.json]
#include <fmt/format.h>

#include <exception>

#include "diagnosis/extension/extend.h"
#include "models/effects/effect_text.h"
#include "models/effects/formula/user_effect.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

using namespace sparflow;

namespace {

void run(int argc, char** argv) {
  if (argc > 7) {
    throw UsageError(
        "usage: own_effect_text [MACHINE.yaml LOG.csv TEST.csv EFFECTS.yaml EFFECT:AT MODEL.json]");
  }
  const auto file = [&](int i, const char* bundled) {
    return argc > i ? std::string(argv[i]) : bundled_file(bundled);
  };
  const Machine machine = load_machine(file(1, "machines/loader_crane.yaml"));
  const Log log = load_log(file(2, "logs/loader_crane_friction_train.csv"), machine);
  const Log test = load_log(file(3, "logs/loader_crane_friction_test.csv"), machine);
  const std::string effects = file(4, "effects/seal_friction.yaml");
  for (const Effect* e : register_user_effects_file(effects, &machine))
    fmt::print("{}\n", effect_entry(*e));
  const EffectAt effect = parse_effect(argc > 5 ? argv[5] : "seal_friction:boom", machine);

  const ExtendResult result = extend(fit(machine, {log}).model, {effect}, {{log}, {}, {test}});
  fmt::print("{}", result.table());
  const std::string path = argc > 6 ? argv[6] : "with_seal_friction.json";
  save_model(result.model, path);
  for (const AppliedEffect& e : load_model(path).effects) {
    const EffectParameter& first = e.effect->info().parameters.front();
    fmt::print("{} holds {}: {} = {:.0f} {}\n", path, e.key(machine), first.name,
               e.values.front() / first.si, first.unit);
  }
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
