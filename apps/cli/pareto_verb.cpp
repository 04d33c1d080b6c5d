#include <fmt/format.h>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/pareto_page.h"
#include "apps/tasks/inputs.h"
#include "apps/tasks/pareto_task.h"

namespace sparflow::cli {
namespace {

struct ParetoArguments {
  std::string problem, model, output;
  SeedOptions seeds;
  int points = 14;
  double longest = 6.0;
  std::vector<double> idle_kw = {1, 2, 5, 10, 15};
  int intervals = 0;
  int processes = 0;
  Outputs outputs;
};

/// All that the curve depends on. The number of processes is not part of it.
std::string fingerprint(const ParetoArguments& a, const MotionProblem& problem) {
  return run_fingerprint(
      {problem.file, a.model.empty() ? problem.model_path : a.model},
      fmt::format("pareto --points {} --longest {} --idle {} --paths {} --seed {} --intervals {}",
                  a.points, a.longest, fmt::join(a.idle_kw, ","), a.seeds.count,
                  a.seeds.random_seed, a.intervals));
}

int run(const ParetoArguments& a) {
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"--output", a.output});
  outputs.push_back({"the journal", a.outputs.journal()});
  check_outputs_apart("pareto", outputs, {{"--problem", a.problem}, {"--model", a.model}});
  check_writable(a.output);
  a.outputs.check();
  const ProblemAndModel both = load_problem_and_model(a.problem, a.model);
  const MotionProblem& problem = both.problem;
  require_pressures(both.model, problem.file, "model");
  ParetoTask task;
  task.seeds = a.seeds;
  task.points = a.points;
  task.longest = a.longest;
  task.idle_kw = a.idle_kw;
  task.intervals = a.intervals;
  task.processes = a.processes;
  task.searching = finish_on_interrupt;
  const std::unique_ptr<Journal> journal =
      a.outputs.open_journal("pareto", fingerprint(a, problem));
  if (journal->finished() > 0)
    note(fmt::format("{} solves were finished before", journal->finished()));
  const ParetoCurve curve = [&] {
    Progress progress("pareto");
    return pareto_task(
        both, task, *journal,
        console_listener([&](double share, const std::string& what) { progress(share, what); }));
  }();
  if (!a.output.empty() && !curve.points.empty())
    write_file_atomically(a.output, pareto_csv(curve));
  if (!a.outputs.json.empty()) a.outputs.write_json(pareto_json(problem, curve));
  if (!a.outputs.report.empty()) pareto_page(both.model, problem, curve).write(a.outputs.report);
  if (!curve.interrupted) journal->remove();
  tell(pareto_table(problem, curve));
  if (curve.interrupted) return kInterrupted;
  return curve.points.empty() ? kNotSolved : kDone;
}

}  // namespace

void add_pareto_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<ParetoArguments>();
  CLI::App* verb =
      app.add_subcommand("pareto", "compute the least energy as a function of the duration");
  verb->add_option("--problem,-p", a->problem, "motion problem (YAML); its duration is not used")
      ->required()
      ->type_name("FILE");
  verb->add_option("--model", a->model, "fitted model; absent: the one that the problem names")
      ->type_name("MODEL.json");
  verb->add_option("--output,-o", a->output, "curve to write (CSV)")->type_name("CURVE.csv");
  verb->add_option("--points", a->points,
                   "number of durations, besides those that search for the shortest")
      ->check(CLI::Range(3, 200))
      ->capture_default_str();
  verb->add_option("--longest", a->longest, "longest duration, as a multiple of the shortest")
      ->check(number_from(1.2, 100.0))
      ->capture_default_str();
  verb->add_option("--idle", a->idle_kw, "idle powers for which the best duration is reported")
      ->type_name("KW")
      ->check(number_from(0.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--paths", a->seeds.count, "largest number of seed paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed of the path search")
      ->capture_default_str();
  verb->add_option("--intervals", a->intervals,
                   "mesh intervals; absent: as the problem's knots, or 100")
      ->check(CLI::Range(10, 5000));
  verb->add_option("--processes", a->processes, "starts solved in parallel; absent: 2")
      ->check(CLI::Range(1, 256));
  a->outputs.add_to(*verb);
  a->outputs.add_resume_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
