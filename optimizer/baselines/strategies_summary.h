#pragma once
/// Summary of several comparisons: excess cost of each strategy over the optimum, and its significance.
#include <string>
#include <vector>

#include "optimizer/baselines/strategies.h"
#include "optimizer/baselines/strategies_statistics.h"

namespace sparflow {

/// One strategy against another over all problems in which both keep the limits.
struct PairedSummary {
  std::string kind, against;
  int n = 0;             ///< problems in which both were found
  int only_kind = 0;     ///< problems in which only `kind` was found
  int only_against = 0;  ///< problems in which only `against` was found
  int cheaper = 0;       ///< problems in which `kind` is cheaper by more than 0.1 %
  int dearer = 0;        ///< problems in which `kind` costs more by more than 0.1 %
  double median = 0.0;   ///< [-] of cost / other cost - 1
  double lower = 0.0;    ///< [-] first quartile
  double upper = 0.0;    ///< [-] third quartile
  double least = 0.0;    ///< [-]
  double largest = 0.0;  ///< [-]
  SignedRank test;       ///< of the differences of cost
};

/// Pump energy and idle power times duration [J].
double cost_with_idling(const StrategyOutcome& outcome, double idle_power);

/// @param row "equal", "own" or the name of a factor's row. Energies are compared at equal durations, costs with idling at
/// own durations.
PairedSummary paired(const std::vector<StrategyComparison>& all, const std::string& row,
                     const std::string& kind, const std::string& against);

/// Names of the rows that occur, in order of appearance.
std::vector<std::string> row_names(const std::vector<StrategyComparison>& all);

/// "sequential", "simultaneous (best end)", ... for tables and pages.
std::string strategy_title(const std::string& kind);

}  // namespace sparflow
