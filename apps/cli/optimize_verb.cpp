#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/motion_page.h"
#include "apps/tasks/optimize_task.h"
#include "models/math/error.h"
#include "problems/motion_table.h"

namespace sparflow::cli {
namespace {

struct OptimizeArguments {
  std::string problem, model, output;
  SeedOptions seeds;
  int intervals = 0;
  int processes = 0;
  bool smooth_only = false;
  bool bound = false;
  double rate = 0.0;
  std::string from;
  Outputs outputs;
};

int exit_code(OptimizeStatus status) {
  switch (status) {
    case OptimizeStatus::kOptimal:
      return kDone;
    case OptimizeStatus::kInterrupted:
      return kInterrupted;
    case OptimizeStatus::kFeasible:
    case OptimizeStatus::kInfeasible:
    case OptimizeStatus::kFailed:
      return kNotSolved;
  }
  return kInternal;
}

int run(const OptimizeArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  check_outputs_apart("optimize", outputs,
                      {{"--problem", a.problem}, {"--model", a.model}, {"--from", a.from}});
  check_writable(a.output);
  a.outputs.check();
  const auto [problem, model] = load_problem_and_model(a.problem, a.model);
  OptimizeTask task;
  task.seeds = a.seeds;
  task.intervals = a.intervals;
  task.processes = a.processes;
  task.smooth_only = a.smooth_only;
  if (!a.from.empty()) task.from = load_motion(a.from, model.machine);
  task.searching = finish_on_interrupt;
  const auto [seeds, found] = [&, &problem = problem, &model = model] {
    Progress progress("optimize");
    return optimize_task(
        model, problem, task,
        console_listener([&](double share, const std::string& what) { progress(share, what); }));
  }();
  OptimizeResult result = found;
  if (a.bound && result.motion.size() > 1) {
    Progress progress("bound");
    add_bound(model, problem, console_listener([&](double share, const std::string& what) {
                progress(share, what);
              }),
              result);
  }
  if (result.motion.size() > 1 && !a.output.empty()) {
    const Trajectory rows = a.rate > 0.0 ? at_rate(result.motion, a.rate) : result.motion;
    write_file_atomically(a.output, motion_csv(model, problem, rows));
  }
  if (!a.outputs.json.empty()) a.outputs.write_json(optimize_json(model, problem, result));
  if (!a.outputs.report.empty()) {
    motion_page(model, problem, result, compared_motion(seeds, result)).write(a.outputs.report);
  }
  tell(optimize_table(model, problem, result));
  if (result.motion.size() > 1 && !a.output.empty())
    tell(fmt::format("motion written to {}\n", a.output));
  return result.interrupted ? kInterrupted : exit_code(result.status);
}

}  // namespace

void add_optimize_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<OptimizeArguments>();
  CLI::App* verb =
      app.add_subcommand("optimize", "compute the energy-optimal motion from start to goal");
  verb->add_option("--problem,-p", a->problem, "motion problem (YAML)")
      ->required()
      ->type_name("FILE");
  verb->add_option("--model", a->model, "fitted model; absent: the one that the problem names")
      ->type_name("MODEL.json");
  verb->add_option("--output,-o", a->output, "motion to write (CSV)")->type_name("MOTION.csv");
  verb->add_option("--rate", a->rate, "rows per second of --output; absent: the mesh of the solve")
      ->type_name("HZ")
      ->check(number_from(0.1, 1e5));
  verb->add_option("--paths", a->seeds.count, "largest number of seed paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--seconds", a->seeds.seconds, "time for the path search [s]")
      ->check(number_from(1e-3, 1e6))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed of the path search")
      ->capture_default_str();
  verb->add_option("--intervals", a->intervals,
                   "mesh intervals; absent: as the problem's knots, or 100")
      ->check(CLI::Range(10, 5000));
  verb->add_option("--processes", a->processes, "starts solved in parallel; absent: 2")
      ->check(CLI::Range(1, 256));
  verb->add_flag("--smooth-only", a->smooth_only,
                 "solve the single smooth NLP without modes (for comparison)");
  verb->add_flag("--bound", a->bound,
                 "also report the energy found by dynamic programming on a joint grid, the energy "
                 "at unlimited "
                 "time and an estimated lower bound (docs/energy_bound.md)");
  verb->add_option(
          "--from", a->from,
          "start from this motion (CSV of an earlier run, for another goal or payload) and "
          "one path of the joint grid")
      ->type_name("MOTION.csv")
      ->check(CLI::ExistingFile);
  a->outputs.add_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
