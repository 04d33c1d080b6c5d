#include <filesystem>
#include <nlohmann/json.hpp>

#include "models/error.h"
#include "models/machine_file.h"
#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::simulator {

GeneratedCase generate_case(const CaseRequest& request) {
  GeneratedCase logs;
  LogRequest log = request.log;
  const std::uint64_t motions = request.log.motion_seed * 3;
  log.motion_seed = motions;
  log.warm = false;
  logs.train = generate(log);
  LogRequest test = log;
  test.motion_seed = motions + 1;
  test.seconds = request.test_seconds;
  test.warm = true;
  logs.test = generate(test);
  LogRequest reference = log;
  reference.motion_seed = motions + 2;
  reference.absent = reference.effects;
  reference.effects.clear();
  logs.reference = generate(reference);
  return logs;
}

void write_case(const CaseRequest& request, const GeneratedCase& logs, const std::string& folder) {
  std::filesystem::create_directories(folder);
  write_csv(logs.reference, folder + "/reference.csv");
  write_csv(logs.train, folder + "/train.csv");
  write_csv(logs.test, folder + "/test.csv");
  write_file_atomically(folder + "/machine.yaml", write_machine(request.log.machine));
  nlohmann::json truth;
  truth["machine"] = request.log.machine.name;
  truth["crane_seed"] = request.log.crane_seed;
  truth["motion_seed"] = request.log.motion_seed;
  truth["noise_factor"] = request.log.noise_factor;
  truth["rate_hz"] = request.log.rate;
  truth["effects"] = nlohmann::json::array();
  for (const HiddenTruth& t : logs.train.truth) {
    nlohmann::json effect = {{"id", t.id},
                             {"at", t.at},
                             {"size", t.size},
                             {"law", t.law},
                             {"law_name", t.law_name},
                             {"in_catalogue", t.in_catalogue}};
    for (const HiddenParameter& p : t.parameters)
      effect["parameters"].push_back(
          {{"name", p.name}, {"value", p.value}, {"unit", p.unit}, {"equivalent", p.equivalent}});
    truth["effects"].push_back(effect);
  }
  write_file_atomically(folder + "/truth.json", truth.dump(1) + "\n");
}

}  // namespace sparflow::simulator
