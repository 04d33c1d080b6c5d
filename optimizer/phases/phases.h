#pragma once
/// A motion as a sequence of phases. Within a phase the set of moving cylinders and their directions are fixed, so the
/// law contains no activation that the optimiser could exploit; its duration is a variable of the problem (PhaseTimes of
/// the transcription). Between two phases an overlap may be inserted; if it saves nothing, its duration shrinks to zero
/// and it is dropped.
#include <string>
#include <vector>

#include "models/machine/trajectory.h"
#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

struct PhasePlan {
  ModeTable modes;            ///< [phases x cylinders]
  Eigen::VectorXd durations;  ///< [s]
  std::vector<int>
      waypoint_after;  ///< by waypoint of the problem: the phase at whose end it is passed
  int count() const { return static_cast<int>(modes.rows()); }
  double total() const { return durations.sum(); }
};

/// Joins consecutive intervals with equal modes into phases.
/// @param waypoint_times instants at which a phase ends too [s]
PhasePlan plan_of(const ModeTable& modes, const Eigen::VectorXd& times,
                  const std::vector<double>& waypoint_times = {});

/// Inserts between each two phases one in which the cylinders of both move, unless a cylinder would have to move in both
/// directions. The overlap takes `share` of the shorter neighbour's duration, half from each side.
PhasePlan with_overlaps(const PhasePlan& plan, double share);

/// The same with a phase before the first and after the last one where the cylinders that must move at the start and at the
/// end do so, and no others, unless the first and the last phase already have them.
/// @param first, last [cylinders] modes of the cylinders that move there, kRest of the others
/// @param shortest duration of an added phase [s]
PhasePlan with_moving_ends(const PhasePlan& plan, const std::vector<CylinderMode>& first,
                           const std::vector<CylinderMode>& last, double shortest);

/// Removes phases shorter than `shortest` [s], whose durations go to their neighbours, and joins equal neighbours.
PhasePlan without_short(const PhasePlan& plan, double shortest);

/// Neighbours of a plan, for a local search over mode sequences: one phase is left out, two adjacent phases are exchanged
/// or merged, or a cylinder starts or stops one phase earlier or later. In addition the longest phase in which several
/// cylinders move is halved, with one of them at rest in either half; a plan of a single phase has no other neighbour. In
/// every neighbour the same cylinders move in the same directions as in `plan`. A plan with waypoints has no neighbours.
std::vector<PhasePlan> neighbours(const PhasePlan& plan);

/// Moving cylinders and their directions by phase, for example "boom + | boom +, jib - | jib -".
std::string plan_text(const Machine& machine, const PhasePlan& plan);

/// A mesh that has a knot at each change of phase.
struct PhaseMesh {
  Eigen::VectorXd times;         ///< [s] knots
  std::vector<int> of_interval;  ///< phase of every interval
  ModeTable modes;               ///< [intervals x cylinders]
  std::vector<int> waypoint_knots;
};

/// @param intervals total number wanted, distributed in proportion to the phases' durations
/// @param least smallest number of intervals of a phase
PhaseMesh mesh_of(const PhasePlan& plan, int intervals, int least);

/// The phases' durations in a motion on that mesh.
Eigen::VectorXd durations_of(const PhaseMesh& mesh, const Eigen::VectorXd& times);

/// The motion with its i-th section, from[i] [s] long, stretched or compressed in time to to[i] [s].
Trajectory with_durations(const Trajectory& motion, const Eigen::VectorXd& from,
                          const Eigen::VectorXd& to);

}  // namespace sparflow
