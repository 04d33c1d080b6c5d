#pragma once
/// One OMPL query: from a start to any of several goal configurations. Internal to planners/.
#include <Eigen/Dense>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "planners/configuration_space.h"

namespace sparflow {

/// The planner: Kuffner and LaValle 2000. It finds any path, which is then shortened.
inline constexpr const char* kTreePlanner = "RRT-Connect";

struct QueryLimits {
  /// Largest number of iterations of the planner's loop; this limit keeps results reproducible.
  /// @threshold [iterations] 10..1e8; chosen: more find narrower passages and take longer
  int iterations = 20000;
  std::chrono::steady_clock::time_point deadline;  ///< limit of the wall time
  bool* late = nullptr;                            ///< set when the deadline cut a query short
};

struct PathQuery {
  std::vector<Eigen::VectorXd> ends;
  std::uint32_t seed = 1;  ///< of the random numbers
};

/// Simplified path in joint coordinates [waypoints x joints] from `start` to one of the query's ends, clear by
/// ClearanceModel; nullopt when none was found. The same seed gives the same path unless the deadline is hit. OMPL's random
/// numbers start from one process-wide seed, so calls are serialised by a lock.
std::optional<Eigen::MatrixXd> query_path(const ConfigurationSpace& space,
                                          const Eigen::VectorXd& start, const PathQuery& query,
                                          const QueryLimits& limits);

}  // namespace sparflow
