#pragma once
/// Plans a motion anew while the machine moves: from where it is and as fast as it is to the same goal, in the time left.
/// The modes (which cylinder moves when) are those of what is left of the motion that is followed; only their course changes,
/// so that one solve of the smooth law suffices.
#include <optional>

#include "models/chain/crane_model.h"
#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

struct ReplanOptions {
  /// Mesh intervals of the motion that is left.
  /// @threshold [1] 8..500; chosen: a plan must be there within a second
  int intervals = 40;
  /// Smoothing beta, as OptimizeOptions::pressure_in_modes.
  /// @threshold [Pa] 1e3..1e6; chosen: 0.3 bar is below what pressure models know
  double pressure = 0.3e5;
  /// Relative tolerance of the solve.
  /// @threshold [1] 1e-8..1e-2; chosen: sensors tell the state no better
  double tolerance = 1e-4;
  /// Iteration limit.
  /// @threshold [iterations] 10..1000; chosen: ends a solve that creeps; the motion followed so far is kept then
  int iterations = 80;
  /// Wall time.
  /// @threshold [s] 0.01..100; chosen: a plan must be there within a few seconds
  double seconds = 3.0;
};

/// A machine that follows a motion.
struct Underway {
  const Trajectory* motion = nullptr;  ///< that is followed, whose goal is kept; not owned
  double t = 0.0;                      ///< [s] since it began
  Eigen::VectorXd q, qd;               ///< where the machine is, and its rates [rad] or [m]
};

/// @return nothing when the solve does not converge or its motion breaks a limit
std::optional<Trajectory> replan(const CraneModel& model, const MotionProblem& problem,
                                 const Underway& now, const ReplanOptions& options = {});

}  // namespace sparflow
