#include <fmt/format.h>

#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/benchmark_page.h"
#include "apps/tasks/benchmark/benchmark_task.h"
#include "models/math/error.h"
#include "simulator/controllers/registry.h"

namespace sparflow::cli {
namespace {

struct BenchmarkArguments {
  BenchmarkTask task;
  std::string csv;
  Outputs outputs;
};

void write_files(const BenchmarkArguments& a, const BenchmarkResult& result) {
  if (!a.outputs.json.empty()) a.outputs.write_json(benchmark_json(result));
  if (!a.csv.empty()) write_file_atomically(a.csv, benchmark_csv(result));
  if (a.outputs.report.empty()) return;
  BenchmarkView view = benchmark_view(result);
  view.provenance = {{"model", a.task.model_file},
                     {"scenarios", fmt::format("{}", fmt::join(a.task.scenarios, " "))}};
  benchmark_page(view).write(a.outputs.report);
}

int run(const BenchmarkArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--csv", a.csv});
  outputs.push_back({"the journal", a.outputs.journal()});
  const BenchmarkWork work = benchmark_work(a.task, console_listener());
  std::vector<NamedFile> inputs = {{"--model", a.task.model_file}};
  for (const std::string& file : work.files) inputs.push_back({"a scenario", file});
  check_outputs_apart("benchmark", outputs, inputs);
  check_writable(a.csv);
  a.outputs.check();
  const std::unique_ptr<Journal> journal =
      a.outputs.open_journal("benchmark", benchmark_fingerprint(work, a.task));
  finish_on_interrupt();
  std::optional<Progress> progress;
  BenchmarkTask task = a.task;
  task.begin = [&](const std::string& part) -> WorkProgress {
    progress.reset();
    progress.emplace(part);
    return [&](double share, const std::string& what) { (*progress)(share, what); };
  };
  const BenchmarkResult result = benchmark_task(work, task, *journal, console_listener());
  progress.reset();
  write_files(a, result);
  if (!interrupted() && result.broken == 0) journal->remove();
  tell(benchmark_table(result));
  if (interrupted()) return kInterrupted;
  return result.any_done() && result.broken == 0 ? kDone : kNotSolved;
}

std::string controllers_help() {
  std::string text = "Controllers:\n";
  for (const control::ControllerInfo& info : control::controllers()) {
    text += fmt::format("  {:<22} {}\n", info.name, info.words);
    for (const control::Gain& g : info.gains)
      text += fmt::format("  {:<22}   {} = {:g}{}{}\n", "", g.name, g.value,
                          g.unit == "-" ? "" : " ", g.unit == "-" ? "" : g.unit);
  }
  return text;
}

}  // namespace

void add_benchmark_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<BenchmarkArguments>();
  CLI::App* verb = app.add_subcommand(
      "benchmark", "compare controllers on the dynamic plant: true energy, time, errors");
  verb->add_option("SCENARIO", a->task.scenarios, "scenarios (YAML), or folders of them")
      ->required()
      ->type_name("FILE|DIR");
  verb->add_option("--controllers", a->task.controllers, "names, separated by commas; absent: all")
      ->delimiter(',')
      ->type_name("NAME");
  verb->add_option("--process", a->task.processes,
                   "a controller of your own: a program that reads and writes lines of JSON "
                   "(docs/benchmark.md)")
      ->type_name("NAME=COMMAND");
  verb->add_option("--model", a->task.model_file,
                   "fitted model; absent: the one that each scenario names")
      ->type_name("MODEL.json");
  verb->add_option("--reference", a->task.reference,
                   "controller that others are compared with; absent: tracked_optimum, or the "
                   "first")
      ->type_name("NAME");
  verb->add_option("--seeds", a->task.seeds,
                   "runs of each controller in each scenario; absent: the scenario's seeds")
      ->check(CLI::Range(1, 1000));
  verb->add_option("--step-budget", a->task.step_budget,
                   "time in which a program of your own must answer a step")
      ->type_name("S")
      ->check(number_from(1e-3, 600.0))
      ->capture_default_str();
  verb->add_option("--gain", a->task.gains, "another value for a gain of a controller; repeatable")
      ->type_name("CONTROLLER.GAIN=VALUE");
  verb->add_flag("--no-optimum", a->task.no_optimum,
                 "leave the energy-optimal motions out; controllers that follow one fail");
  verb->add_option("--sway", a->task.sway_limit,
                   "largest angle of the payload's rope for which energy-optimal motions are "
                   "planned; absent: any")
      ->type_name("DEG")
      ->check(number_from(0.1, 45.0));
  verb->add_flag("--no-bound", a->task.no_bound, "leave the lower bounds of the energy out");
  verb->add_option("--jobs,--processes", a->task.jobs,
                   "runs at the same time; absent: as many as there are processors")
      ->check(CLI::Range(1, 256));
  verb->add_option("--csv", a->csv, "all rows as a table")->type_name("FILE.csv");
  a->outputs.add_to(*verb);
  a->outputs.add_resume_to(*verb);
  verb->footer(controllers_help());
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
