#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "apps/cli/model_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/model_pages/compare_page.h"
#include "identification/learning/fit.h"
#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow::cli {
namespace {

struct FitArguments {
  std::string machine, output, mapping;
  std::vector<std::string> logs, tests;
  int threads = 0;
  OwnEffects own;
  Outputs outputs;
};

/// The headline of the comparison that judges the model, as its page has it; "" when all is good.
std::string judgement(const FitResult& result) {
  const bool held_out = !result.test && result.held_out;
  const CompareResult& by = result.test ? *result.test : held_out ? *result.held_out : result.train;
  if (by.ranking.grade() == Grade::kGood) return "";
  return fmt::format("on the {}: {}\n",
                     result.test ? "test logs"
                     : held_out  ? "held-out motions"
                                 : "training logs",
                     by.ranking.headline);
}

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
                                 {"law", pressure_law_name(p.report.law)},
                                 {"plane_left_out_bar", p.report.plane_left_out / units::kBar},
                                 {"process_left_out_bar", p.report.process_left_out / units::kBar},
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
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

/// Whether the signals of any log have this quantity of any part of the machine.
template <class Has>
bool measured(const FitResult& r, const Has& has) {
  return std::any_of(r.train.logs.begin(), r.train.logs.end(),
                     [&](const LogComparison& log) { return has(log.signals); });
}

/// Names what the logs lack when nothing could be learned from them; empty when something was learned, or when the
/// machine has no hydraulic cylinder.
std::string why_nothing_learned(const FitResult& r) {
  const auto identified = [](const std::optional<LearnedPump>& p) {
    return p && (p->standby_identified ||
                 std::any_of(p->margins.begin(), p->margins.end(),
                             [](const LearnedMargin& m) { return m.identified; }));
  };
  const bool learned = std::any_of(r.processes.begin(), r.processes.end(),
                                   [](const ProcessFit& p) { return p.report.failure.empty(); }) ||
                       std::any_of(r.pumps.begin(), r.pumps.end(), identified) || !r.valves.empty();
  if (learned || r.processes.empty()) return "";
  std::vector<std::string> missing;
  const auto cylinders = [&](const auto& has) {
    return measured(r, [&](const MachineSignals& s) {
      return std::any_of(s.cylinders.begin(), s.cylinders.end(), has);
    });
  };
  if (!cylinders([](const CylinderSignals& c) { return c.logs_a || c.logs_b; }))
    missing.emplace_back("chamber pressures (pA_<cylinder>_bar, pB_<cylinder>_bar)");
  if (!measured(r, [](const MachineSignals& s) {
        return std::any_of(s.pumps.begin(), s.pumps.end(), [](const PumpSignals& p) {
          return p.pressure.array().isFinite().any();
        });
      }))
    missing.emplace_back("pump pressure (p_<pump>_bar)");
  if (!cylinders([](const CylinderSignals& c) { return c.command.array().isFinite().any(); }))
    missing.emplace_back("commands (u_<cylinder>)");
  if (!cylinders([](const CylinderSignals& c) { return c.driven.any(); }))
    missing.emplace_back("motion (no cylinder is driven faster than 2 mm/s)");
  if (missing.empty()) {
    return fmt::format("the logs have too few samples of each motion ({} in all)", r.train.samples);
  }
  return fmt::format("the logs lack {}", fmt::join(missing, ", "));
}

/// Checks, before any work, that no output overwrites a file in use and that no test log is learned from.
/// @throws UsageError, InputError
void check_files(const FitArguments& a) {
  for (const std::string& test : a.tests) {
    for (const std::string& log : a.logs) {
      if (!same_file(test, log)) continue;
      throw UsageError(
          fmt::format("fit: {} is given with --log and with --test; a model is judged on data that "
                      "it was not learned from, so give the log once (without --test every fourth "
                      "block of motion is held out)",
                      log));
    }
  }
  std::vector<NamedFile> inputs = named("--log", a.logs);
  for (const NamedFile& test : named("--test", a.tests)) inputs.push_back(test);
  inputs.push_back({"--machine", a.machine});
  inputs.push_back({"--mapping", a.mapping});
  for (const NamedFile& f : named("--effects", a.own.files)) inputs.push_back(f);
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("fit", outputs, inputs);
  check_writable(a.output);
  a.outputs.check();
}

int run(const FitArguments& a) {
  check_files(a);
  const Machine machine = load_machine_with_warnings(a.machine);
  a.own.load(&machine);  // before the fit, so that a wrong file is found at once
  std::vector<Log> logs = load_logs(a.logs, machine, a.mapping);
  std::vector<Log> tests = load_logs(a.tests, machine, a.mapping);
  FitOptions options;
  options.threads = a.threads;
  options.keep_held_out_series = !a.outputs.report.empty();
  options.signals.slim = a.outputs.report.empty();
  FitResult result = [&] {
    Progress progress("fit");
    return fit(machine, std::move(logs), std::move(tests), options,
               [&](double share, const std::string& what) { progress(share, what); });
  }();
  for (const SlipOfLog& s : result.train.slips) warn(s.file + ": " + s.slip.sentence);
  const std::string lacking = why_nothing_learned(result);
  if (!lacking.empty()) {
    for (const std::string& n : result.notes) note("  " + n);
    throw InputError({a.logs.size() == 1 ? a.logs.front() : "", 0, 0}, "fit",
                     fmt::format("nothing was learned, so no model is written: {}; record each "
                                 "cylinder moving in both directions at several speeds and loads",
                                 lacking));
  }
  if (result.processes.empty()) {
    note(fmt::format(
        "{} has no hydraulic cylinder: there is nothing to learn, only forces are compared",
        machine.name));
  }
  const bool no_pressures =
      !result.processes.empty() && result.model.missing().size() == result.processes.size();
  if (no_pressures) {
    warn(
        "no pressure model was learned; the model predicts flows from commands and what the pump "
        "does, but no working pressures and no energy of a motion");
  }
  a.own.load_into(result.model);
  save_model(result.model, a.output);
  if (!a.outputs.json.empty()) a.outputs.write_json(fit_json(result));
  if (!a.outputs.report.empty()) fit_page(result).write(a.outputs.report);
  tell(fmt::format("{}{}\nmodel written to {}\n", result.full(), judgement(result), a.output));
  return kDone;
}

}  // namespace

void add_fit_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<FitArguments>();
  CLI::App* verb = app.add_subcommand(
      "fit", "identify pressure models, margins, standby and valve gains from logs");
  verb->add_option("--machine,-m", a->machine, "machine file (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--log,-l", a->logs, "logs to learn from (CSV or MAT)")
      ->required()
      ->type_name("FILE...");
  verb->add_option("--test,-t", a->tests,
                   "logs to judge the model on; nothing is learned from them")
      ->type_name("FILE...");
  verb->add_option("--output,-o", a->output, "model to write (JSON)")
      ->required()
      ->type_name("MODEL.json");
  verb->add_option("--mapping", a->mapping, "mapping file for logs with other column names (YAML)")
      ->type_name("FILE");
  verb->add_option("--threads", a->threads, "threads for learning; 0: one for each processor")
      ->check(CLI::Range(0, 256));
  a->own.add_to(*verb);
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
