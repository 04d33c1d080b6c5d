#pragma once
/// Energy of a motion and its limits under the exact law, evaluated between the knots as well. All energies and
/// violations that the program reports come from here.
#include <string>
#include <vector>

#include "models/chain/crane_model.h"
#include "models/machine/trajectory.h"
#include "problems/motion_limits.h"
#include "problems/problem.h"

namespace sparflow {

struct MotionEnergy {
  double total = 0.0;                 ///< [J] integral of the pumps' power, idle power not included
  std::vector<double> pump;           ///< [J] by pump
  std::vector<double> throttling;     ///< [J] by cylinder, integral of (p_pump - P_i) Q_i
  std::vector<double> useful;         ///< [J] by cylinder, integral of P_i Q_i
  double potential_difference = 0.0;  ///< [J] of machine and payload, end minus start
  double largest_pressure_std = 0.0;  ///< [Pa] largest standard deviation of a predicted pressure
  /// [J] integral of the pumps' flows times the standard deviation of the pressure that leads each of them (constant-pressure
  /// pumps: none): the energy's standard deviation if the errors of a pressure model are the same everywhere, the worst case.
  double pressure_uncertainty = 0.0;
  double moving_share_outside_data =
      0.0;  ///< share of moving cylinder-time outside the data of its pressure model
  std::vector<double> share_moving;  ///< share of time with 0, 1, 2, ... cylinders moving
  std::vector<double> creep;  ///< [m] by cylinder, way of its rod at flows below its valve's least

  /// True when the pumps deliver less than machine and load gain: the pressures are extrapolated far beyond their data.
  bool impossible() const { return total < potential_difference; }
};

/// Integrates the exact law over a motion by the midpoint rule on every interval cut into `refine` parts. Velocities are
/// linear within an interval, so a cylinder starts or stops at knots only (a change of sign aside), and no midpoint falls
/// on such an instant. The jumps of the exact maximum and activation therefore cost no accuracy.
/// @param least flows below which a cylinder counts as standing in share_moving, in the share outside the data and in the
///        largest standard deviation; empty: none stands before it rests. The energies count every flow and every demand:
///        the motion needs them to arrive, and a least flow can thus never make a motion cheaper.
MotionEnergy exact_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine = 16, const LeastFlows& least = {});
/// The same with the problem's payload and its valves' least flows; of a cycle the sum over its legs, each with its payload.
MotionEnergy exact_energy(const CraneModel& model, const MotionProblem& problem,
                          const Trajectory& motion, int refine = 16);

/// MotionEnergy::total alone, in less than half the time: standard deviations and shares are not computed. [J]
double exact_total_energy(const CraneModel& model, const Trajectory& motion, double payload,
                          int refine = 16);

/// The same with the problem's payload, of a cycle the sum over its legs.
double exact_total_energy(const CraneModel& model, const MotionProblem& problem,
                          const Trajectory& motion, int refine = 16);

/// A leg of a cycle as driven.
struct CycleLeg {
  std::string to;        ///< name of the stop in which it ends
  double payload = 0.0;  ///< [kg]
  double begin = 0.0;    ///< [s] when the machine leaves the stop before
  double end = 0.0;      ///< [s] when it arrives
  Trajectory motion;     ///< of the leg alone, in the cycle's time
};
/// The legs of a motion with stops; one leg where the problem has none.
std::vector<CycleLeg> legs_of(const MotionProblem& problem, const Trajectory& motion);

/// Integral over a motion of the sum of the squared valve commands (1 = full flow). [s]
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

/// Whether this is a condition that every motion meets at equality (rest, start, goal, stops), so that its being touched is
/// no news.
bool is_end_condition(const LimitCheck& check);

/// Worst instant of every limit, most violated first: joint position, velocity and acceleration, valves, pump
/// flow and pressure, clearance, tip line, start and goal, evaluated at `refine` samples per mesh interval.
/// @param model without pressure models the pressures are not checked
std::vector<LimitCheck> check_limits(const CraneModel& model, const MotionProblem& problem,
                                     const Trajectory& motion, int refine = 16);

/// Largest jump of every joint's posture and speed between the end of one interval and the begin of the next, most violated first. The
/// motions of a solve have none. One that was sampled at other instants than its own jumps where its acceleration has changed in
/// between, and a jump costs no energy. Of a recording they say only how its speeds were computed.
std::vector<LimitCheck> check_jumps(const MotionProblem& problem, const Trajectory& motion);

/// Whether a duration [s] is one that the problem allows.
LimitCheck check_duration(const MotionProblem& problem, double duration);

/// Largest relative excess, 0 when every limit is kept.
double worst_excess(const std::vector<LimitCheck>& checks);

}  // namespace sparflow
