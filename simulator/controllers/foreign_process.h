#pragma once
/// A controller that is a program of the user's own: lines of JSON on its standard input and output (docs/benchmark.md). What
/// it does wrong (hang, end, print what is no answer) is a ControllerFailure with a sentence.
#include <memory>
#include <string>

#include "simulator/controllers/controller.h"

namespace sparflow::control {

struct ForeignOptions {
  /// Time in which a step must be answered.
  /// @threshold [s] 0.001..60; chosen: far above a step of any controller here; machines that are busy answer late
  double step_budget = 0.5;
  /// Time in which the first line must be answered, as interpreters take time to begin.
  /// @threshold [s] 0.1..600; chosen: a Python program with large libraries begins within it
  double start_budget = 20.0;
};

/// @param command for /bin/sh, run at once; it ends with this object
std::unique_ptr<Controller> foreign_controller(const Knowledge& knowledge,
                                               const std::string& command,
                                               const ForeignOptions& options = {});

}  // namespace sparflow::control
