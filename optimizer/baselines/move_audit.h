#pragma once
/// A recorded move beside the energy-optimal motion from the same start to the same end in the same time with the same
/// payload: what it could have saved, and where the difference arises.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "models/hydraulics/engine_map.h"
#include "optimizer/solve/optimize.h"

namespace sparflow {

struct MoveAuditOptions {
  OptimizeOptions optimize;
  /// Seed paths of a problem, as plain data.
  std::function<std::vector<SeedMotion>(const MotionProblem&)> seeds;
  /// Narrows the limits of a move's problem, to those that valves can follow, say; empty: they stay. They bind the optimum and
  /// not the recorded motion.
  std::function<void(const Trajectory& recorded, MotionLimits& limits)> narrow;
  /// Largest share of a move's moving time outside the flows and forces of the pressure models' data.
  /// @threshold [1] 0..1; chosen: three quarters of a move must rest on what was learned
  double most_outside = 0.25;
  /// Rows of the recorded path that is driven again at an even pace, at most.
  /// @threshold [rows] 10..1000; chosen: a second of a long move, and corners of a path are kept
  int path_rows = 40;
  /// Relative overshoot of a limit with which a recorded motion keeps it.
  /// @threshold [1] 0..0.1; chosen: what smoothing and rounding of a log leave open
  double limit_tolerance = 0.01;
  /// Share of the recorded motion's energy by which the optimum may be dearer where the recorded motion breaks a limit. A
  /// larger share leaves the move without a judgement.
  /// @threshold [1] 0..0.1; chosen: the mesh of the optimum and the rows of the log leave so much open
  double as_cheap = 0.01;
};

struct MoveAudit {
  /// From the recorded start to the recorded posture at the end, of fixed duration.
  MotionProblem problem;
  Trajectory best;         ///< energy-optimal motion; empty where there is none
  MotionEnergy recorded;   ///< of the recorded motion, by the model
  MotionEnergy optimum;    ///< of `best`
  std::string not_judged;  ///< a sentence; empty: the move is judged
  bool interrupted = false;
  /// Parts of the saving that add up to it [J]: pace along the recorded path (driven at an even pace instead), and way and
  /// overlap of the cylinders.
  double by_pace = 0.0, by_way = 0.0;
  /// What another posture at the end with the tip at the same place saves besides [J], and how much less potential energy
  /// that posture has [J], which the next move lacks; 0 for a machine without redundant joints.
  double by_posture = 0.0, by_posture_potential = 0.0;

  bool judged() const { return not_judged.empty(); }
  /// Energy of the recorded motion by the model, less the optimum's. [J]
  double saving() const { return recorded.total - optimum.total; }
  /// [J] of the saving, from the pressure models' standard deviations, each the same along a whole motion and independent
  /// between the two motions; an error that both share makes it smaller.
  double saving_std() const;
};

/// The problem of a move to its recorded posture: the machine's limits, widened to what the recorded motion did.
MotionProblem audit_problem(const Machine& machine, const Trajectory& recorded, double payload);

/// What the model's pumps give along a motion, at its rows.
PumpTrace pumps_along(const CraneModel& model, const Trajectory& motion, double payload);

/// @param recorded from rest to rest, at least two rows  @param payload [kg]
MoveAudit audit_move(const CraneModel& model, const Trajectory& recorded, double payload,
                     const MoveAuditOptions& options);

}  // namespace sparflow
