#pragma once
/// A controller of the user's own that is asked by lines of JSON (docs/benchmark.md): a program on its standard input and output,
/// or whatever answers them. What it does wrong (hang, end, print what is no answer) is a ControllerFailure with a sentence.
#include <functional>
#include <memory>
#include <string>

#include "simulator/controllers/controller.h"

namespace sparflow::control {

/// Hands a line of JSON to the controller and gives its answer. @param t [s] for sentences @throws ControllerFailure
using Ask = std::function<std::string(const std::string& line, double t)>;

/// @param who the begin of sentences on what it does wrong: "its process", "its function"
std::unique_ptr<Controller> asked_controller(const Knowledge& knowledge, const std::string& who,
                                             const Ask& ask);

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
