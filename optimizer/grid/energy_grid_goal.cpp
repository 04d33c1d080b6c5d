#include "optimizer/grid/energy_grid_goal.h"

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "models/math/linear_algebra.h"
#include "optimizer/phases/sequential_modes.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Newton's method on the tip in the directions in which it can move; steps are least in units of `scale`, frozen joints
/// do not move.
class GoalNewton {
 public:
  GoalNewton(const MotionProblem& problem, const Machine& machine, const Eigen::Vector3d& goal)
      : machine_(machine), limits_(problem.limits.position), goal_(goal), chain_(machine) {}

  Eigen::Vector3d tip(const VectorXd& q) {
    chain_.update(machine_, q.data());
    return chain_.point(machine_.tip.joint, machine_.tip.xyz);
  }
  const Eigen::Matrix3Xd& jacobian(const VectorXd& q) {
    const Eigen::Vector3d p = tip(q);
    jacobian_.resize(3, q.size());
    for (int k = 0; k < q.size(); ++k) {
      jacobian_.col(k) = point_jacobian(chain_, machine_.tip.joint, p, k);
    }
    return jacobian_;
  }

  bool solve(VectorXd& q, unsigned frozen, const VectorXd& scale, int iterations) {
    for (int i = 0; i < iterations; ++i) {
      const Eigen::Matrix3Xd j = jacobian(q);
      const Eigen::Vector3d error = goal_ - chain_.point(machine_.tip.joint, machine_.tip.xyz);
      /// Distance of the tip at which Newton's method stops.
      /// @threshold [m] 1e-13..1e-7; numerical: far below what counts as reached
      constexpr double kTipConverged = 1e-9;
      if (error.norm() < kTipConverged) return true;
      Eigen::Matrix3Xd scaled = j * scale.asDiagonal();
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        if (frozen >> k & 1u) scaled.col(k).setZero();
      }
      const Eigen::Matrix3d normal = scaled * scaled.transpose();
      const double small = 1e-10 * std::max(normal.trace(), 1e-12);
      VectorXd step =
          scaled.transpose() * solve_symmetric(normal + small * Eigen::Matrix3d::Identity(), error);
      /// Longest step of a joint.
      /// @threshold [cells] 1..20; chosen: a linearised arm is wrong far from its node
      constexpr double kLongestStep = 3.0;
      const double length = step.cwiseAbs().maxCoeff();
      if (length > kLongestStep)
        step *= kLongestStep / length;  // a step is at most three cells long
      q += scale.cwiseProduct(step);
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        const Range& r = limits_[static_cast<std::size_t>(k)];
        q[k] = std::clamp(q[k], r.lo, r.hi);
      }
    }
    /// Distance of the tip beyond which the goal was not reached.
    /// @threshold [m] 1e-10..1e-4; numerical: far below what the check of a motion's end accepts
    constexpr double kTipReached = 1e-7;
    return (goal_ - tip(q)).norm() < kTipReached;
  }

 private:
  const Machine& machine_;
  const std::vector<Range>& limits_;
  Eigen::Vector3d goal_;
  ChainGeometry chain_;
  Eigen::Matrix3Xd jacobian_;
};

}  // namespace

std::vector<VectorXd> anchor_postures(const MotionProblem& problem, const Machine& machine) {
  if (const auto* joint_goal = std::get_if<JointGoal>(&problem.goal)) return {joint_goal->q};
  const Eigen::Vector3d goal = std::get<TipGoal>(problem.goal).tip;
  const int n = machine.joint_count();
  std::vector<VectorXd> ends;
  /// Distance below which two end postures count as equal.
  /// @threshold [rad or m] 1e-9..1e-2; chosen: a tenth of a millimetre of stroke
  constexpr double kSamePosture = 1e-4;
  const auto add = [&](const VectorXd& q) {
    for (const VectorXd& known : ends) {
      if ((known - q).cwiseAbs().maxCoeff() < kSamePosture) return;
    }
    ends.push_back(q);
  };
  // Newton's method begins at the start and, if that fails, at postures inside the range.
  for (const double share : {0.0, 0.5, 0.2, 0.8}) {
    if (share > 0.0 && !ends.empty()) break;
    for (unsigned still = 0; still < (1u << n) - 1u; ++still) {
      std::vector<bool> free(static_cast<std::size_t>(n));
      VectorXd q = problem.start;
      for (int j = 0; j < n; ++j) {
        free[static_cast<std::size_t>(j)] = (still >> j & 1u) == 0;
        const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
        if (free[static_cast<std::size_t>(j)] && share > 0.0) q[j] = r.lo + share * (r.hi - r.lo);
      }
      if (solve_end_posture(machine, problem.limits, goal, free, q)) add(q);
    }
  }
  return ends;
}

std::vector<GoalEnd> goal_ends(const MotionProblem& problem, const Machine& machine,
                               const Lattice& lattice) {
  if (const auto* joint_goal = std::get_if<JointGoal>(&problem.goal)) {
    return {{lattice.nearest_node(joint_goal->q), joint_goal->q}};
  }
  const Eigen::Vector3d goal = std::get<TipGoal>(problem.goal).tip;
  GoalNewton newton(problem, machine, goal);
  const int n = lattice.joints();
  std::vector<GoalEnd> ends;
  VectorXd cell(n);
  for (long node = 0; node < lattice.nodes; ++node) {
    VectorXd from(n);
    for (int j = 0; j < n; ++j) {
      const VectorXd& lines = lattice.lines[static_cast<std::size_t>(j)];
      const int k = lattice.line(node, j);
      from[j] = lines[k];
      cell[j] = std::max(k > 0 ? lines[k] - lines[k - 1] : 0.0,
                         k + 1 < lines.size() ? lines[k + 1] - lines[k] : 0.0);
    }
    const Eigen::Vector3d error = goal - newton.tip(from);
    // Cheap test: the tip cannot travel further within a cell than its joints' travels add up to.
    const Eigen::Matrix3Xd& jacobian = newton.jacobian(from);
    const double reach = (jacobian.cwiseAbs() * cell).norm();
    /// Factor on the tip's largest travel within a cell, for what is not linear.
    /// @threshold [1] 1..2; chosen: the linearisation errs by less than a fifth within a cell
    constexpr double kBeyondLinear = 1.2;
    if (error.norm() > kBeyondLinear * reach) continue;
    for (unsigned frozen = 0; frozen < (1u << n) - 1u; ++frozen) {
      VectorXd q = from;
      if (!newton.solve(q, frozen, cell, 8)) continue;
      /// Distance of an end posture from its node up to which it belongs to it.
      /// @threshold [cells] 1..2; chosen: the neighbouring node may miss it by rounding
      constexpr double kBesideCell = 1.05;
      if (((q - from).cwiseAbs().array() > kBesideCell * cell.array()).any()) continue;
      for (int j = 0; j < n; ++j) {
        // A joint's step of this size is Newton's residual, not a move.
        /// Step of a joint that is Newton's residual, not a move.
        /// @threshold [rad or m] 1e-12..1e-5; numerical: ten times what convergence of the tip leaves
        constexpr double kNoMove = 1e-8;
        if (std::abs(q[j] - from[j]) < kNoMove) q[j] = from[j];
      }
      ends.push_back({node, q});
    }
  }
  return ends;
}

}  // namespace sparflow
