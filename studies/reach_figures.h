#pragma once
/// One reach solved by every strategy of docs/strategies.md in equal time, with its bounds.
#include <nlohmann/json.hpp>
#include <string>

#include "optimizer/baselines/strategies.h"
#include "studies/reach_tasks.h"

namespace sparflow::bench {

struct ReachFigures {
  StrategyComparison comparison;
  double bound = 0.0;       ///< [J] estimated bound of motions in the optimum's time; 0 = none
  double slow_bound = 0.0;  ///< [J] estimated bound of motions of any duration
  double unlimited = 0.0;   ///< [J] cheapest path of the grid at unlimited time, 0 = not computed
  /// [J] the grid's cheapest path driven in the optimum's time (optimizer/grid/driven_grid_path.h); 0 = none keeps all limits
  double grid_path = 0.0;
  std::string named;      ///< message of an infeasible reach
  std::string worst;      ///< the constraint that the message names, empty when it names none
  bool left_out = false;  ///< by ReachSettings::faster_than
  /// The optimum in equal time; null when there is none.
  const StrategyOutcome* optimum() const {
    const StrategyRow* row = comparison.row("equal");
    const StrategyOutcome* best = row != nullptr ? row->find(kOptimal) : nullptr;
    return best != nullptr && best->found() ? best : nullptr;
  }
};

struct ReachSettings {
  int intervals = 100, paths = 4;
  bool grid = true, bound = true, timed = true;
  double faster_than =
      0.0;  ///< [-] reaches slower than this multiple of the shortest time are left out; 0 = none
  nlohmann::json optima = nlohmann::json::
      object();  ///< results of an earlier run by problem, which are not solved again
};

/// Solves one reach.
ReachFigures solve_reach(const ReachTask& task, const ReachSettings& settings);

/// Serialise figures for the pipe of a child process.
std::string pack_figures(const ReachFigures& f);
ReachFigures unpack_figures(const std::string& bytes);

}  // namespace sparflow::bench
