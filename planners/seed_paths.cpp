#include "planners/seed_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "models/math/error.h"
#include "planners/configuration_space.h"
#include "planners/ompl_query.h"
#include "planners/tip_goal.h"
#include "planners/tip_line.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Clock = std::chrono::steady_clock;

/// Excess of a position limit up to which a posture is within.
/// @threshold [rad or m] 0..1e-6; numerical: rounding of the user's numbers
constexpr double kLimitSlack = 1e-9;
/// Share of every joint's range below which two ends count as equal.
/// @threshold [1] 0..0.5; chosen: planning to both would give the same path twice
constexpr double kSameEnd = 0.02;
constexpr const char* kStraight = "straight line";
/// Pairs of postures tested between two paths.
/// @threshold [1] 4..1000; chosen: links move less than an obstacle's size between two
constexpr int kDeformationSteps = 32;

/// "boom: 1.5 rad, limits are [-0.2, 1.35] rad", or "" when all joints are within.
std::string beyond_limits(const MotionProblem& problem, const VectorXd& q) {
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const auto joint = static_cast<std::size_t>(i);
    const Range& range = problem.limits.position[joint];
    if (q[i] >= range.lo - kLimitSlack && q[i] <= range.hi + kLimitSlack) continue;
    const bool angle = problem.machine.joints[joint].type == JointType::kRevolute;
    return fmt::format("{}: got {:g} {unit}, expected {:g} to {:g} {unit}",
                       problem.machine.joints[joint].name, q[i], range.lo, range.hi,
                       fmt::arg("unit", angle ? "rad" : "m"));
  }
  return "";
}

/// Configurations at equal shares of the path's length.
MatrixXd at_equal_shares(const MatrixXd& path, const VectorXd& scale, int pieces) {
  VectorXd along = VectorXd::Zero(path.rows());
  for (Eigen::Index k = 1; k < path.rows(); ++k) {
    along[k] =
        along[k - 1] + (path.row(k) - path.row(k - 1)).transpose().cwiseQuotient(scale).norm();
  }
  MatrixXd result(pieces + 1, path.cols());
  Eigen::Index k = 0;
  for (int i = 0; i <= pieces; ++i) {
    const double wanted = along[path.rows() - 1] * i / pieces;
    while (k + 2 < path.rows() && along[k + 1] < wanted) ++k;
    const double piece = along[k + 1] - along[k];
    const double share = piece > 0.0 ? std::clamp((wanted - along[k]) / piece, 0.0, 1.0) : 0.0;
    result.row(i) = path.row(k) + share * (path.row(k + 1) - path.row(k));
  }
  return result;
}

bool same_end(const MotionProblem& problem, const MatrixXd& a, const MatrixXd& b) {
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    const Range& range = problem.limits.position[static_cast<std::size_t>(i)];
    const double gap = std::abs(a(a.rows() - 1, i) - b(b.rows() - 1, i));
    if (gap > kSameEnd * (range.hi - range.lo)) return false;
  }
  return true;
}

/// Visibility deformation (Jaillet and Simeon 2008): one path can be pushed straight into the other when
/// postures at equal shares see each other. Sufficient for the same homotopy class, not necessary.
bool deformable(const MatrixXd& a, const MatrixXd& b, const VectorXd& scale,
                ClearanceModel& clearance) {
  const MatrixXd on_a = at_equal_shares(a, scale, kDeformationSteps);
  const MatrixXd on_b = at_equal_shares(b, scale, kDeformationSteps);
  for (Eigen::Index i = 1; i < on_a.rows(); ++i) {
    const VectorXd from = on_a.row(i), to = on_b.row(i);
    if (!clearance.motion_clear(from.data(), to.data())) return false;
  }
  return true;
}

/// The search for seed paths; each step adds to result_.
class Search {
 public:
  Search(const MotionProblem& problem, const SeedOptions& options)
      : problem_(problem),
        options_(options),
        clearance_(problem),
        scale_(speed_scale(problem)),
        begin_(Clock::now()),
        deadline_(begin_ + std::chrono::duration_cast<Clock::duration>(
                               std::chrono::duration<double>(options.seconds))) {}

  SeedResult run() {
    if (start_is_good() && sample_goal_region()) {
      if (problem_.tip_line) {
        along_tip_line();
      } else {
        straight_lines();
        sampling_planners();
      }
      if (candidates_.empty()) {
        if (result_.message.empty()) {
          fail(SeedStatus::kNoPath,
               fmt::format(
                   "no path found to {} goal configuration(s) with {} iterations each{}; allow "
                   "more seconds or check the obstacles",
                   result_.end_postures, options_.iterations,
                   result_.out_of_time ? " (time ran out)" : ""));
        }
      } else {
        select();
        result_.status = SeedStatus::kFound;
        result_.message = fmt::format(
            "{} path{} to {} goal configuration{}; at the joints' largest speeds alone the "
            "shortest takes {:.2f} s",
            result_.paths.size(), result_.paths.size() == 1 ? "" : "s", result_.end_postures,
            result_.end_postures == 1 ? "" : "s", result_.paths.front().length);
      }
    }
    result_.solve_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    return std::move(result_);
  }

 private:
  void fail(SeedStatus status, std::string message) {
    result_.status = status;
    result_.message = std::move(message);
  }
  void tell(double share, const std::string& what) const {
    if (options_.progress) options_.progress(share, what);
  }
  bool late() {
    if (Clock::now() > deadline_) result_.out_of_time = true;
    return result_.out_of_time;
  }

  bool start_is_good() {
    SPARFLOW_CHECK(problem_.start.size() == problem_.machine.joint_count(),
                   "the start needs one coordinate for each joint");
    const std::string beyond = beyond_limits(problem_, problem_.start);
    if (!beyond.empty()) {
      fail(SeedStatus::kStartOutOfLimits, "start is outside the limits: " + beyond);
      return false;
    }
    const Nearest nearest = clearance_.nearest(problem_.start.data());
    if (nearest.distance < 0.0) {
      result_.clearance = nearest.distance;
      fail(SeedStatus::kStartInCollision, "start is in collision: " + clearance_.describe(nearest));
      return false;
    }
    return true;
  }

  bool sample_goal_region() {
    tell(0.0, "sampling goal configurations");
    if (const auto* goal = std::get_if<JointGoal>(&problem_.goal)) {
      SPARFLOW_CHECK(goal->q.size() == problem_.machine.joint_count(),
                     "a joint goal needs one coordinate for each joint");
      const std::string beyond = beyond_limits(problem_, goal->q);
      if (!beyond.empty()) {
        fail(SeedStatus::kGoalOutOfLimits, "goal is outside the limits: " + beyond);
        return false;
      }
    }
    GoalPostures goal =
        sample_goal(problem_, clearance_, options_.goal_samples, options_.random_seed);
    if (!goal.reachable) {
      const Vector3d wanted = std::get<TipGoal>(problem_.goal).tip;
      const Vector3d& tip = goal.nearest.tip;
      result_.nearest_q = goal.nearest.q;
      result_.nearest_tip = tip;
      result_.miss = goal.nearest.distance;
      fail(SeedStatus::kGoalUnreachable,
           fmt::format("goal.tip [{:.3f}, {:.3f}, {:.3f}] is out of reach within the position "
                       "limits: nearest the tip comes is [{:.3f}, {:.3f}, {:.3f}], {:.3f} m away",
                       wanted.x(), wanted.y(), wanted.z(), tip.x(), tip.y(), tip.z(),
                       goal.nearest.distance));
      return false;
    }
    result_.end_postures = static_cast<int>(goal.postures.size());
    if (goal.postures.empty()) {
      result_.clearance = goal.blocked.distance;
      fail(SeedStatus::kGoalInCollision,
           fmt::format("no clear goal configuration; in the least blocked one found {}",
                       clearance_.describe(goal.blocked)));
      return false;
    }
    postures_ = std::move(goal.postures);
    choose_ends();
    return true;
  }

  /// Chooses the nearest goal configuration, those that leave a joint at rest, and others far from each other.
  void choose_ends() {
    std::vector<std::size_t> chosen{0};
    const std::size_t wanted = static_cast<std::size_t>(std::max(1, options_.count - 2));
    for (Eigen::Index j = 0; j < problem_.start.size(); ++j) {
      for (std::size_t i = 1; i < postures_.size() && chosen.size() < wanted; ++i) {
        if (postures_[i][j] != problem_.start[j]) continue;
        if (std::find(chosen.begin(), chosen.end(), i) == chosen.end()) chosen.push_back(i);
        break;
      }
    }
    const double room = (postures_[0] - problem_.start).cwiseQuotient(scale_).norm();
    spread_out(postures_, scale_, wanted, 0.02 * room, chosen);
    for (const std::size_t i : chosen) ends_.push_back(postures_[i]);
  }

  void add(MatrixXd path, const std::string& planner) {
    const double length = path_length(path, scale_);
    for (SeedPath& known : candidates_) {
      if (!same_end(problem_, known.path, path) ||
          !deformable(known.path, path, scale_, clearance_)) {
        continue;
      }
      if (length < (1.0 - 1e-6) * known.length) known = {std::move(path), planner, length};
      return;
    }
    candidates_.push_back({std::move(path), planner, length});
  }

  void straight_lines() {
    for (const VectorXd& end : ends_) {
      if (clearance_.motion_clear(problem_.start.data(), end.data())) {
        MatrixXd line(2, end.size());
        line.row(0) = problem_.start;
        line.row(1) = end;
        const double length = path_length(line, scale_);
        candidates_.push_back(
            {std::move(line), kStraight, length});  // their ends differ, so none are duplicates
      } else {
        blocked_.push_back(end);
      }
    }
  }

  void sampling_planners() {
    const ConfigurationSpace space(problem_, clearance_);
    std::vector<PathQuery> queries;
    // One query goes to all goal configurations except the chosen ends, which have queries of their own.
    std::vector<VectorXd> others;
    for (const VectorXd& q : postures_) {
      if (std::find(ends_.begin(), ends_.end(), q) == ends_.end()) others.push_back(q);
    }
    if (!others.empty()) queries.push_back({others});
    if (!blocked_.empty()) queries.push_back({ends_});
    // Each blocked end gets several queries, because other random trees can find other homotopy classes.
    /// Queries to each blocked end.
    /// @threshold [1] 1..100; chosen: other random trees can find other homotopy classes
    constexpr int kTries = 3;
    for (int t = 0; t < kTries; ++t) {
      for (const VectorXd& end : blocked_) queries.push_back({{end}});
    }
    const QueryLimits limits{options_.iterations, deadline_, &result_.out_of_time};
    for (std::size_t i = 0; i < queries.size() && !late(); ++i) {
      tell(static_cast<double>(i + 1) / static_cast<double>(queries.size() + 1),
           fmt::format("{} {} of {}", kTreePlanner, i + 1, queries.size()));
      // The factor 2654435761 keeps the queries of neighbouring user seeds apart.
      queries[i].seed =
          static_cast<std::uint32_t>((options_.random_seed * 2654435761u + i) % 0x7fffffffu);
      auto path = query_path(space, problem_.start, queries[i], limits);
      if (path) add(std::move(*path), kTreePlanner);
    }
  }

  void along_tip_line() {
    tell(0.5, "following the tip's line");
    const TipSolver solver(problem_);
    TipLinePaths found = follow_tip_line(problem_, solver, ends_);
    bool collides = false;
    for (MatrixXd& path : found.paths) {
      if (clearance_.path_clear(path)) {
        add(std::move(path), "tip line");
      } else {
        collides = true;
      }
    }
    if (!candidates_.empty()) return;
    fail(SeedStatus::kNoPath,
         collides ? std::string("path.tip_line: every posture sequence found along the tip's line "
                                "meets an obstacle")
                  : fmt::format("path.tip_line: the tip's line leaves the reach of the machine "
                                "after {:.0f} % of its length",
                                100.0 * found.furthest));
  }

  /// Selects the shortest path to each end first, then further homotopy classes, both by length.
  void select() {
    std::stable_sort(candidates_.begin(), candidates_.end(),
                     [](const SeedPath& a, const SeedPath& b) { return a.length < b.length; });
    std::vector<SeedPath> further;
    for (SeedPath& candidate : candidates_) {
      const bool known_end = std::any_of(
          result_.paths.begin(), result_.paths.end(),
          [&](const SeedPath& taken) { return same_end(problem_, taken.path, candidate.path); });
      const bool first = !known_end || candidate.planner == kStraight;
      (first ? result_.paths : further).push_back(std::move(candidate));
    }
    for (SeedPath& path : further) result_.paths.push_back(std::move(path));
    const auto wanted = static_cast<std::size_t>(std::max(1, options_.count));
    if (result_.paths.size() > wanted) result_.paths.resize(wanted);
  }

  const MotionProblem& problem_;
  const SeedOptions& options_;
  ClearanceModel clearance_;
  VectorXd scale_;
  Clock::time_point begin_, deadline_;
  std::vector<VectorXd> postures_;  ///< all clear goal configurations found
  std::vector<VectorXd> ends_;      ///< chosen ones, to each of which paths are planned
  std::vector<VectorXd> blocked_;   ///< chosen ones without a clear straight line
  std::vector<SeedPath> candidates_;
  SeedResult result_;
};

}  // namespace

bool may_have_a_path(const MotionProblem& problem, SeedStatus status) {
  return status == SeedStatus::kFound || status == SeedStatus::kNoPath ||
         (status == SeedStatus::kGoalInCollision && std::holds_alternative<TipGoal>(problem.goal));
}

SeedResult find_seed_paths(const MotionProblem& problem, const SeedOptions& options) {
  if (!problem.waypoints.empty()) return find_paths_through_waypoints(problem, options);
  return Search(problem, options).run();
}

}  // namespace sparflow
