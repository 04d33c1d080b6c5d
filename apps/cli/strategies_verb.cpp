#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <optional>

#include "apps/cli/console.h"
#include "apps/cli/motion_inputs.h"
#include "apps/cli/outputs.h"
#include "apps/cli/verbs.h"
#include "apps/report/motion_pages/strategies_page.h"
#include "models/math/error.h"
#include "optimizer/solve/child_progress.h"
#include "optimizer/solve/kept_work.h"

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

/// Parses "equal", "own", "equal,own", "1.1,1.5,3" or any mixture of them. @throws UsageError
void read_times(const std::string& text, StrategyOptions& options) {
  options.equal_time = options.own_time = false;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const std::string word = text.substr(at, comma - at);
    at = comma + 1;
    if (word == "equal") {
      options.equal_time = true;
    } else if (word == "own") {
      options.own_time = true;
    } else {
      char* end = nullptr;
      const double factor = std::strtod(word.c_str(), &end);
      if (word.empty() || *end != '\0' || !(factor >= 1.0) || factor > 1000.0) {
        throw UsageError(fmt::format(
            "strategies: --time has \"{}\"; expected equal, own, or factors from 1 on of the "
            "shortest time, separated by commas (1.1,1.5,3)",
            word));
      }
      options.factors.push_back(factor);
    }
  }
}

/// Idle power of a problem: that of the command line, else the problem's own. [W]
double idle_power(const StrategiesArguments& a, const ProblemAndModel& task) {
  return a.idle_kw >= 0.0 ? 1e3 * a.idle_kw : task.problem.idle_power;
}

/// @throws InputError for a model without the pressures of a movement  @throws UsageError for a problem without a model
std::vector<ProblemAndModel> load_tasks(const StrategiesArguments& a,
                                        const std::vector<ProblemPath>& files, bool own_time) {
  std::vector<ProblemAndModel> tasks;
  tasks.reserve(files.size());
  for (const auto& [file, of_folder] : files) {
    std::optional<ProblemAndModel> task = load_problem_with_model(file, a.model);
    if (!task) {
      if (!of_folder) throw no_model();
      note(fmt::format("{} is left out: it names no model", file));
      continue;
    }
    tasks.push_back(std::move(*task));
    if (own_time && idle_power(a, tasks.back()) <= 0.0) {
      warn(
          fmt::format("{}: no idle power is given, so time costs nothing and the best time of each "
                      "strategy is its shortest; give --idle KW to weigh time",
                      tasks.back().problem.name));
    }
    const std::vector<std::string> missing = tasks.back().model.missing();
    if (!missing.empty()) {
      throw InputError({file, 0, 0}, "model",
                       fmt::format("the model has no working pressure for {}; fit it on a log in "
                                   "which that movement occurs",
                                   fmt::join(missing, ", ")));
    }
  }
  return tasks;
}

/// A problem for which nothing was found, and why.
StrategyComparison without_rows(const ProblemAndModel& task, const StrategyOptions& options,
                                const std::string& why) {
  StrategyComparison c;
  c.problem = task.problem.name;
  c.file = task.problem.file;
  c.payload = task.problem.payload;
  c.idle_power = options.idle_power;
  c.message = why;
  return c;
}

/// Share of a problem's work that the search of paths is, of which only the progress that is told depends.
/// @threshold [1] 0..0.5; chosen: it takes some seconds at most, and a problem up to minutes
constexpr double kPathShare = 0.1;

StrategyComparison compare_in(const ProblemAndModel& task, const StrategiesArguments& a,
                              StrategyOptions options) {
  options.idle_power = idle_power(a, task);
  if (interrupted()) {
    StrategyComparison none = without_rows(task, options, "interrupted before it began");
    none.interrupted = true;
    return none;
  }
  options.optimize.intervals = a.intervals > 0 ? a.intervals : task.problem.knots.value_or(101) - 1;
  options.baselines.intervals = options.optimize.intervals;
  options.baselines.optimize = options.optimize;
  SeedOptions paths = a.seeds;
  paths.progress = part_of(options.progress, 0.0, kPathShare);
  const Seeds seeds = make_seeds(task.problem, paths, options.optimize.intervals);
  options.progress = part_of(options.progress, kPathShare, 1.0);
  if (!seeds.motions.empty())
    return compare_strategies(task.model, task.problem, seeds.motions, options);
  return without_rows(task, options, "infeasible. " + seeds.paths.message);
}

/// All that a comparison depends on. The number of processes is not part of it.
std::string fingerprint(const std::vector<ProblemAndModel>& tasks, const StrategiesArguments& a) {
  std::vector<std::string> files;
  for (const ProblemAndModel& task : tasks) {
    files.push_back(task.problem.file);
    files.push_back(a.model.empty() ? task.problem.model_path : a.model);
  }
  return run_fingerprint(
      files,
      fmt::format("strategies --time {} --idle {} --paths {} --orders {} --seed {} "
                  "--intervals {}",
                  a.time, a.idle_kw, a.seeds.count, a.orders, a.seeds.random_seed, a.intervals));
}

/// The name of a problem's comparison in the journal, whose run fixes the order of the problems.
std::string part_name(int index) { return fmt::format("problem {}", index + 1); }

/// Compares the strategies of every problem that the journal lacks, each in a process of its own.
/// @return the results in the order of the problems
std::vector<ChildResult> results_of(const std::vector<ProblemAndModel>& tasks,
                                    const StrategiesArguments& a, const StrategyOptions& options,
                                    Journal& journal) {
  const auto task = [&](int i) -> const ProblemAndModel& {
    return tasks[static_cast<std::size_t>(i)];
  };
  KeptWork work;
  work.count = static_cast<int>(tasks.size());
  work.at_once = a.processes > 0 ? a.processes : usable_processors();
  work.name = part_name;
  ChildProgress done(work.count);  // outlives the progress that shows it; counts the starts
  work.work = [&](int i) {
    StrategyOptions told = options;
    told.optimize.progress = [&](double, const std::string&) { ++done.step(); };
    told.progress = [&](double share, const std::string&) { done.set(i, share); };
    return packed(compare_in(task(i), a, told));
  };
  work.complete = [](const std::string& bytes) { return !unpacked_comparison(bytes).interrupted; };
  work.stop = interrupted;
  const int before = finished_before(work, journal);
  if (before > 0) note(fmt::format("{} of {} problems were finished before", before, work.count));
  std::atomic<int> finished = before;
  Progress progress("strategies");
  progress.watch([&] {
    return Progress::Now{
        done.share(), fmt::format("{} of {} problem{} finished, {} starts solved", finished.load(),
                                  work.count, work.count > 1 ? "s" : "", done.step().load())};
  });
  return run_kept(work, journal, [&](int i, int now, const ChildResult&) {
    finished = now;
    done.set(i, 1.0);
    progress(done.share(), task(i).problem.name);
  });
}

/// Compares the strategies of every problem.
/// @param broken gets the number of processes that ended without a result
std::vector<StrategyComparison> compare_all(const std::vector<ProblemAndModel>& tasks,
                                            const StrategiesArguments& a,
                                            const StrategyOptions& options, Journal& journal,
                                            int& broken) {
  const std::vector<ChildResult> children = results_of(tasks, a, options, journal);
  std::vector<StrategyComparison> all;
  all.reserve(children.size());
  for (std::size_t i = 0; i < children.size(); ++i) {
    if (children[i].ok) {
      all.push_back(unpacked_comparison(children[i].bytes));
      continue;
    }
    all.emplace_back();
    all.back().problem = tasks[i].problem.name;
    all.back().file = tasks[i].problem.file;
    all.back().message = children[i].error;
    all.back().interrupted = interrupted();
    if (interrupted()) continue;
    ++broken;
    note(fmt::format("{}: {}", tasks[i].problem.file, children[i].error));
  }
  return all;
}

bool has_optimum(const StrategyComparison& c) {
  return std::any_of(c.rows.begin(), c.rows.end(), [](const StrategyRow& row) {
    return row.find(kOptimal) != nullptr && row.find(kOptimal)->found();
  });
}

int run(const StrategiesArguments& a) {
  const std::vector<ProblemPath> files = problem_files(a.problems);
  std::vector<NamedFile> inputs = {{"--model", a.model}};
  for (const ProblemPath& p : files) inputs.push_back({"--problem", p.file});
  std::vector<NamedFile> outputs = a.outputs.files();
  outputs.push_back({"the journal", a.outputs.journal()});
  check_outputs_apart("strategies", outputs, inputs);
  a.outputs.check();
  StrategyOptions options;
  read_times(a.time, options);
  options.baselines.polished_orders = a.orders;
  options.optimize.processes = 1;
  options.optimize.interrupted = interrupted;
  const std::vector<ProblemAndModel> tasks = load_tasks(a, files, options.own_time);
  const std::unique_ptr<Journal> journal =
      a.outputs.open_journal("strategies", fingerprint(tasks, a));
  finish_on_interrupt();
  int broken = 0;
  const std::vector<StrategyComparison> all = compare_all(tasks, a, options, *journal, broken);
  std::vector<Machine> machines;
  machines.reserve(tasks.size());
  for (const ProblemAndModel& task : tasks) machines.push_back(task.model.machine);
  if (!a.outputs.json.empty()) a.outputs.write_json(strategies_json(all, machines));
  if (!a.outputs.report.empty()) {
    const bool one = all.size() == 1;
    strategies_page(all, one ? &tasks.front().model : nullptr,
                    one ? &tasks.front().problem : nullptr)
        .write(a.outputs.report);
  }
  if (!interrupted() && broken == 0) journal->remove();
  tell(strategies_table(all));
  if (interrupted()) return kInterrupted;
  if (broken > 0) return kNotSolved;
  return std::any_of(all.begin(), all.end(), has_optimum) ? kDone : kNotSolved;
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
