#include "apps/tasks/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "identification/data_checks/sensor_slips.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/machine/machine_check.h"
#include "models/math/error.h"

namespace sparflow {

Machine read_machine(const std::string& path, const Listener& listener) {
  std::vector<std::string> warnings;
  Machine machine = load_machine(path, &warnings);
  for (const std::string& w : warnings) listener.say_warning(w);
  return machine;
}

CraneModel read_model(const std::string& path, const Listener& listener) {
  CraneModel model = load_model(path);
  MachinePlaces places;
  places.file = path;
  for (const std::string& w : check_machine(model.machine, places)) listener.say_warning(w);
  return model;
}

void add_own_effects(const std::vector<const Effect*>& effects, const Listener& listener,
                     CraneModel& model) {
  for (const Effect* e : effects) {
    const auto known = std::find(model.user_effects.begin(), model.user_effects.end(), e);
    if (known == model.user_effects.end()) model.user_effects.push_back(e);
    if (!e->places(model.machine).empty()) continue;
    listener.say_warning(fmt::format("{} has no place on {}, so diagnosis does not consider it",
                                     e->info().id, model.machine.name));
  }
}

std::vector<EffectAt> candidates_of(const std::vector<std::string>& keys, const Machine& machine) {
  std::vector<EffectAt> all;
  all.reserve(keys.size());
  for (const std::string& key : keys) {
    const Effect* everywhere = key.find(':') == std::string::npos ? find_effect(key) : nullptr;
    if (everywhere == nullptr || everywhere->places(machine).empty()) {
      all.push_back(parse_effect(key, machine));  // its InputError names the mistake
      continue;
    }
    for (const int at : everywhere->places(machine)) all.push_back({everywhere, at});
  }
  return all;
}

void check_diagnosis_logs(const std::string& verb, const Machine& machine, const ExtendLogs& logs,
                          const Listener& listener) {
  for (const Log& log : logs.suspects) {
    for (const SensorSlip& slip : find_sensor_slips(machine, make_signals(machine, log)))
      listener.say_warning(log.file + ": " + slip.sentence);
  }
  const auto refuse = [&](const std::vector<Log>& some, const std::vector<Log>& others,
                          const char* one, const char* other) {
    for (const Log& a : some) {
      for (const Log& b : others) {
        if (a.sha256 != b.sha256) continue;
        throw UsageError(
            fmt::format("{}: {} is given as {} and as {}; a log can be only one of them", verb,
                        a.file, one, other));
      }
    }
  };
  refuse(logs.suspects, logs.references, "--log", "--reference");
  refuse(logs.suspects, logs.tests, "--log", "--test");
  refuse(logs.references, logs.tests, "--reference", "--test");
}

void tell_what_is_reference(const CraneModel& model, const ExtendLogs& logs,
                            const Listener& listener) {
  if (!logs.references.empty()) return;
  const auto seen = [&](const Log& log) {
    return std::any_of(model.data.begin(), model.data.end(), [&](const DataSource& d) {
      return d.use == "train" && d.sha256 == log.sha256;
    });
  };
  const auto unseen = std::find_if_not(logs.suspects.begin(), logs.suspects.end(), seen);
  if (unseen == logs.suspects.end()) return;
  listener.say_note(
      fmt::format("{}: the model was not fitted on this log; without --reference the model serves "
                  "as reference for forces only, and pressures and flows are learned again",
                  unseen->file));
}

void require_pressures(const CraneModel& model, const std::string& where, const std::string& key) {
  const std::vector<std::string> missing = model.missing();
  if (missing.empty()) return;
  throw InputError({where, 0, 0}, key,
                   fmt::format("the model has no working pressure for {}; fit it on a log in "
                               "which that movement occurs",
                               fmt::join(missing, ", ")));
}

std::string today() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  return fmt::format("{:04}-{:02}-{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

}  // namespace sparflow
