#include <fmt/format.h>

#include <algorithm>

#include "planners/seed_paths.h"
#include "planners/tip_goal.h"
#include "problems/motion_limits.h"

namespace sparflow {

SeedResult find_paths_through_waypoints(const MotionProblem& problem, const SeedOptions& options) {
  /// Number of partial paths that are continued.
  /// @threshold [1] 1..100; chosen: paths of each leg multiply
  constexpr std::size_t kKept = 4;
  /// Paths of each leg.
  /// @threshold [1] 1..100; chosen: paths of each leg multiply
  constexpr int kOfALeg = 3;
  const Eigen::VectorXd scale = speed_scale(problem);
  std::vector<SeedPath> ways(1);
  ways[0].path = problem.start.transpose();
  std::vector<Goal> targets;
  for (const Eigen::Vector3d& tip : problem.waypoints) targets.emplace_back(TipGoal{tip});
  targets.push_back(problem.goal);
  SeedResult result;
  SeedOptions of_a_leg = options;
  of_a_leg.count = kOfALeg;
  of_a_leg.seconds = options.seconds / static_cast<double>(targets.size());
  of_a_leg.progress = {};
  for (std::size_t t = 0; t < targets.size(); ++t) {
    if (options.progress) {
      options.progress(static_cast<double>(t) / static_cast<double>(targets.size()),
                       fmt::format("leg {} of {}", t + 1, targets.size()));
    }
    std::vector<SeedPath> longer;
    SeedResult leg;
    for (const SeedPath& way : ways) {
      MotionProblem part = problem;
      part.waypoints.clear();
      part.start = way.path.row(way.path.rows() - 1).transpose();
      part.goal = targets[t];
      leg = find_seed_paths(part, of_a_leg);
      result.solve_s += leg.solve_s;
      result.out_of_time = result.out_of_time || leg.out_of_time;
      for (const SeedPath& piece : leg.paths) {
        SeedPath whole;
        whole.planner = "through waypoints";
        whole.path.resize(way.path.rows() + piece.path.rows() - 1, way.path.cols());
        whole.path << way.path, piece.path.bottomRows(piece.path.rows() - 1);
        whole.length = path_length(whole.path, scale);
        longer.push_back(std::move(whole));
      }
    }
    if (longer.empty()) {
      leg.paths.clear();
      if (t + 1 < targets.size()) leg.message = fmt::format("waypoint {}: {}", t + 1, leg.message);
      leg.solve_s = result.solve_s;
      return leg;
    }
    std::stable_sort(longer.begin(), longer.end(),
                     [](const SeedPath& a, const SeedPath& b) { return a.length < b.length; });
    const bool last = t + 1 == targets.size();
    const std::size_t most = last ? static_cast<std::size_t>(options.count) : kKept;
    if (longer.size() > most) longer.resize(most);
    result.end_postures = leg.end_postures;
    ways = std::move(longer);
  }
  result.paths = std::move(ways);
  result.status = SeedStatus::kFound;
  result.message =
      fmt::format("{} paths through {} waypoints", result.paths.size(), problem.waypoints.size());
  return result;
}

}  // namespace sparflow
