#pragma once
/// Energy against time: the energy-optimal motion at many durations, each warm started from its neighbours, beside the
/// best sequential and the best simultaneous motion.
#include <functional>
#include <vector>

#include "optimizer/baselines/strategies.h"

namespace sparflow {

struct ParetoPoint {
  double duration = 0.0;      ///< [s]
  StrategyOutcome optimal;    ///< not found below the shortest time
  double sequential = 0.0;    ///< [J] best one-by-one motion in this time; NaN = none
  double simultaneous = 0.0;  ///< [J] cheapest straight joint line in this time; NaN = none
};

/// The duration that is best when the engine burns this much meanwhile.
struct IdleChoice {
  double idle_power = 0.0;  ///< [W]
  double duration = 0.0;    ///< [s]
  double energy = 0.0;      ///< [J] of the pump
  bool at_end = false;      ///< the curve ends there: a longer time may be better
};

struct ParetoCurve {
  std::vector<ParetoPoint> points;  ///< by duration; only those with a motion
  double shortest = 0.0;            ///< [s] of the fastest motion found
  double sequential_limit = 0.0;  ///< [J] the best one-by-one motion driven very slowly, NaN = none
  double simultaneous_limit = 0.0;  ///< [J] the cheapest straight joint line driven very slowly
  double grid_limit = 0.0;          ///< [J] cheapest path of the joint-space grid, unlimited time
  std::vector<IdleChoice> idle;
  std::string message;  ///< why there is no point
};

struct ParetoOptions {
  int points = 14;
  double longest = 6.0;                                           ///< of the shortest time
  std::vector<double> idle_powers = {1e3, 2e3, 5e3, 10e3, 15e3};  ///< [W]
  int grid_nodes = 20000;  ///< of the grid for the limit at unlimited time; 0 = not asked
  StrategyOptions strategies;
  std::function<bool(double, const std::string&)> progress;  ///< share done, what; false interrupts
};

/// The fastest motion, then from long times to short ones, each optimum starting the next, then once back: what a
/// shorter time found, driven slower, must not be cheaper than what the longer one has.
ParetoCurve energy_against_time(const CraneModel& model, const MotionProblem& problem,
                                const std::vector<SeedMotion>& seeds, const ParetoOptions& options);

/// For each idle power the point with the least energy + idle power x time.
std::vector<IdleChoice> idle_choices(const std::vector<ParetoPoint>& points,
                                     const std::vector<double>& idle_powers);

}  // namespace sparflow
