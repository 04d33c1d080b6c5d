#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/diagnosis_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/diagnose_page.h"
#include "diagnosis/extension/extend.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct DiagnoseArguments {
  DiagnosisInputs inputs{"diagnose"};
  bool skip_data_checks = false;
};

/// Adds the effects found to the model, one after the other, and judges each step on the test logs.
/// @return nothing when there are no test logs or no effect is probable enough
std::optional<ExtendResult> judge_on_tests(const DiagnosisFiles& files,
                                           const Diagnosis& diagnosis) {
  std::vector<EffectAt> found;
  for (const DiagnosedEffect& e : diagnosis.effects) {
    if (diagnosis.named(e)) found.push_back(e.effect);
  }
  if (files.logs.tests.empty() || found.empty()) return std::nullopt;
  Progress progress("test logs");
  return extend(files.model, found, files.logs, {},
                [&](double share, const std::string& what) { progress(share, what); });
}

int run(const DiagnoseArguments& a) {
  const DiagnosisFiles files = a.inputs.read();
  note_what_is_reference(files);
  DiagnoseOptions options;
  options.candidates = files.candidates;
  options.check_data = !a.skip_data_checks;
  const Diagnosis result = [&] {
    Progress progress("diagnose");
    return diagnose(files.model, files.logs.suspects, files.logs.references, options,
                    [&](double share, const std::string& what) { progress(share, what); });
  }();
  const std::optional<ExtendResult> tested = judge_on_tests(files, result);
  const Outputs& outputs = a.inputs.outputs();
  if (!outputs.json.empty()) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(result.json());
    if (tested) {
      json["headline"] = headline_on_tests(result, &*tested);
      json["test"] = nlohmann::ordered_json::parse(tested->json());
    }
    outputs.write_json(json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  }
  if (!outputs.report.empty()) {
    Page page = diagnose_page(files.model, result, tested ? &*tested : nullptr);
    files.write_provenance(page);
    page.write(outputs.report);
  }
  tell(result.table(headline_on_tests(result, tested ? &*tested : nullptr)));
  if (tested)
    tell(fmt::format("\nOn the test logs, with these effects in the model:\n{}", tested->table()));
  return kDone;
}

}  // namespace

void add_diagnose_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<DiagnoseArguments>();
  CLI::App* verb = app.add_subcommand(
      "diagnose",
      "find which physical effect the model lacks, with evidence; or none, unknown or bad data");
  a->inputs.add_model(*verb);
  a->inputs.add_logs(*verb, "logs to diagnose (CSV or MAT)");
  a->inputs.add_references(
      *verb,
      "reference logs of the same machine, recorded before the effect; pressure models are learned "
      "from them");
  a->inputs.add_tests(
      *verb, "test logs: the effects found are judged on them, the search does not use them");
  a->inputs.add_candidates(*verb, "candidate effects");
  verb->add_flag("--skip-data-checks", a->skip_data_checks,
                 "skip the search for stuck, jumping or noisy channels");
  a->inputs.add_rest(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow diagnose --model crane.json --log today.csv --reference new_machine.csv\n"
      "  sparflow diagnose --model crane.json --log train.csv --test test.csv --report why.html\n"
      "The exit code is 0 whatever the verdict; read `verdict` in --json.");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
