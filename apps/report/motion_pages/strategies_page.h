#pragma once
/// The page and the texts of strategies: sequential, simultaneous and energy-optimal motions compared.
#include "apps/report/page/page.h"
#include "optimizer/baselines/strategies_summary.h"

namespace sparflow {

/// Shows the motions of a single problem in detail, and medians, spread and tests over several problems.
/// @param model, problem of the only comparison, for its figures; null where there are several
Page strategies_page(const std::vector<StrategyComparison>& all, const CraneModel* model,
                     const MotionProblem* problem);

/// Whether the comparison of any problem ended early.
bool any_interrupted(const std::vector<StrategyComparison>& all);

/// Returns the result of `strategies` as JSON (keys: docs/strategies.md).
/// @param machines one for each comparison, for the names of cylinders and pumps
std::string strategies_json(const std::vector<StrategyComparison>& all,
                            const std::vector<Machine>& machines);

/// Returns the comparisons as text of one screen.
std::string strategies_table(const std::vector<StrategyComparison>& all);

}  // namespace sparflow
