#pragma once
/// Several different ways from start to goal, for an optimiser to start from. Plain data out.
#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/problem.h"

namespace sparflow {

struct SeedOptions {
  int count = 8;         ///< paths wanted at most
  double seconds = 5.0;  ///< give up looking for more after this; a result cut short says so
  std::uint64_t random_seed = 1;  ///< same seed and not cut short: same paths
  int goal_samples = 200;         ///< random starts with which the goal region is sampled
  int iterations = 20000;         ///< of each sampling planner
  /// Told the share of the work done and what is being done; may be empty.
  std::function<void(double, const std::string&)> progress;
};

enum class SeedStatus {
  kFound,
  kStartOutOfLimits,
  kStartInCollision,
  kGoalOutOfLimits,  ///< a joint goal beyond the position limits
  kGoalInCollision,  ///< every posture found at the goal collides
  kGoalUnreachable,  ///< the tip cannot get there within the position limits, obstacles or not
  kNoPath,           ///< none found within iterations and time; no proof that there is none
};

struct SeedPath {
  Eigen::MatrixXd path;  ///< waypoints x joints, first = start, [rad] or [m]; straight between them
  std::string planner;   ///< "straight line", "RRT-Connect", "BIT*", "tip line"
  double length = 0.0;   ///< path_length() in the room's metric [s]
};

struct SeedResult {
  SeedStatus status = SeedStatus::kNoPath;
  std::string message;  ///< one sentence: what was found or what is wrong, where, by how much
  /// Best of each end posture first (shortest first), then further homotopy classes.
  std::vector<SeedPath> paths;
  int end_postures = 0;       ///< clear postures found at the goal
  bool out_of_time = false;   ///< `seconds` ended the search: another run may find other paths
  Eigen::VectorXd nearest_q;  ///< kGoalUnreachable: the posture that comes nearest
  Eigen::Vector3d nearest_tip = Eigen::Vector3d::Zero();  ///< and its tip [m]
  double miss = 0.0;       ///< and the tip's distance from the goal [m]
  double clearance = 0.0;  ///< collisions: signed distance less the capsule's radius [m]
  double solve_s = 0.0;    ///< [s]
};

/// The same leg by leg through the problem's waypoints: the postures at them are those the legs happen to end in, which
/// whoever optimises may move. Status and message are those of the first leg that cannot be planned.
SeedResult find_paths_through_waypoints(const MotionProblem& problem, const SeedOptions& options);

/// @throws nothing for what the user asked for; sizes that do not match the machine are a CHECK
SeedResult find_seed_paths(const MotionProblem& problem, const SeedOptions& options = {});

}  // namespace sparflow
