#include "apps/cli/model_inputs.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/cli/console.h"
#include "models/effects/formula/user_effect.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/machine/machine_check.h"

namespace sparflow::cli {

Machine load_machine_with_warnings(const std::string& path) {
  std::vector<std::string> warnings;
  Machine machine = load_machine(path, &warnings);
  for (const std::string& w : warnings) warn(w);
  return machine;
}

CraneModel load_model_with_warnings(const std::string& path) {
  CraneModel model = load_model(path);
  MachinePlaces places;
  places.file = path;
  for (const std::string& w : check_machine(model.machine, places)) warn(w);
  return model;
}

void OwnEffects::add_to(CLI::App& verb) {
  verb.add_option("--effects", files,
                  "effects of your own (YAML), added to the catalogue; may be repeated")
      ->type_name("FILE.yaml")
      ->allow_extra_args(false);
}

std::vector<const Effect*> OwnEffects::load(const Machine* machine) const {
  std::vector<const Effect*> all;
  for (const std::string& file : files) {
    for (const Effect* e : register_user_effects_file(file, machine)) all.push_back(e);
  }
  return all;
}

void OwnEffects::load_into(CraneModel& model) const {
  for (const Effect* e : load(&model.machine)) {
    const auto known = std::find(model.user_effects.begin(), model.user_effects.end(), e);
    if (known == model.user_effects.end()) model.user_effects.push_back(e);
    if (!e->places(model.machine).empty()) continue;
    warn(fmt::format("{} has no place on {}, so diagnosis does not consider it", e->info().id,
                     model.machine.name));
  }
}

std::vector<Log> load_logs(const std::vector<std::string>& paths, const Machine& machine,
                           const std::string& mapping) {
  LogOptions options;
  options.mapping_file = mapping;
  std::vector<Log> logs;
  for (const std::string& path : paths) {
    begin_work("reading " + path);
    logs.push_back(load_log(path, machine, options));
    for (const std::string& sentence : logs.back().warnings)
      warn(logs.back().file + ": " + sentence);
  }
  return logs;
}

}  // namespace sparflow::cli
