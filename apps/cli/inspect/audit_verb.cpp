#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/tasks/audit_task.h"
#include "apps/tasks/inputs.h"
#include "models/files/engine_map_file.h"
#include "models/math/error.h"
#include "problems/motion_table.h"

namespace sparflow::cli {
namespace {

struct AuditArguments {
  std::string model, mapping, motions, engine_map;
  std::vector<std::string> logs;
  AuditTask task;
  Outputs outputs;
};

/// Writes the proposed motion of each judged move to move_01.csv and so on, numbered as on the page.
void write_motions(const CraneModel& model, const AuditResult& result, const std::string& folder) {
  int number = 0;
  for (const AuditedMove& m : result.moves) {
    ++number;
    if (!m.audit.judged()) continue;
    write_file_atomically(fmt::format("{}/move_{:02d}.csv", folder, number),
                          motion_csv(model, m.audit.best, m.payload,
                                     least_flows(model.machine, m.audit.problem.limits)));
  }
}

int run(AuditArguments a) {
  std::vector<NamedFile> inputs = named("LOG", a.logs);
  inputs.push_back({"--model", a.model});
  inputs.push_back({"--mapping", a.mapping});
  inputs.push_back({"--engine-map", a.engine_map});
  check_outputs_apart("audit", a.outputs.files(), inputs);
  a.outputs.check();
  if (!a.motions.empty()) {
    std::error_code error;
    std::filesystem::create_directories(a.motions, error);
    check_writable(a.motions + "/move_01.csv");
  }
  if (!a.engine_map.empty()) a.task.engine = load_engine_map(a.engine_map);
  const CraneModel model = load_model_with_warnings(a.model);
  require_pressures(model, a.model, "cylinders");
  std::optional<Progress> progress;  // once there are moves
  a.task.searching = [&] {
    finish_on_interrupt();
    progress.emplace("audit");
  };
  const AuditResult result = audit_task(
      model, load_logs(a.logs, model.machine, a.mapping), a.task,
      console_listener([&](double share, const std::string& what) { (*progress)(share, what); }));
  progress.reset();
  if (!a.motions.empty()) write_motions(model, result, a.motions);
  if (!a.outputs.json.empty()) a.outputs.write_json(audit_json(model, result));
  if (!a.outputs.report.empty()) audit_page(model, result).write(a.outputs.report);
  tell(audit_table(model, result));
  return result.interrupted ? kInterrupted : kDone;
}

}  // namespace

void add_audit_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<AuditArguments>();
  CLI::App* verb = app.add_subcommand(
      "audit", "compare each recorded move with its optimum: what was wasted, where, why");
  verb->add_option("log,--log,-l", a->logs, "recorded logs (CSV, MAT or a recording)")
      ->required()
      ->type_name("LOG...");
  verb->add_option("--model", a->model, "fitted model")->required()->type_name("MODEL.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--payload", a->task.payload, "payload; absent: that of the log")
      ->type_name("KG")
      ->check(number_from(0.0, 1e6));
  verb->add_option("--pause", a->task.cutting.pause_s, "shortest rest that ends a move [s]")
      ->check(number_from(0.1, 60.0))
      ->capture_default_str();
  verb->add_option("--moves", a->task.most, "moves examined at most: those with the longest way")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  CLI::Option* litres = verb->add_option(
      "--litres-per-kwh", a->task.litres_per_kWh,
      "fuel for each kWh of hydraulic energy, where no map of the engine is at hand");
  litres->check(number_from(0.0, 10.0));
  verb->add_option(
          "--engine-map", a->engine_map,
          "fuel of the engine over its power, and efficiency of the pump (YAML): litres over "
          "the log, at rest, and saved")
      ->type_name("FILE")
      ->excludes(litres);
  verb->add_option("--motions", a->motions,
                   "folder for the proposed motion of each judged move (move_01.csv, ...)")
      ->type_name("DIR");
  verb->add_flag_callback(
      "--no-bound", [a] { a->task.bound = false; }, "leave the lower bounds of the energy out");
  verb->add_option("--processes", a->task.processes,
                   "starts solved in parallel; absent: all processors")
      ->check(CLI::Range(1, 256));
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
