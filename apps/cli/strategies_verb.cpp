#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/strategies_page.h"
#include "apps/tasks/strategies_task.h"
#include "models/math/error.h"

namespace sparflow::cli {
namespace {

struct StrategiesArguments {
  std::vector<std::string> problems;
  std::string model;
  std::string time = "equal";
  double idle_kw = -1.0;
  SeedOptions seeds;
  int intervals = 0;
  int processes = 0;
  int orders = 4;
  Outputs outputs;
};

struct ProblemPath {
  std::string file;
  bool of_folder = false;  ///< found in a folder, not named by the user
};

/// Replaces each folder by its .yaml files in the order of their names.
/// @throws InputError for a folder without such files
std::vector<ProblemPath> problem_files(const std::vector<std::string>& given) {
  namespace fs = std::filesystem;
  std::vector<ProblemPath> files;
  for (const std::string& path : given) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      files.push_back({path, false});
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.path().extension() == ".yaml") inside.push_back(entry.path().string());
    }
    if (inside.empty())
      throw InputError({path, 0, 0}, "", "no motion problem (*.yaml) in this folder");
    std::sort(inside.begin(), inside.end());
    for (const std::string& file : inside) files.push_back({file, true});
  }
  return files;
}

/// @throws InputError for a model without the pressures of a movement  @throws UsageError for a problem without a model
std::vector<SharedProblem> load_problems(const StrategiesArguments& a,
                                         const std::vector<ProblemPath>& files,
                                         const StrategiesTask& task) {
  std::vector<SharedProblem> problems;
  problems.reserve(files.size());
  for (const auto& [file, of_folder] : files) {
    std::optional<ProblemAndModel> problem = load_problem_with_model(file, a.model);
    if (!problem) {
      if (!of_folder) throw no_model();
      note(fmt::format("{} is left out: it names no model", file));
      continue;
    }
    check_strategies_problem(task, *problem, console_listener());
    problems.push_back(std::make_shared<ProblemAndModel>(std::move(*problem)));
  }
  return problems;
}

/// All that a comparison depends on. The number of processes is not part of it.
std::string fingerprint(const std::vector<SharedProblem>& problems, const StrategiesArguments& a) {
  std::vector<std::string> files;
  for (const SharedProblem& p : problems) {
    files.push_back(p->problem.file);
    files.push_back(a.model.empty() ? p->problem.model_path : a.model);
  }
  return run_fingerprint(
      files,
      fmt::format("strategies --time {} --idle {} --paths {} --orders {} --seed {} "
                  "--intervals {}",
                  a.time, a.idle_kw, a.seeds.count, a.orders, a.seeds.random_seed, a.intervals));
}

int run(const StrategiesArguments& a) {
  const std::vector<ProblemPath> files = problem_files(a.problems);
  std::vector<NamedFile> inputs = {{"--model", a.model}};
  for (const ProblemPath& p : files) inputs.push_back({"--problem", p.file});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"the journal", a.outputs.journal()});
  check_outputs_apart("strategies", outputs, inputs);
  a.outputs.check();
  StrategiesTask task;
  read_times(a.time, task.options);
  task.options.baselines.polished_orders = a.orders;
  task.seeds = a.seeds;
  task.idle_kw = a.idle_kw;
  task.intervals = a.intervals;
  task.processes = a.processes;
  const std::vector<SharedProblem> problems = load_problems(a, files, task);
  const std::unique_ptr<Journal> journal =
      a.outputs.open_journal("strategies", fingerprint(problems, a));
  finish_on_interrupt();
  const ComparedStrategies compared = [&] {
    Progress progress("strategies");
    return strategies_task(
        problems, task, *journal,
        console_listener([&](double share, const std::string& what) { progress(share, what); }));
  }();
  if (!a.outputs.json.empty())
    a.outputs.write_json(strategies_json(compared.all, machines_of(problems)));
  if (!a.outputs.report.empty()) {
    const ProblemAndModel* one = compared.all.size() == 1 ? problems.front().get() : nullptr;
    strategies_page(compared.all, one ? &one->model : nullptr, one ? &one->problem : nullptr)
        .write(a.outputs.report);
  }
  if (!interrupted() && compared.broken == 0) journal->remove();
  tell(strategies_table(compared.all));
  if (interrupted()) return kInterrupted;
  return compared.broken == 0 && compared.has_optimum() ? kDone : kNotSolved;
}

}  // namespace

void add_strategies_verb(CLI::App& app, int& code) {
  auto a = std::make_shared<StrategiesArguments>();
  CLI::App* verb = app.add_subcommand(
      "strategies", "compare sequential, simultaneous and energy-optimal motions");
  verb->add_option("--problem,-p", a->problems, "motion problems (YAML), or folders of them")
      ->required()
      ->type_name("FILE|DIR");
  verb->add_option("--model", a->model, "fitted model; absent: the one that each problem names")
      ->type_name("MODEL.json");
  verb->add_option("--time", a->time,
                   "equal (the problem's duration), own (the best time of each strategy, with idle "
                   "power), or factors of the shortest time, separated by commas: 1.1,1.5,3")
      ->type_name("WHEN")
      ->capture_default_str();
  verb->add_option("--idle", a->idle_kw, "idle power; absent: that of the problem")
      ->type_name("KW")
      ->check(number_from(0.0, 1000.0));
  verb->add_option("--paths", a->seeds.count, "largest number of seed paths")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  verb->add_option("--orders", a->orders,
                   "number of orders of the cylinders whose segments are optimised")
      ->check(CLI::Range(0, 120))
      ->capture_default_str();
  verb->add_option("--seed", a->seeds.random_seed, "random seed of the path search")
      ->capture_default_str();
  verb->add_option("--intervals", a->intervals,
                   "mesh intervals; absent: as the problem's knots, or 100")
      ->check(CLI::Range(10, 5000));
  verb->add_option("--processes", a->processes,
                   "problems solved in parallel; absent: as many as there are processors")
      ->check(CLI::Range(1, 256));
  a->outputs.add_to(*verb);
  a->outputs.add_resume_to(*verb);
  verb->callback([a, &code] { code = run(*a); });
}

}  // namespace sparflow::cli
