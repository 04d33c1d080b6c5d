#pragma once
/// The work of `pareto`: the least energy as a function of the duration.
#include "apps/tasks/motion_inputs.h"
#include "models/math/journal.h"
#include "optimizer/baselines/pareto.h"

namespace sparflow {

struct ParetoTask {
  SeedOptions seeds;  ///< its progress is the listener's
  int points = ParetoOptions{}.points;
  double longest = ParetoOptions{}.longest;         ///< in units of the shortest duration
  std::vector<double> idle_kw = {1, 2, 5, 10, 15};  ///< [kW]
  int intervals = 0;                                ///< of the mesh; 0: intervals_of the problem
  int processes = 0;                                ///< starts solved in parallel; 0: two
  std::function<void()> searching;  ///< called when there is something that Ctrl-C would keep
};

/// @throws UsageError for a number outside its range (docs/commands.md)
void check_ranges(const ParetoTask& task);

/// @param both with all pressures that a motion needs (require_pressures)  @throws UsageError as check_ranges
ParetoCurve pareto_task(const ProblemAndModel& both, const ParetoTask& task, Journal& journal,
                        const Listener& listener);

}  // namespace sparflow
