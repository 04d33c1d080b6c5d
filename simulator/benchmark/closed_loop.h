#pragma once
/// A controller does a scenario's work on the dynamic plant: sensors with noise in, commands through, everything scored by
/// the plant's own values.
#include <functional>
#include <memory>

#include "simulator/benchmark/result.h"
#include "simulator/benchmark/scenario.h"
#include "simulator/controllers/controller.h"
#include "simulator/plant/run/plant_run.h"

namespace sparflow::benchmark {

struct LoopOptions {
  /// Time between two samples of sensors and commands.
  /// @threshold [s] 0.001..0.1; chosen: 50 Hz is what controllers of mobile machines run at
  double sample_time = 0.02;
  /// Time constant of the filter of the joints' speeds.
  /// @threshold [s] 0..1; chosen: noise of the differences falls to a tenth, and valves are slower
  double speed_filter = 0.1;
  /// Time for which the tip must stay at its goal.
  /// @threshold [s] 0..10; chosen: a payload swings to and fro once in about two seconds
  double hold = 2.0;
  /// Speed of the tip below which it counts as resting.
  /// @threshold [m/s] 0.001..0.5; chosen: a load can then be set down
  double rest_speed = 0.05;
  /// Time for a goal over its duration after which the run is a failure, where the scenario's limit does not end it before.
  /// @threshold [-] 1..10; chosen: an operator gives up
  double patience = 2.0;
  /// Share of a joint's range by which it may be outside, and of its speed limit by which it may be faster.
  /// @threshold [-] 0..0.2; chosen: what sensors and rounding cannot tell
  double slack = 0.02;
  /// Time at the pump's cut-off that counts as a broken limit.
  /// @threshold [s] 0.02..5; chosen: a peak of pressure is no stall
  double cut_off_time = 0.2;
  /// Time between two instants of the trace.
  /// @threshold [s] 0.02..5; chosen: a picture shows no more
  double trace_step = 0.2;
  std::function<bool()> stop;  ///< asked at each sample; true ends the run as a failure
  /// Told the plant's true values and energies at each sample. May be empty.
  std::function<void(const plant::Record&, const plant::EnergyLedger&)> watch;
};

/// Makes the controller of a run; what it throws is the row's reason.
using MakeController = std::function<std::unique_ptr<control::Controller>()>;

/// Never throws for what controller or plant do: that is the row's reason.
/// @param name of the controller in the row
Row run_closed_loop(const Scenario& scenario, const std::string& name, const MakeController& make,
                    std::uint64_t seed, const LoopOptions& options = {});

}  // namespace sparflow::benchmark
