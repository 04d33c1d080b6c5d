#include <fmt/format.h>

#include <cmath>

#include "apps/cli/context.h"
#include "apps/report/model_pages/compare_page.h"
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

/// A machine alone predicts forces and flows from geometry; nothing is learned that could predict a pressure.
void keep_statics(CompareResult& result) {
  const auto learned = [](const auto& item) {
    return item.stage != "force" && item.stage != "flow_sensor";
  };
  std::erase_if(result.scores, learned);
  std::erase_if(result.worst, learned);
  for (LogComparison& log : result.logs) std::erase_if(log.series, learned);
  result.energy.clear();
}

/// A table's energy needs some to be a share of: without any, the reason stands among the notes.
void note_energies_without_work(CompareResult& result) {
  for (const EnergyScore& e : result.energy) {
    if (std::isfinite(e.relative_error)) continue;
    result.notes.push_back(fmt::format(
        "energy of pump {}: \u2013 %, nothing was delivered in the {:.1f} s compared, no "
        "cylinder is driven in them",
        e.pump, e.duration));
  }
  std::erase_if(result.energy,
                [](const EnergyScore& e) { return !std::isfinite(e.relative_error); });
}

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
        "alone");
  }
  const CraneModel model = a.model.empty() ? CraneModel::untrained(load_machine_aloud(a.machine))
                                           : load_model_aloud(a.model);
  const std::vector<Log> logs = load_logs(a.logs, model.machine, a.mapping);
  CompareResult result = compare(model, logs);
  if (a.model.empty()) keep_statics(result);
  if (!a.outputs.json.empty()) write_file_atomically(a.outputs.json, compare_json(result));
  if (!a.outputs.report.empty()) compare_page(model, result).write(a.outputs.report);
  note_energies_without_work(result);
  fmt::print("{}\n", compare_table(result));
  return kDone;
}

}  // namespace

void add_compare_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* verb =
      app.add_subcommand("compare", "model against measurements, every stage; where it fails");
  verb->add_option("--model", a->model, "fitted model")->type_name("MODEL.json");
  verb->add_option("--machine,-m", a->machine,
                   "machine file instead of a model: static forces alone")
      ->type_name("FILE");
  verb->add_option("--log,-l", a->logs, "logs to compare with (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
