#pragma once
/// The work of `optimize`: seed paths, the optimiser, and an estimated lower bound.
#include <functional>
#include <optional>

#include "apps/tasks/motion_inputs.h"

namespace sparflow {

struct OptimizeTask {
  SeedOptions seeds;                ///< its progress is the listener's
  int intervals = 0;                ///< of the mesh; 0: intervals_of the problem
  int processes = 0;                ///< starts solved in parallel; 0: two
  bool smooth_only = false;         ///< the single smooth NLP without modes, for comparison
  std::optional<Trajectory> from;   ///< warm start
  std::function<void()> searching;  ///< called when there is something that Ctrl-C would keep
};

struct Optimized {
  Seeds seeds;
  OptimizeResult result;
};

/// @throws UsageError for a number outside its range (docs/commands.md)
void check_ranges(const OptimizeTask& task);

/// @throws UsageError as check_ranges  @throws InputError when the model lacks a pressure model that the machine needs
/// @throws Interruption when it is stopped before the optimiser has begun
Optimized optimize_task(const CraneModel& model, const MotionProblem& problem,
                        const OptimizeTask& task, const Listener& listener);

/// Computes the bound in a process of its own, which can be ended at any time, and adds its time to that of the result.
void add_bound(const CraneModel& model, const MotionProblem& problem, const Listener& listener,
               OptimizeResult& result);

}  // namespace sparflow
