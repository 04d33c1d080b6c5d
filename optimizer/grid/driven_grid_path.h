#pragma once
/// Energies of dynamic programming on a joint grid alone: its cheapest paths are driven without an NLP solve after them.
/// They are upper bounds of the least energy, beside the estimated lower bounds of energy_bound.h.
#include <string>

#include "optimizer/grid/energy_grid.h"

namespace sparflow {

struct DrivenGridPath {
  double energy = 0.0;  ///< [J] exact law, in the duration asked for; 0 = no path keeps all limits
  double slow_energy = 0.0;  ///< [J] quasi-static, of the cheapest path at unlimited time; 0 = none
  std::string message;       ///< why there is no `energy`
};

/// Relative overshoot up to which a limit counts as kept on a path that was not optimised.
/// @threshold [1] 0..0.1; chosen: a path between nodes is no finished motion, so more is granted than
/// OptimizeOptions::limit_tolerance
inline constexpr double kGridTolerance = 1e-3;

/// @param duration [s] of the motion whose energy is wanted
DrivenGridPath driven_grid_path(const CraneModel& model, const MotionProblem& problem,
                                double duration, const EnergyGridOptions& options = {});

}  // namespace sparflow
