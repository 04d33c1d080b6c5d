#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/diagnosis_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/diagnose_page.h"
#include "apps/tasks/diagnose_task.h"
#include "apps/tasks/inputs.h"
#include "diagnosis/extension/extend.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct DiagnoseArguments {
  DiagnosisInputs inputs{"diagnose"};
  bool skip_data_checks = false;
};

int run(const DiagnoseArguments& a) {
  const DiagnosisFiles files = a.inputs.read();
  tell_what_is_reference(files.model, files.logs, console_listener());
  DiagnoseOptions options;
  options.candidates = files.candidates;
  options.check_data = !a.skip_data_checks;
  const Diagnosis result = [&] {
    Progress progress("diagnose");
    return diagnose(files.model, files.logs.suspects, files.logs.references, options,
                    [&](double share, const std::string& what) { progress(share, what); });
  }();
  const std::optional<ExtendResult> tested = [&] {
    if (files.logs.tests.empty()) return std::optional<ExtendResult>();
    Progress progress("test logs");
    return judge_on_tests(files.model, files.logs, result,
                          [&](double share, const std::string& what) { progress(share, what); });
  }();
  const ExtendResult* judged = tested ? &*tested : nullptr;
  const Outputs& outputs = a.inputs.outputs();
  if (!outputs.json.empty()) outputs.write_json(diagnosis_json(result, judged));
  if (!outputs.report.empty()) {
    Page page = diagnose_page(files.model, result, judged);
    files.write_provenance(page);
    page.write(outputs.report);
  }
  tell(diagnosis_table(result, judged));
  return kDone;
}

}  // namespace

void add_diagnose_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<DiagnoseArguments>();
  CLI::App* verb = app.add_subcommand(
      "diagnose",
      "find which physical effect the model lacks, with evidence; or none, unknown or bad data");
  a->inputs.add_model(*verb);
  a->inputs.add_logs(*verb, "logs to diagnose (CSV, MAT or a recording)");
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
