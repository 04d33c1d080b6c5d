#pragma once
/// What a set of comparisons says: by how much each way is dearer than the optimum, and whether that is chance.
#include <string>
#include <vector>

#include "optimizer/baselines/strategies.h"
#include "optimizer/baselines/strategies_statistics.h"

namespace sparflow {

/// One way against another over all problems in which both keep the limits.
struct PairedSummary {
  std::string kind, against;
  int n = 0;             ///< problems in which both were found
  int only_kind = 0;     ///< in which only `kind` was
  int only_against = 0;  ///< in which only the other was
  int cheaper = 0;       ///< in which `kind` is cheaper by more than 0.1 %
  int dearer = 0;        ///< in which it is dearer by more than 0.1 %
  double median = 0.0;   ///< [-] of cost / other cost - 1
  double lower = 0.0;    ///< [-] first quartile
  double upper = 0.0;    ///< [-] third quartile
  double least = 0.0;    ///< [-]
  double largest = 0.0;  ///< [-]
  SignedRank test;       ///< of the differences of cost
};

/// Pump energy and what the engine idles meanwhile [J].
double cost_with_idling(const StrategyOutcome& outcome, double idle_power);

/// @param row "equal", "own" or the name of a factor's row. Equal times: energies; own times: with idling
PairedSummary paired(const std::vector<StrategyComparison>& all, const std::string& row,
                     const std::string& kind, const std::string& against);

/// Names of the rows that occur, in order of appearance.
std::vector<std::string> row_names(const std::vector<StrategyComparison>& all);

/// "sequential", "simultaneous (best end)", ... for tables and pages.
std::string strategy_title(const std::string& kind);

}  // namespace sparflow
