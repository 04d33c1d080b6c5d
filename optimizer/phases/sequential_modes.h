#pragma once
/// Sequential motions in every order, and with every set of joints left at rest with which the goal can be reached. Above
/// its shortest time the best sequential motion is close to the optimum (max_i(d_i) sum Q_i >= sum d_i Q_i), so these
/// motions are starts of their own beside the planner's paths.
#include <string>
#include <vector>

#include "optimizer/phases/motion_modes.h"

namespace sparflow {

struct ModeCandidate {
  std::string name;     ///< "sequential: jib, extension"
  ModeTable modes;      ///< [intervals x cylinders]
  Trajectory guess;     ///< a motion with these modes on the same mesh
  double energy = 0.0;  ///< [J] of the initial guess by the exact law
};

/// @param times the mesh [s]
/// @param end_postures goal configurations from which the search for others begins
/// @param most number of candidates to return; those with the cheapest guesses are kept
std::vector<ModeCandidate> sequential_candidates(const CraneModel& model,
                                                 const MotionProblem& problem,
                                                 const Eigen::VectorXd& times,
                                                 const std::vector<Eigen::VectorXd>& end_postures,
                                                 int most);

/// Moves the `free` joints of `q` until its tip is at `goal`, by damped Newton steps within the limits.
/// @return false when Newton's method finds no such configuration near `q`
bool solve_end_posture(const Machine& machine, const MotionLimits& limits,
                       const Eigen::Vector3d& goal, const std::vector<bool>& free,
                       Eigen::VectorXd& q);

}  // namespace sparflow
