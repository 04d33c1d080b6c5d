#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/cli/context.h"
#include "apps/report/compare_page.h"
#include "identification/fit.h"
#include "models/error.h"
#include "models/machine_file.h"
#include "models/model_file.h"
#include "models/units.h"

namespace sparflow::cli {
namespace {

struct FitArguments {
  std::string machine, output, mapping;
  std::vector<std::string> logs, tests;
  int threads = 0;
  Outputs outputs;
};

std::string fit_json(const FitResult& result) {
  nlohmann::json json;
  json["seconds"] = result.seconds;
  json["notes"] = result.notes;
  for (const ProcessFit& p : result.processes) {
    const Cylinder& cylinder = result.model.machine.cylinders[static_cast<std::size_t>(p.cylinder)];
    json["processes"].push_back({{"cylinder", cylinder.name},
                                 {"direction", p.extend ? "extend" : "retract"},
                                 {"samples", p.offered},
                                 {"used", p.report.used},
                                 {"outliers", p.report.outliers},
                                 {"centres", p.report.centres},
                                 {"rmse_bar", p.report.rmse / units::kBar},
                                 {"noise_bar", p.report.noise_std / units::kBar},
                                 {"converged", p.report.converged},
                                 {"failure", p.report.failure}});
  }
  for (std::size_t i = 0; i < result.model.cylinders.size(); ++i) {
    json["margins_bar"][result.model.machine.cylinders[i].name] =
        result.model.cylinders[i].margin / units::kBar;
  }
  for (std::size_t i = 0; i < result.model.pumps.size(); ++i) {
    json["standby_bar"][result.model.machine.pumps[i].name] =
        result.model.pumps[i].standby / units::kBar;
  }
  json["train"] = nlohmann::json::parse(compare_json(result.train));
  if (result.test) json["test"] = nlohmann::json::parse(compare_json(*result.test));
  if (result.held_out) json["held_out"] = nlohmann::json::parse(compare_json(*result.held_out));
  return json.dump(2) + "\n";
}

int run(const FitArguments& a) {
  check_writable(a.output);
  a.outputs.check();
  std::vector<std::string> warnings;
  const Machine machine = load_machine(a.machine, &warnings);
  for (const std::string& w : warnings) warn(w);
  const std::vector<Log> logs = load_logs(a.logs, machine, a.mapping);
  const std::vector<Log> tests = load_logs(a.tests, machine, a.mapping);
  FitOptions options;
  options.threads = a.threads;
  FitResult result = [&] {
    Progress progress("fit");
    return fit(machine, logs, tests, options,
               [&](double share, const std::string& what) { progress(share, what); });
  }();
  save_model(result.model, a.output);
  if (!a.outputs.json.empty()) write_file_atomically(a.outputs.json, fit_json(result));
  if (!a.outputs.report.empty()) fit_page(result).write(a.outputs.report);
  fmt::print("{}\nmodel written to {}\n", result.full(), a.output);
  return kDone;
}

}  // namespace

void add_fit_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<FitArguments>();
  CLI::App* verb =
      app.add_subcommand("fit", "learn pressures, margins, standby and valve gains from logs");
  verb->add_option("--machine,-m", a->machine, "machine file (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--log,-l", a->logs, "logs to learn from (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests, "logs to judge the model on, never learned from")
      ->type_name("FILE...");
  verb->add_option("--output,-o", a->output, "model to write (JSON)")
      ->required()
      ->type_name("MODEL.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--threads", a->threads, "threads for learning, 0 = one a processor")
      ->check(CLI::Range(0, 256));
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
