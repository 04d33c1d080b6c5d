#pragma once
/// The page and the texts of pareto: least energy as a function of the duration.
#include "apps/report/page/page.h"
#include "optimizer/baselines/pareto.h"

namespace sparflow {

Page pareto_page(const CraneModel& model, const MotionProblem& problem, const ParetoCurve& curve);

/// Returns the curve as JSON (keys: docs/strategies.md).
std::string pareto_json(const MotionProblem& problem, const ParetoCurve& curve);

/// Returns the curve as CSV, one row for each duration: duration_s, energy_J, sequential_J, simultaneous_J,
/// share_moving_0 ...
std::string pareto_csv(const ParetoCurve& curve);

/// Returns the curve as text of one screen.
std::string pareto_table(const MotionProblem& problem, const ParetoCurve& curve);

}  // namespace sparflow
