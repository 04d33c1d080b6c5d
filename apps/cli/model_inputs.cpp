#include "apps/cli/model_inputs.h"

#include "apps/cli/console.h"
#include "apps/tasks/inputs.h"
#include "models/effects/formula/user_effect.h"

namespace sparflow::cli {

Machine load_machine_with_warnings(const std::string& path) {
  return read_machine(path, console_listener());
}

CraneModel load_model_with_warnings(const std::string& path) {
  return read_model(path, console_listener());
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
  add_own_effects(load(&model.machine), console_listener(), model);
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
