#pragma once
/// The work of `strategies`: the problems of a comparison, each compared in a process of its own.
#include <memory>
#include <string>
#include <vector>

#include "apps/tasks/motion_inputs.h"
#include "models/math/journal.h"
#include "optimizer/baselines/strategies.h"

namespace sparflow {

/// A problem of a comparison. The model is shared, because a set of problems often has one model.
using SharedProblem = std::shared_ptr<const ProblemAndModel>;

struct StrategiesTask {
  /// At which times, and with how many orders; the rest is set for each problem. Its progress and its `interrupted` are the
  /// listener's.
  StrategyOptions options;
  SeedOptions seeds;      ///< its progress is the listener's
  double idle_kw = -1.0;  ///< [kW] negative: that of each problem
  int intervals = 0;      ///< of the mesh; 0: intervals_of the problem
  int processes = 0;      ///< problems at a time; 0: as many as there are processors
};

struct ComparedStrategies {
  std::vector<StrategyComparison> all;  ///< in the order of the problems
  int broken = 0;                       ///< processes that ended without a result
  bool interrupted = false;
  /// Whether an energy-optimal motion was found in any of them.
  bool has_optimum() const;
};

/// Sets the times of "equal", "own", "equal,own", "1.1,1.5,3" or any mixture of them. @throws UsageError
void read_times(const std::string& text, StrategyOptions& options);

/// @throws UsageError for a number outside its range (docs/commands.md)
void check_ranges(const StrategiesTask& task);

/// Checks one problem, and warns where own times are asked for without idle power.
/// @throws InputError for a model without the pressures of a movement
void check_strategies_problem(const StrategiesTask& task, const ProblemAndModel& problem,
                              const Listener& listener);

/// Compares the strategies of every problem that the journal lacks. @throws UsageError as check_ranges
ComparedStrategies strategies_task(const std::vector<SharedProblem>& problems,
                                   const StrategiesTask& task, Journal& journal,
                                   const Listener& listener);

/// Machines of the problems, which JSON needs for the names of joints.
std::vector<Machine> machines_of(const std::vector<SharedProblem>& problems);

}  // namespace sparflow
