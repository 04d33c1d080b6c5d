#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/diagnosis_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/selftest_page.h"
#include "diagnosis/selftest/selftest.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct SelftestArguments {
  DiagnosisInputs inputs{"selftest"};
  int check = SelftestOptions{}.check;
};

int run(const SelftestArguments& a) {
  const DiagnosisFiles files = a.inputs.read();
  SelftestOptions options;
  options.check = a.check;
  options.candidates = files.candidates;
  const Selftest result = [&] {
    Progress progress("selftest");
    return selftest(files.model, files.logs.suspects, files.logs.references, options,
                    [&](double share, const std::string& what) { progress(share, what); });
  }();
  const Outputs& outputs = a.inputs.outputs();
  if (!outputs.json.empty()) outputs.write_json(result.json());
  if (!outputs.report.empty()) {
    Page page = selftest_page(files.model, result);
    files.write_provenance(page);
    page.write(outputs.report);
  }
  tell(result.table());
  return kDone;
}

}  // namespace

void add_selftest_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<SelftestArguments>();
  CLI::App* verb = app.add_subcommand("selftest",
                                      "find what these logs could reveal: inject every effect; "
                                      "report power and indistinguishable sets");
  a->inputs.add_model(*verb);
  a->inputs.add_logs(*verb, "logs whose motions are judged (CSV, MAT or a recording)");
  a->inputs.add_references(*verb, "reference logs of the same machine");
  a->inputs.add_candidates(*verb, "effects to inject");
  verb->add_option("--check", a->check,
                   "number of effects for which the whole search is run on injected data")
      ->check(number_from(0.0, 1e9))
      ->capture_default_str();
  a->inputs.add_rest(*verb);
  verb->footer(
      "Examples:\n"
      "  sparflow selftest --model crane.json --log today.csv\n"
      "  sparflow selftest --model crane.json --log today.csv --reference new_machine.csv "
      "--report power.html\n"
      "Each indistinguishable set is listed with a motion that would decide between its effects.");
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
