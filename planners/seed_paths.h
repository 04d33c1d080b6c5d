#pragma once
/// Several different paths from start to goal, as seed paths of an optimisation. The result is plain data.
#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/problem.h"

namespace sparflow {

struct SeedOptions {
  /// Largest number of paths.
  /// @threshold [paths] 1..1000; chosen: each is a start of the optimiser, which takes much longer
  int count = 8;
  /// Time limit of the search; SeedResult::out_of_time says whether it was hit.
  /// @threshold [s] 0.1..1e5; chosen: the bundled problems need less than a second; beside narrow windows planners improve for some seconds
  double seconds = 5.0;
  /// The same seed gives the same paths unless the time limit is hit.
  std::uint64_t random_seed = 1;  // no threshold: any seed serves
  /// Random initial postures with which the goal region is sampled.
  /// @threshold [1] 1..1e6; chosen: a branch that one sample misses is met by another
  int goal_samples = 200;
  /// Iteration limit of each sampling planner.
  /// @threshold [iterations] 10..1e8; chosen: more find narrower passages and take longer
  int iterations = 20000;
  /// Called with the share of the work done and what is being done; may be empty.
  std::function<void(double, const std::string&)> progress;
};

enum class SeedStatus {
  kFound,
  kStartOutOfLimits,
  kStartInCollision,
  kGoalOutOfLimits,  ///< a joint goal beyond the position limits
  kGoalInCollision,  ///< every goal configuration found collides
  kGoalUnreachable,  ///< the tip does not reach the goal within the position limits, obstacles apart
  kNoPath,           ///< none found within iterations and time; a path may still exist
};

/// Whether a motion can exist although the search ended with this status: a path may be missed, and so may be a clear goal
/// configuration where the goal is a tip; the other failures are properties of the problem.
bool may_have_a_path(const MotionProblem& problem, SeedStatus status);

struct SeedPath {
  Eigen::MatrixXd path;  ///< waypoints x joints, first = start, [rad] or [m]; straight between them
  std::string planner;   ///< "straight line", "RRT-Connect", "tip line"
  double length = 0.0;   ///< path_length() [s]
};

struct SeedResult {
  SeedStatus status = SeedStatus::kNoPath;
  std::string message;  ///< one sentence: what was found or what is wrong, where, by how much
  /// The shortest path to each goal configuration first, by length, then further homotopy classes.
  std::vector<SeedPath> paths;
  int end_postures = 0;  ///< number of clear goal configurations found
  bool out_of_time =
      false;  ///< whether `seconds` ended the search; another run may then find other paths
  Eigen::VectorXd nearest_q;  ///< kGoalUnreachable: the posture that comes nearest
  Eigen::Vector3d nearest_tip = Eigen::Vector3d::Zero();  ///< its tip [m]
  double miss = 0.0;                                      ///< distance of its tip from the goal [m]
  double clearance = 0.0;  ///< collisions: signed distance less the capsule's radius [m]
  double solve_s = 0.0;    ///< wall time [s]
};

/// Seed paths through the problem's waypoints, planned leg by leg. The postures at the waypoints are those in which the
/// legs end; an optimiser may change them. Status and message are those of the first leg without a path.
SeedResult find_paths_through_waypoints(const MotionProblem& problem, const SeedOptions& options);

/// Seed paths of a problem without waypoints. An infeasible problem gives a status and throws nothing; sizes that do not
/// match the machine are a CHECK.
SeedResult find_seed_paths(const MotionProblem& problem, const SeedOptions& options = {});

}  // namespace sparflow
