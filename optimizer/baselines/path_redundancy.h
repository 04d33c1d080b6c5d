#pragma once
/// Baseline: the tip follows the straight line from its start to its goal with a given time law, and dynamic
/// programming chooses the redundant joint for least energy. Nurmi and Mattila (2017), Global energy-optimal
/// redundancy resolution of hydraulic manipulators: experimental results for a forestry manipulator, Energies
/// 10(5):647.
///
///   minimise  sum_k h * P(m_k, v_k),  m_k = (c_k-1 + c_k) / 2,  v_k = (c_k - c_k-1) / h
///   over c_k with tip(c_k) = start + s(t_k) (goal - start),
///
/// where P is the exact law's power of all pumps (largest demand times the sum of flows, at least standby), within limits of
/// position, speed, valve and pump flow, pump pressure and acceleration (c_k+1 - 2 c_k + c_k-1) / h^2. The state
/// is the pair (c_k-1, c_k), so that accelerations can be limited. The c_k are the control points of a uniform quadratic
/// B-spline, whose positions and speeds at the knots are m_k and v_k and whose accelerations are these.
#include <string>
#include <vector>

#include "optimizer/crane/exact_energy.h"

namespace sparflow {

struct PathRedundancyOptions {
  /// Of the motion.
  /// @threshold [intervals] 10..1000; chosen: the mesh error is then below a thousandth of the energy, as the optimum's
  int intervals = 100;
  /// Number of trapezoidal time laws tried, >= 1: the tip's top speed from 1.12 to 2 times its mean, in equal steps.
  /// @threshold [1] 1..20; chosen: the ends of the range of usual trapezoids; each further level between them takes a
  /// whole dynamic programme
  int speed_levels = 2;
  /// Relative change of the energy between two grids below which refinement ends.
  /// @threshold [1] 1e-6..0.5; chosen: far below what separates strategies
  double energy_change = 5e-3;
  /// Largest number of grids.
  /// @threshold [1] 1..20; chosen: each takes several times as long as the one before
  int most_grids = 6;
  /// Relative overshoot that still counts as kept.
  /// @threshold [1] 0..1e-2; chosen: rounding of a solve with Ipopt's tolerance
  double limit_tolerance = 1e-5;
  /// Samples per mesh interval at which limits are checked.
  /// @threshold [1] 1..100; chosen: as OptimizeOptions::refine
  int refine = 16;
};

struct PathRedundancy {
  Trajectory motion;  ///< rest to rest, keeps all limits; empty when there is none
  std::string why;    ///< why there is no motion
  MotionEnergy energy;
  double summed_J =
      0.0;  ///< energy of the same motion as summed by dynamic programming [J], 0 without grids
  double top_speed = 0.0;  ///< of the tip, over its mean; 0 = the time law of `line`
  int grids = 0;           ///< number of grids used; 0 = `line` is returned
  double excess = 0.0;     ///< largest relative excess of a limit (worst_excess())
  bool found() const { return motion.size() > 1; }
};

/// Why a problem has no such motion at any duration: no tip goal, or not exactly one redundant joint. Empty = it
/// may have one.
std::string path_redundancy_refusal(const MotionProblem& problem);

/// @param duration [s]
/// The motion of least energy along the tip line, by dynamic programming on refined grids.
/// @param line a motion along the same line, or empty: its time law is tried too, its postures are among the candidates,
///        and if it keeps the limits the result does not cost more
/// @throws std::domain_error when a four-bar cannot close within the limits of position
PathRedundancy best_redundancy_line(const CraneModel& model, const MotionProblem& problem,
                                    double duration, const Trajectory& line,
                                    const PathRedundancyOptions& options = {});

}  // namespace sparflow
