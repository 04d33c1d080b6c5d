#pragma once
/// The texts of `fit` besides its page: JSON, judgement in one line, and what could not be learned.
#include <string>
#include <vector>

#include "identification/learning/fit.h"

namespace sparflow {

/// Returns the result of `fit` as JSON (keys: docs/commands.md).
std::string fit_json(const FitResult& result);

/// The headline of the comparison that judges the model, as its page has it, with a line end; "" when all is good.
std::string fit_judgement(const FitResult& result);

/// Checks that something was learned where the machine has hydraulic cylinders.
/// @param file the only log, for the message; "" where there are several
/// @throws InputError that names what the logs lack
void check_learned(const FitResult& result, const std::string& file);

/// Whether the machine has hydraulic cylinders and no pressure model of any of them was learned.
bool no_pressure_learned(const FitResult& result);

/// What the model cannot predict, as whole sentences for a warning; empty when it is complete.
std::vector<std::string> learning_gaps(const FitResult& result);

}  // namespace sparflow
