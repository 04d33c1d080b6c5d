#pragma once
/// Sequential against simultaneous against energy-optimal, for people and for machines.
#include "apps/report/page/page.h"
#include "optimizer/baselines/strategies_summary.h"

namespace sparflow {

/// One problem: its motions in detail. Several: medians, spread and tests over them.
/// @param model, problem of the only comparison, for the pictures; null where there are several
Page strategies_page(const std::vector<StrategyComparison>& all, const CraneModel* model,
                     const MotionProblem* problem);

/// `strategies`' machine-readable result (keys: docs/strategies.md).
/// @param machines of the comparisons, for the names of cylinders and pumps
std::string strategies_json(const std::vector<StrategyComparison>& all,
                            const std::vector<Machine>& machines);

/// One screen for a terminal.
std::string strategies_table(const std::vector<StrategyComparison>& all);

}  // namespace sparflow
