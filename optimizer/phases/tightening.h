#pragma once
/// Treatment of limits that hold at the knots and are violated between them: bound tightening, or more knots.
#include <vector>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/phases/phases.h"
#include "problems/problem.h"

namespace sparflow {

/// Bound tightening: limits narrowed at the knots, so that they also hold between them.
struct Tightening {
  double flow = 1.0, valve = 1.0, pressure = 1.0, line = 1.0,
         trust = 1.0;  ///< shares of the limits [-]
  double sway = 1.0,
         still = 1.0;      ///< shares of the sway's limit, and of that at the end and at stops [-]
  double clearance = 0.0;  ///< added to the required clearance [m]
  std::vector<double> position;  ///< narrowing of the position range, by joint [rad] or [m]
  bool limit_pressure = false;   ///< whether the NLP has rows for the pumps' pressures

  /// Tightens every limit that is violated. @param tolerance relative overshoot that still counts as kept
  /// @return false when no limit is violated
  bool tighten_bounds(const MotionProblem& problem, const std::vector<LimitCheck>& checks,
                      double tolerance);
};

/// Splits intervals in four in which a link cuts a corner of an obstacle; tightening the clearance by that depth instead
/// would close narrow passages.
/// @param motion on the mesh  @param parts instants checked in an interval  @param most intervals above which a mesh is
/// not split
/// @return false when no interval is split: no violation is deep enough, or the mesh has too many intervals or no phases
bool split_where_it_touches(const MotionProblem& problem, const Trajectory& motion, int parts,
                            int most, PhaseMesh& mesh);

}  // namespace sparflow
