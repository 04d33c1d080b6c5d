#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/compare_page.h"
#include "apps/tasks/compare_task.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct CompareArguments {
  std::string model, machine, mapping;
  std::vector<std::string> logs;
  Outputs outputs;
};

int run(const CompareArguments& a) {
  std::vector<NamedFile> inputs = named("--log", a.logs);
  inputs.push_back({"--model", a.model});
  inputs.push_back({"--machine", a.machine});
  inputs.push_back({"--mapping", a.mapping});
  check_outputs_apart("compare", a.outputs.files(), inputs);
  a.outputs.check();
  if (a.model.empty() == a.machine.empty()) {
    throw UsageError(
        "compare: give either --model MODEL.json, or --machine FILE to compare static forces "
        "only");
  }
  const CraneModel model = a.model.empty()
                               ? CraneModel::untrained(load_machine_with_warnings(a.machine))
                               : load_model_with_warnings(a.model);
  CompareOptions options;
  options.signals.slim = a.outputs.report.empty() && model.effects.empty();
  const CompareResult result =
      compare_task(model, load_logs(a.logs, model.machine, a.mapping), !a.model.empty(), options);
  if (!a.outputs.json.empty()) a.outputs.write_json(compare_json(result));
  if (!a.outputs.report.empty()) compare_page(model, result).write(a.outputs.report);
  tell(fmt::format("{}\n", compare_table(result)));
  return kDone;
}

}  // namespace

void add_compare_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* verb = app.add_subcommand(
      "compare", "compare a model with measurements at every stage and show where it fails");
  verb->add_option("--model", a->model, "fitted model")->type_name("MODEL.json");
  verb->add_option("--machine,-m", a->machine,
                   "machine file instead of a model: static forces only")
      ->type_name("FILE");
  verb->add_option("--log,-l", a->logs, "logs to compare with (CSV, MAT or a recording)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
