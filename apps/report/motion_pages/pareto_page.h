#pragma once
/// Energy against time, for people and for machines.
#include "apps/report/page/page.h"
#include "optimizer/baselines/pareto.h"

namespace sparflow {

Page pareto_page(const CraneModel& model, const MotionProblem& problem, const ParetoCurve& curve);

/// Keys: docs/strategies.md.
std::string pareto_json(const MotionProblem& problem, const ParetoCurve& curve);

/// duration_s, energy_J, sequential_J, simultaneous_J, share_moving_0 ... one row a duration.
std::string pareto_csv(const ParetoCurve& curve);

/// One screen for a terminal.
std::string pareto_table(const MotionProblem& problem, const ParetoCurve& curve);

}  // namespace sparflow
