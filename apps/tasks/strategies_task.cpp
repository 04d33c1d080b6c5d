#include "apps/tasks/strategies_task.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>

#include "apps/tasks/argument_range.h"
#include "apps/tasks/inputs.h"
#include "models/math/error.h"
#include "optimizer/solve/child_progress.h"
#include "optimizer/solve/kept_work.h"

namespace sparflow {
namespace {

/// Idle power of a problem: the one asked for, else the problem's own. [W]
double idle_power_of(const StrategiesTask& task, const ProblemAndModel& problem) {
  return task.idle_kw >= 0.0 ? 1e3 * task.idle_kw : problem.problem.idle_power;
}

/// A problem for which nothing was found, and why.
StrategyComparison without_rows(const ProblemAndModel& problem, const StrategyOptions& options,
                                const std::string& why) {
  StrategyComparison c;
  c.problem = problem.problem.name;
  c.file = problem.problem.file;
  c.payload = problem.problem.payload;
  c.idle_power = options.idle_power;
  c.message = why;
  return c;
}

/// Share of a problem's work that the search of paths is, of which only the progress that is told depends.
/// @threshold [1] 0..0.5; chosen: it takes some seconds at most, and a problem up to minutes
constexpr double kComparedPathShare = 0.1;

StrategyComparison compare_in(const ProblemAndModel& problem, const StrategiesTask& task,
                              StrategyOptions options) {
  options.idle_power = idle_power_of(task, problem);
  if (options.optimize.interrupted && options.optimize.interrupted()) {
    StrategyComparison none = without_rows(problem, options, "interrupted before it began");
    none.interrupted = true;
    return none;
  }
  options.optimize.intervals = intervals_of(problem.problem, task.intervals);
  options.baselines.intervals = options.optimize.intervals;
  options.baselines.optimize = options.optimize;
  SeedOptions paths = task.seeds;
  paths.progress = part_of(options.progress, 0.0, kComparedPathShare);
  const Seeds seeds = make_seeds(problem.problem, paths, options.optimize.intervals);
  options.progress = part_of(options.progress, kComparedPathShare, 1.0);
  if (!seeds.motions.empty())
    return compare_strategies(problem.model, problem.problem, seeds.motions, options);
  return without_rows(problem, options, "infeasible. " + seeds.paths.message);
}

/// Runs every comparison that the journal lacks in a process of its own. @return results in the order of the problems
std::vector<ChildResult> comparisons_of(const std::vector<SharedProblem>& problems,
                                        const StrategiesTask& task, Journal& journal,
                                        const Listener& listener) {
  const auto problem = [&](int i) -> const ProblemAndModel& {
    return *problems[static_cast<std::size_t>(i)];
  };
  KeptWork work;
  work.count = static_cast<int>(problems.size());
  work.at_once = task.processes > 0 ? task.processes : usable_processors();
  // the journal's run fixes the order of the problems
  work.name = [](int index) { return fmt::format("problem {}", index + 1); };
  ChildProgress done(work.count);  // counts the starts as well
  work.work = [&](int i) {
    StrategyOptions told = task.options;
    told.optimize.processes = 1;
    told.optimize.interrupted = listener.interrupted;
    told.optimize.progress = [&](double, const std::string&) { ++done.step(); };
    told.progress = [&](double share, const std::string&) { done.set(i, share); };
    return packed(compare_in(problem(i), task, told));
  };
  work.complete = [](const std::string& bytes) { return !unpacked_comparison(bytes).interrupted; };
  const int before = finished_before(work, journal);
  if (before > 0)
    listener.say_note(fmt::format("{} of {} problems were finished before", before, work.count));
  int finished = before;
  work.stop = [&] {
    if (listener.progress)
      listener.progress(done.share(),
                        fmt::format("{} of {} problem{} finished, {} starts solved", finished,
                                    work.count, work.count > 1 ? "s" : "", done.step().load()));
    return listener.stop();
  };
  return run_kept(work, journal, [&](int i, int now, const ChildResult&) {
    finished = now;
    done.set(i, 1.0);
  });
}

}  // namespace

bool ComparedStrategies::has_optimum() const {
  return std::any_of(all.begin(), all.end(), [](const StrategyComparison& c) {
    return std::any_of(c.rows.begin(), c.rows.end(), [](const StrategyRow& row) {
      return row.find(kOptimal) != nullptr && row.find(kOptimal)->found();
    });
  });
}

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

void check_ranges(const StrategiesTask& task) {
  require_range_or("strategies: --idle", task.idle_kw, -1.0, 0.0, 1000.0);
  require_range("strategies: --paths", task.seeds.count, 1, 64);
  require_range("strategies: --orders", task.options.baselines.polished_orders, 0, 120);
  require_range_or("strategies: --intervals", task.intervals, 0, 10, 5000);
  require_range("strategies: --processes", task.processes, 0, 256);
}

void check_strategies_problem(const StrategiesTask& task, const ProblemAndModel& problem,
                              const Listener& listener) {
  require_one_move("strategies", problem.problem);
  if (task.options.own_time && idle_power_of(task, problem) <= 0.0) {
    listener.say_warning(
        fmt::format("{}: no idle power is given, so time costs nothing and the best time of each "
                    "strategy is its shortest; give --idle KW to weigh time",
                    problem.problem.name));
  }
  require_pressures(problem.model, problem.problem.file, "model");
}

ComparedStrategies strategies_task(const std::vector<SharedProblem>& problems,
                                   const StrategiesTask& task, Journal& journal,
                                   const Listener& listener) {
  check_ranges(task);
  const std::vector<ChildResult> children = comparisons_of(problems, task, journal, listener);
  ComparedStrategies compared;
  compared.all.reserve(children.size());
  compared.interrupted = listener.stop();
  for (std::size_t i = 0; i < children.size(); ++i) {
    if (children[i].ok) {
      compared.all.push_back(unpacked_comparison(children[i].bytes));
      continue;
    }
    StrategyComparison& none = compared.all.emplace_back();
    none.problem = problems[i]->problem.name;
    none.file = problems[i]->problem.file;
    none.message = children[i].error;
    none.interrupted = compared.interrupted;
    if (compared.interrupted) continue;
    ++compared.broken;
    listener.say_note(fmt::format("{}: {}", problems[i]->problem.file, children[i].error));
  }
  return compared;
}

std::vector<Machine> machines_of(const std::vector<SharedProblem>& problems) {
  std::vector<Machine> machines;
  machines.reserve(problems.size());
  for (const SharedProblem& p : problems) machines.push_back(p->model.machine);
  return machines;
}

}  // namespace sparflow
