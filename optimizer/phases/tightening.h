#pragma once
/// What a start does about limits that are kept at the knots and broken between them: drawing them in, or more knots.
#include <vector>

#include "optimizer/crane/exact_energy.h"
#include "optimizer/phases/phases.h"
#include "problems/problem.h"

namespace sparflow {

/// How far limits are drawn in so that they also hold between knots.
struct Tightening {
  double flow = 1.0, valve = 1.0, pressure = 1.0, line = 1.0, trust = 1.0;  ///< shares [-]
  double clearance = 0.0;                                                   ///< [m]
  std::vector<double> position;  ///< [rad] or [m] by joint
  bool limit_pressure = false;   ///< rows for the pumps' pressures are wanted

  /// Draws in what is broken. @param tolerance relative overshoot that counts as kept
  /// @return false when all limits are kept
  bool draw_in(const MotionProblem& problem, const std::vector<LimitCheck>& checks,
               double tolerance);
};

/// Between far knots a link can cut a corner of an obstacle; drawing in the clearance by as much would close narrow
/// ways. Such intervals are cut in four instead.
/// @param motion on the mesh  @param parts looked at in an interval  @param most intervals a mesh may have before it is cut
/// @return false when none is deep enough, or the mesh is full or has no phases
bool split_where_it_touches(const MotionProblem& problem, const Trajectory& motion, int parts,
                            int most, PhaseMesh& mesh);

}  // namespace sparflow
