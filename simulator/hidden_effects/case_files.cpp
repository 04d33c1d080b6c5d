#include <filesystem>
#include <nlohmann/json.hpp>

#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::simulator {

CaseLogs case_logs(const CaseRequest& request) {
  CaseLogs logs;
  const std::uint64_t motions = request.log.motion_seed * 3;
  logs.train = request.log;
  logs.train.motion_seed = motions;
  logs.train.warm = false;
  logs.test = logs.train;
  logs.test.motion_seed = motions + 1;
  logs.test.seconds = request.test_seconds;
  logs.test.warm = true;
  logs.reference = logs.train;
  logs.reference.motion_seed = motions + 2;
  logs.reference.absent = logs.reference.effects;
  logs.reference.effects.clear();
  return logs;
}

GeneratedCase generate_case(const CaseRequest& request) {
  const CaseLogs logs = case_logs(request);
  return {generate(logs.reference), generate(logs.train), generate(logs.test)};
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
