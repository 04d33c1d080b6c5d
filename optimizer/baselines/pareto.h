#pragma once
/// Energy against time: the energy-optimal motion at many durations, each started from its neighbours, with the best
/// sequential and the best simultaneous motion.
#include <functional>
#include <vector>

#include "optimizer/baselines/strategies.h"

namespace sparflow {

struct ParetoPoint {
  double duration = 0.0;      ///< [s]
  StrategyOutcome optimal;    ///< not found below the shortest time
  double sequential = 0.0;    ///< [J] best sequential motion in this duration; NaN = none
  double simultaneous = 0.0;  ///< [J] cheapest straight joint line in this duration; NaN = none
};

/// The best duration at an idle power.
struct IdleChoice {
  double idle_power = 0.0;  ///< [W]
  double duration = 0.0;    ///< [s]
  double energy = 0.0;      ///< [J] of the pump
  bool at_end = false;      ///< true at the curve's longest duration: a longer one may be better
};

struct ParetoCurve {
  std::vector<ParetoPoint> points;  ///< by increasing duration; only those with a motion
  double shortest = 0.0;            ///< [s] of the fastest motion found
  double sequential_limit = 0.0;  ///< [J] the best sequential motion driven very slowly, NaN = none
  double simultaneous_limit = 0.0;  ///< [J] the cheapest straight joint line driven very slowly
  double grid_limit = 0.0;          ///< [J] cheapest path of the joint grid, unlimited time
  std::vector<IdleChoice> idle;
  std::string message;       ///< why there is no point
  bool interrupted = false;  ///< durations are missing, and the energies of some could still fall
};

struct ParetoOptions {
  /// Number of durations.
  /// @threshold [1] 2..1000; chosen: enough for a smooth curve
  int points = 14;
  /// Largest duration, in units of the shortest.
  /// @threshold [1] 1..100; chosen: beyond it the flow losses hardly change
  double longest = 6.0;
  std::vector<double> idle_powers = {1e3, 2e3, 5e3, 10e3, 15e3};  ///< [W]
  /// Nodes of the joint grid for grid_limit; 0 = not computed.
  /// @threshold [nodes] 0..1e7; chosen: half of EnergyGridOptions::nodes, as one path is wanted only
  int grid_nodes = 20000;
  StrategyOptions strategies;
  /// Called after each start of a solve and after each duration, with the share done, which never falls, and what was solved;
  /// false interrupts.
  std::function<bool(double, const std::string&)> progress;
};

/// Solves for the fastest motion, then from long to short durations, each optimum starting the next, then once back, so
/// that no optimum costs more than that of a shorter duration driven slower.
ParetoCurve energy_against_time(const CraneModel& model, const MotionProblem& problem,
                                const std::vector<SeedMotion>& seeds, const ParetoOptions& options);

/// For each idle power [W] the point with the least energy + idle power x time.
std::vector<IdleChoice> idle_choices(const std::vector<ParetoPoint>& points,
                                     const std::vector<double>& idle_powers);

}  // namespace sparflow
