#pragma once
/// One drive of the crane by its operator, step by step: what makes a log, and what else watches it.
#include <functional>
#include <memory>
#include <vector>

#include "simulator/hidden_effects/plant.h"

namespace sparflow::simulator {

/// A crane with its hidden laws as drawn for a request. Stays where it is: laws keep its address.
struct HiddenCase {
  CraneLaws laws;
  std::vector<HiddenEffect> drawn;  ///< place and law filled in
  std::vector<std::unique_ptr<HiddenLaw>> hidden;
  double usual_payload = 0.0;  ///< [kg]
};

/// The same for the same request: drawn twice, two cranes that do the same.
std::unique_ptr<HiddenCase> draw_hidden(const LogRequest& request);

struct StepInput {
  double payload;                      ///< [kg]
  double oil;                          ///< [degC]
  const std::vector<double>& command;  ///< [-] by cylinder
};
using StepWatch = std::function<void(const Plant&, const StepInput&)>;  ///< before each step
using RowWatch = std::function<void(Plant&, double payload)>;           ///< at each row of the log

void drive_log(const LogRequest& request, HiddenCase& one, const StepWatch& before_step,
               const RowWatch& after_row);

}  // namespace sparflow::simulator
