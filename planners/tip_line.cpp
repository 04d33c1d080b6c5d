#include "planners/tip_line.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Distance of waypoints in the first division.
/// @threshold [m] 0.01..1; chosen: it is halved until the path keeps to the line
constexpr double kSpacing = 0.1;
/// Largest distance of a waypoint's tip from the line.
/// @threshold [m] 1e-9..1e-3; numerical: far below any tolerance of a line
constexpr double kOnLine = 1e-6;
/// Largest number of waypoints.
/// @threshold [1] 16..1e6; chosen: four millimetres on a line of eight metres
constexpr int kFinest = 2048;

/// Gives the next posture from the one before, the tip's target and the share of the line done.
using Advance = std::function<Posture(const VectorXd&, const Vector3d&, double)>;

/// The path, or as much of it as could be solved.
MatrixXd walk(const VectorXd& start, const Vector3d& from, const Vector3d& to, int pieces,
              const Advance& advance) {
  MatrixXd path(pieces + 1, start.size());
  path.row(0) = start;
  for (int k = 1; k <= pieces; ++k) {
    const double share = static_cast<double>(k) / pieces;
    const Posture next = advance(path.row(k - 1).transpose(), from + share * (to - from), share);
    if (next.distance > kOnLine) return path.topRows(k);
    path.row(k) = next.q;
  }
  return path;
}

double deviation_between(const MatrixXd& path, const TipSolver& solver, const Vector3d& from,
                         const Vector3d& to) {
  const Vector3d along = (to - from).normalized();
  double worst = 0.0;
  for (Eigen::Index k = 0; k + 1 < path.rows(); ++k) {
    const Vector3d off = solver.tip(0.5 * (path.row(k) + path.row(k + 1)).transpose()) - from;
    worst = std::max(worst, (off - along * along.dot(off)).norm());
  }
  return worst;
}

}  // namespace

TipLinePaths follow_tip_line(const MotionProblem& problem, const TipSolver& solver,
                             const std::vector<VectorXd>& ends) {
  TipLinePaths result;
  const Vector3d from = solver.tip(problem.start);
  Vector3d to = from;
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal)) {
    to = goal->tip;
  } else {
    to = solver.tip(std::get<JointGoal>(problem.goal).q);
  }
  const bool end_is_given = std::holds_alternative<JointGoal>(problem.goal);
  const double tolerance = problem.tip_line ? problem.tip_line->tolerance : 0.0;

  std::vector<Advance> ways;
  if (!end_is_given) {
    ways.push_back(
        [&](const VectorXd& q, const Vector3d& target, double) { return solver.solve(q, target); });
    for (int j = 0; solver.redundancy() > 0 && j < problem.machine.joint_count(); ++j) {
      ways.push_back([&solver, j](const VectorXd& q, const Vector3d& target, double) {
        return solver.solve(q, target, j);
      });
    }
  }
  if (end_is_given || solver.redundancy() > 0) {
    for (const VectorXd& end : ends) {
      ways.push_back([&](const VectorXd& q, const Vector3d& target, double share) {
        // The step is attracted to the straight joint line to this end, then corrected back to the tip's line.
        const VectorXd wanted = problem.start + share * (end - problem.start);
        return solver.pull_towards(solver.solve(q, target), wanted, target);
      });
    }
  }

  const int first = std::max(16, static_cast<int>(std::ceil((to - from).norm() / kSpacing)));
  for (const Advance& way : ways) {
    for (int pieces = first; pieces <= kFinest; pieces *= 2) {
      MatrixXd path = walk(problem.start, from, to, pieces, way);
      result.furthest = std::max(result.furthest, static_cast<double>(path.rows() - 1) / pieces);
      if (path.rows() <= pieces) break;  // a finer division would meet the same limit
      /// Share of the tolerance that the path between waypoints may use.
      /// @threshold [1] 0.05..1; chosen: the rest is left for the optimised motion
      constexpr double kShareOfTolerance = 0.25;
      if (deviation_between(path, solver, from, to) > kShareOfTolerance * tolerance &&
          2 * pieces <= kFinest) {
        continue;
      }
      const bool arrived =
          !end_is_given ||
          (path.bottomRows(1).transpose() - ends.front()).cwiseQuotient(solver.scale()).norm() <
              1e-6;
      if (arrived) result.paths.push_back(std::move(path));
      break;
    }
  }
  return result;
}

}  // namespace sparflow
