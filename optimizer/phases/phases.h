#pragma once
/// A motion as a sequence of phases: within one, the set of cylinders that move and their directions are fixed, so the
/// law has no activation to exploit; how long each lasts is a variable of the problem (Transcription's PhaseTimes).
/// Between two phases an overlap may be offered: if it does not pay, its duration shrinks to nothing and it is dropped.
#include <string>
#include <vector>

#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

struct PhasePlan {
  ModeTable modes;            ///< [phases x cylinders]
  Eigen::VectorXd durations;  ///< [s]
  std::vector<int>
      waypoint_after;  ///< phase at whose end each of the problem's waypoints is passed
  int count() const { return static_cast<int>(modes.rows()); }
  double total() const { return durations.sum(); }
};

/// The intervals of a mesh that share their modes, as phases.
/// @param waypoint_times [s] a phase ends there too
PhasePlan plan_of(const ModeTable& modes, const Eigen::VectorXd& times,
                  const std::vector<double>& waypoint_times = {});

/// Between each two phases one in which the cylinders of both move, where no cylinder would have to move both ways; it
/// takes `share` of the shorter neighbour's time, half from each side.
PhasePlan with_overlaps(const PhasePlan& plan, double share);

/// Without phases shorter than `shortest` [s] (their time goes to the neighbours) and with equal neighbours joined.
PhasePlan without_short(const PhasePlan& plan, double shortest);

/// Neighbours of a plan, for a search over mode sequences: every phase left out, every two neighbours exchanged or made
/// one, every cylinder that moves in a phase begun or ended one phase earlier or later; the longest phase in which several
/// move cut in two, one of them at rest in either half (all together has no other neighbour). Every cylinder that moves in
/// `plan` moves in each of them too, the same number of directions. None for a plan with waypoints.
std::vector<PhasePlan> neighbours(const PhasePlan& plan);

/// "boom + | boom +, jib - | jib -": what moves, phase by phase.
std::string plan_text(const Machine& machine, const PhasePlan& plan);

/// A mesh that has a knot at each change of phase.
struct PhaseMesh {
  Eigen::VectorXd times;         ///< [s] knots
  std::vector<int> of_interval;  ///< phase of every interval
  ModeTable modes;               ///< [intervals x cylinders]
  std::vector<int> waypoint_knots;
};

/// @param intervals wanted in all, shared out by duration
/// @param least intervals of a phase
PhaseMesh mesh_of(const PhasePlan& plan, int intervals, int least);

/// The phases' durations in a motion on that mesh.
Eigen::VectorXd durations_of(const PhaseMesh& mesh, const Eigen::VectorXd& times);

/// A motion driven so that its i-th stretch (of `from`'s durations) takes `to`'s i-th duration.
Trajectory with_durations(const Trajectory& motion, const Eigen::VectorXd& from,
                          const Eigen::VectorXd& to);

}  // namespace sparflow
