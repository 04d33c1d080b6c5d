#pragma once
/// What dynamic programming on a joint grid alone comes to: its cheapest paths driven as they are, no solver after them.
/// Whatever may be done, no more than this is needed – a bound from above beside energy_bound.h's from below.
#include <string>

#include "optimizer/grid/energy_grid.h"

namespace sparflow {

struct DrivenGridPath {
  double energy = 0.0;       ///< [J] exact law, in the time asked for; 0 = no path keeps all limits
  double slow_energy = 0.0;  ///< [J] quasi-static, of the cheapest path at unlimited time; 0 = none
  std::string message;       ///< why there is no `energy`
};

/// Limits along a path that no solver has seen count as kept up to this relative overshoot.
inline constexpr double kGridTolerance = 1e-3;

/// @param duration [s] of the motion whose energy is asked for
DrivenGridPath driven_grid_path(const CraneModel& model, const MotionProblem& problem,
                                double duration, const EnergyGridOptions& options = {});

}  // namespace sparflow
