#pragma once
/// Random reaches beside obstacles: windows, walls, shelves and boxes at the tip on three machines, solved with the
/// defaults of `sparflow optimize` and judged by a clearance test of their own.
#include <string>
#include <vector>

#include "studies/reach_tasks.h"

namespace sparflow::bench {

/// Draws reaches `seed` .. `seed + count - 1`. Start and end posture are clear of the obstacle with some room; whether a path
/// leads from one to the other is not known.
std::vector<ReachTask> obstacle_tasks(int count, std::uint64_t seed, ModelCache& models);

struct ObstacleFigures {
  std::string status;    ///< of the optimisation
  std::string message;   ///< of it, or why there is no result
  std::string start;     ///< seed of the result
  bool planned = false;  ///< whether the planner found a path
  bool in_time =
      false;  ///< whether a path of planner or grid is known that can be driven in the duration
  bool crashed = false;
  double energy = 0.0;           ///< [J] by the exact law
  bool compared = false;         ///< whether it was also solved from paths of the grid alone
  double without_planner = 0.0;  ///< [J] the same from those; 0 = none
  double mesh_error = 0.0;
  int knots = 0;
  double clearance =
      0.0;  ///< [m] least distance from the obstacles, less the one required, by point_clearance()
  double seconds = 0.0;  ///< processor time
  bool solved() const { return status == "optimal" || status == "feasible"; }
};

/// Least distance of the machine's axes from the boxes of a problem over a motion, less the clearance required [m]: points on
/// every axis, 1 cm apart, at `instants` equally distant times, each against every box by clamping its coordinates. It
/// shares no code with problems/clearance.
double point_clearance(const MotionProblem& problem, const Trajectory& motion, int instants);

/// @param compare_planner also without the planner's paths
ObstacleFigures solve_beside_obstacles(const ReachTask& task, int paths, bool compare_planner);

std::string pack_obstacle_figures(const ObstacleFigures& f);
ObstacleFigures unpack_obstacle_figures(const std::string& bytes);

void print_obstacle_reach(const ReachTask& task, const ObstacleFigures& f);
void print_obstacle_summary(const std::vector<ReachTask>& tasks,
                            const std::vector<ObstacleFigures>& figures);

}  // namespace sparflow::bench
