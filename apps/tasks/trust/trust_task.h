#pragma once
/// The work of the loop of trust: simulate -> fit -> compare -> diagnose -> improve -> optimize -> tracked on the plant.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/report/trust/trust_page.h"
#include "apps/tasks/task.h"
#include "models/machine/machine.h"
#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow {

struct TrustTask {
  std::vector<std::string> effects;                  ///< of the plant, as in SimulateTask
  std::optional<plant::PlantParameters> parameters;  ///< of the plant, in place of effects
  double train_seconds = 200.0;                      ///< [s] of the log to learn from
  double test_seconds = 100.0;                       ///< [s] of the log to judge on
  double rate = 25.0;                                ///< [Hz] samples of both logs
  int most_effects = ExtendOptions{}.max_steps;      ///< that improve may add
  int moves = 3;                                     ///< drawn from the seed
  std::uint64_t seed = 1;
  int processes =
      0;  ///< motions optimised and tracked at a time; 0: as many as there are processors
  /// Told whole sentences when a stage of the loop ends, in order. May be empty.
  std::function<void(const std::string& stage)> told;
};

/// @throws UsageError for a number outside its range
void check_ranges(const TrustTask& task);

/// @throws UsageError as check_ranges, and for effects that are wrong  @throws InputError where the plant's logs teach nothing
/// @throws Interruption when it is stopped before there is a model
TrustLoop trust_task(std::shared_ptr<const Machine> machine, const TrustTask& task,
                     const Listener& listener);

}  // namespace sparflow
