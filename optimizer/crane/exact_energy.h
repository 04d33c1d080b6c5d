#pragma once
/// What a motion costs and whether it keeps its limits under the exact law, looked at between the knots as
/// well: the only source of the energies and violations the program reports.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/machine/trajectory.h"
#include "problems/problem.h"

namespace sparflow {

struct MotionEnergy {
  double total = 0.0;                 ///< [J] integral of the pumps' power, idle power not included
  std::vector<double> pump;           ///< [J] by pump
  std::vector<double> throttling;     ///< [J] by cylinder, integral of (p_pump - P_i) Q_i
  std::vector<double> useful;         ///< [J] by cylinder, integral of P_i Q_i
  double potential_difference = 0.0;  ///< [J] of machine and payload, end minus start
  double largest_pressure_std = 0.0;  ///< [Pa] least certain prediction on the way
  double moving_share_outside_data =
      0.0;  ///< share of moving cylinder-time outside its process' data box
  std::vector<double> share_moving;  ///< share of time with 0, 1, 2, ... cylinders moving

  /// The pumps give less than machine and load gain: pressures extrapolated far from what they were learned at.
  bool impossible() const { return total < potential_difference; }
};

/// Integrates the exact law over a motion: midpoint rule on every interval cut into `refine` parts. Whether
/// a cylinder moves cannot change within a part (velocities are linear in between, a sign change aside),
/// and a midpoint never falls on the instant at which it starts, so the jumps of the exact maximum and
/// activation at knots cost no accuracy.
MotionEnergy exact_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine = 16);

/// `total` of exact_energy() alone, at less than half its price: no standard deviations of pressures, no shares. [J]
double exact_total_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine = 16);

/// Integral of the squared commands of all valves (1 = full flow) over a motion. [s]
double command_effort(const CraneModel& model, const MotionProblem& problem,
                      const Trajectory& motion, int refine = 16);

/// The problem's objective under the exact law: energy * (E + idle power * T) + time * T + commands * effort. [J]
double exact_cost(const CraneModel& model, const MotionProblem& problem, const Trajectory& motion,
                  double energy, int refine = 16);

/// One limit at its worst instant.
struct LimitCheck {
  std::string what;    ///< "flow of pump main"
  double value = 0.0;  ///< in `unit`
  double limit = 0.0;  ///< in `unit`
  std::string unit;    ///< l/min, bar, m, rad, ...
  double time = 0.0;   ///< [s]
  double excess =
      0.0;  ///< relative overshoot: (value - limit) / scale of the limit; <= 0 when kept
};

/// Every limit at its worst, most violated first: joint position, velocity and acceleration, valves, pump
/// flow and pressure, clearance, tip line, start and goal; on `refine` times the knots' density.
/// @param model may be untrained: pressures are then not checked
std::vector<LimitCheck> check_limits(const CraneModel& model, const MotionProblem& problem,
                                     const Trajectory& motion, int refine = 16);

/// Largest relative excess, 0 when every limit is kept.
double worst_excess(const std::vector<LimitCheck>& checks);

}  // namespace sparflow
