#pragma once
/// Simulates the operator's drive of a crane step by step; callbacks record the log or compare with a second crane.
#include <functional>
#include <memory>
#include <vector>

#include "simulator/hidden_effects/plant.h"

namespace sparflow::simulator {

/// A crane with its hidden laws as drawn for a request. It must not be moved, because laws keep its address.
struct HiddenCase {
  CraneLaws laws;
  std::vector<HiddenEffect> drawn;  ///< with place and law set
  std::vector<std::unique_ptr<HiddenLaw>> hidden;
  double usual_payload = 0.0;  ///< [kg]
};

/// Draws the crane of a request. It is deterministic: the same request drawn twice gives two cranes that behave alike.
std::unique_ptr<HiddenCase> draw_hidden(const LogRequest& request);

struct StepInput {
  double payload;                      ///< [kg]
  double oil;                          ///< [degC]
  const std::vector<double>& command;  ///< [-] by cylinder
};
using StepWatch = std::function<void(const Plant&, const StepInput&)>;  ///< called before each step
using RowWatch =
    std::function<void(Plant&, double payload)>;  ///< called at each row of the log; [kg]

/// Drives the crane through the motions of a request. @param before_step may be empty
void drive_log(const LogRequest& request, HiddenCase& one, const StepWatch& before_step,
               const RowWatch& after_row);

}  // namespace sparflow::simulator
