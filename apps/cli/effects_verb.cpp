#include <fmt/format.h>

#include <memory>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "models/effects/effect_text.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct EffectsArguments {
  std::string effect;
  OwnEffects own;
  Outputs outputs;
};

int run(const EffectsArguments& a) {
  check_outputs_apart("effects", a.outputs.files(), named("--effects", a.own.files));
  a.outputs.check();
  a.own.load(nullptr);
  const std::string text = a.effect.empty() ? effect_table() : effect_entry(a.effect);
  if (!a.outputs.json.empty()) a.outputs.write_json(effects_json(a.effect));
  tell(text);
  return kDone;
}

}  // namespace

void add_effects_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<EffectsArguments>();
  CLI::App* verb = app.add_subcommand(
      "effects", "list the catalogue of physical effects: equation, parameters, rivals");
  verb->add_option("effect", a->effect, "id of one effect, to print its whole entry")
      ->type_name("EFFECT");
  a->own.add_to(*verb);
  a->outputs.add_to(*verb, false);
  verb->footer(
      "Examples:\n"
      "  sparflow effects coulomb_friction\n"
      "  sparflow effects seal_friction --effects mine.yaml");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
