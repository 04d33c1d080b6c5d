#pragma once
/// One cylinder after another: every order, and with every set of joints left at rest that still reaches the
/// goal. Above the shortest time such a motion needs it is close to the best there is
/// (max_i(d_i) sum Q_i >= sum d_i Q_i), so these are starts of their own beside the planner's paths.
#include <string>
#include <vector>

#include "optimizer/phases/motion_modes.h"

namespace sparflow {

struct ModeCandidate {
  std::string name;  ///< "one by one: jib, extension"
  ModeTable modes;
  Trajectory guess;     ///< a motion with these modes on the same mesh
  double energy = 0.0;  ///< [J] of the guess under the exact law
};

/// @param times the mesh [s]
/// @param end_postures postures at the goal to begin the search for end postures from
/// @param most candidates to return, the cheapest guesses
std::vector<ModeCandidate> sequential_candidates(const CraneModel& model,
                                                 const MotionProblem& problem,
                                                 const Eigen::VectorXd& times,
                                                 const std::vector<Eigen::VectorXd>& end_postures,
                                                 int most);

/// Posture with the tip at `goal` that differs from `from` only in the `free` joints, by damped Newton within
/// the limits. @return false when there is none near
bool solve_end_posture(const Machine& machine, const MotionLimits& limits,
                       const Eigen::Vector3d& goal, const std::vector<bool>& free,
                       Eigen::VectorXd& q);

}  // namespace sparflow
