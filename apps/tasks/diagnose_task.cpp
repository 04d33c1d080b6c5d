#include "apps/tasks/diagnose_task.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace sparflow {

std::optional<ExtendResult> judge_on_tests(const CraneModel& model, const ExtendLogs& logs,
                                           const Diagnosis& diagnosis,
                                           const WorkProgress& progress) {
  std::vector<EffectAt> found;
  for (const DiagnosedEffect& e : diagnosis.effects) {
    if (diagnosis.named(e)) found.push_back(e.effect);
  }
  if (logs.tests.empty() || found.empty()) return std::nullopt;
  return extend(model, found, logs, {}, progress);
}

std::string diagnosis_json(const Diagnosis& diagnosis, const ExtendResult* tested) {
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(diagnosis.json());
  if (tested != nullptr) {
    json["headline"] = headline_on_tests(diagnosis, tested);
    json["test"] = nlohmann::ordered_json::parse(tested->json());
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string diagnosis_table(const Diagnosis& diagnosis, const ExtendResult* tested) {
  std::string text = diagnosis.table(headline_on_tests(diagnosis, tested));
  if (tested != nullptr) {
    text +=
        fmt::format("\nOn the test logs, with these effects in the model:\n{}", tested->table());
  }
  return text;
}

}  // namespace sparflow
