#pragma once
/// Baseline: the tip drives the straight line from its start to its goal in a given time law, and dynamic
/// programming chooses the redundant joint for least energy. Nurmi and Mattila (2017), Global energy-optimal
/// redundancy resolution of hydraulic manipulators: experimental results for a forestry manipulator, Energies
/// 10(5):647.
///
///   minimise  sum_k h * P(m_k, v_k),  m_k = (c_k-1 + c_k) / 2,  v_k = (c_k - c_k-1) / h
///   over c_k with tip(c_k) = start + s(t_k) (goal - start),
///
/// P the exact law's power of all pumps (largest demand times the sum of flows, standby included), within limits of
/// position, speed, valve and pump flow, pump pressure and acceleration (c_k+1 - 2 c_k + c_k-1) / h^2. The state
/// is the pair (c_k-1, c_k), so that accelerations are seen. The c_k are the control points of a uniform quadratic
/// B-spline, whose positions and speeds at the knots are m_k and v_k and whose accelerations are these.
#include <string>
#include <vector>

#include "optimizer/crane/exact_energy.h"

namespace sparflow {

struct PathRedundancyOptions {
  int intervals = 100;  ///< of the motion
  /// Trapezoidal speeds tried: the tip's top speed from 1.12 to 2 times its mean, in equal steps; >= 1.
  int speed_levels = 2;
  double energy_change = 5e-3;  ///< relative, between two grids, at which refining ends
  int most_grids = 6;
  double limit_tolerance = 1e-5;
  int refine = 16;  ///< instants an interval at which limits are looked at
};

struct PathRedundancy {
  Trajectory motion;  ///< rest to rest, keeps all limits; empty when there is none
  std::string why;    ///< why there is no motion
  MotionEnergy energy;
  double summed_J = 0.0;  ///< what dynamic programming made of the same motion [J], 0 without grids
  double top_speed = 0.0;  ///< of the tip, over its mean; 0 = the law of the line handed in
  int grids = 0;           ///< refined one after the other; 0 = the line handed in is returned
  double excess = 0.0;     ///< largest relative excess of a limit (worst_excess())
  bool found() const { return motion.size() > 1; }
};

/// Why a problem has no such motion whatever the duration: no tip goal, or not exactly one redundant joint. Empty = it
/// may have one.
std::string path_redundancy_refusal(const MotionProblem& problem);

/// @param duration [s]
/// @param line a motion of the same task along the same line, or empty: its time law is tried too and its postures are
///        among the choices, and if it keeps the limits the result is not dearer
/// @throws std::domain_error when a four-bar cannot close within the limits of position
PathRedundancy best_redundancy_line(const CraneModel& model, const MotionProblem& problem,
                                    double duration, const Trajectory& line,
                                    const PathRedundancyOptions& options = {});

}  // namespace sparflow
