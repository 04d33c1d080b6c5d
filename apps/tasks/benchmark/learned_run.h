#pragma once
/// A controller in a scenario on the dynamic plant, with what a fitted model lends it: valves, predicted power, motions.
#include <functional>
#include <memory>
#include <string>

#include "apps/tasks/benchmark/optimal_motions.h"
#include "simulator/benchmark/closed_loop.h"

namespace sparflow {

/// Makes a controller from what it may know.
using MakeLearned = std::function<std::unique_ptr<control::Controller>(const control::Knowledge&)>;

/// All must outlive it.
struct LearnedRun {
  const benchmark::Scenario& scenario;
  const CraneModel* model;  ///< null: there is none
  const OptimalMotions& motions;
  const OptimalMotionOptions& planning;

  /// Never throws for what controller or plant do, as run_closed_loop.  @param name of the controller in the row
  benchmark::Row run(const std::string& name, const MakeLearned& make, std::uint64_t seed,
                     const benchmark::LoopOptions& loop) const;
};

}  // namespace sparflow
