#include "planners/tip_goal.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "models/machine/kinematics.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Distance of the tip at which the iteration stops.
/// @threshold [m] 1e-14..1e-8; numerical: rounding of a tip position is near 1e-15 m
constexpr double kConverged = 1e-11;
/// Distance, in seconds at full speed, below which two postures count as equal.
/// @threshold [s] 1e-6..0.1; chosen: a millimetre of travel
constexpr double kSame = 1e-3;

std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

double distance(const VectorXd& a, const VectorXd& b, const VectorXd& scale) {
  return (a - b).cwiseQuotient(scale).norm();
}

}  // namespace

double path_length(const MatrixXd& path, const VectorXd& scale) {
  double length = 0.0;
  for (Eigen::Index k = 0; k + 1 < path.rows(); ++k) {
    length += distance(path.row(k).transpose(), path.row(k + 1).transpose(), scale);
  }
  return length;
}

TipSolver::TipSolver(const MotionProblem& problem)
    : machine_(problem.machine), limits_(problem.limits.position), scale_(speed_scale(problem)) {
  moving_ = moving_tip_directions(machine_);
}

int TipSolver::redundancy() const {
  return std::max(0, machine_.tip.joint + 1 - static_cast<int>(moving_.cols()));
}

Vector3d TipSolver::tip(const VectorXd& q) const { return tip_position<double>(machine_, q); }

VectorXd TipSolver::step(const MatrixXd& jacobian, const VectorXd& residual, double damping,
                         const VectorXd& q, int frozen) const {
  // Joints at a limit that the step would push further are removed from the step, in repeated passes.
  VectorXd weight = scale_;
  for (Eigen::Index i = 0; i < weight.size(); ++i) {
    if (static_cast<int>(i) == frozen || limits_[at(i)].hi <= limits_[at(i)].lo) weight[i] = 0.0;
  }
  VectorXd move;
  for (Eigen::Index pass = 0; pass <= q.size(); ++pass) {
    const MatrixXd scaled = jacobian * weight.asDiagonal();
    MatrixXd normal = scaled * scaled.transpose();
    normal.diagonal().array() += damping * (normal.trace() + 1e-12);
    move = -(weight.asDiagonal() * (scaled.transpose() * solve_symmetric(normal, residual)));
    bool outward = false;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const bool stuck = (q[i] <= limits_[at(i)].lo && move[i] < 0.0) ||
                         (q[i] >= limits_[at(i)].hi && move[i] > 0.0);
      if (stuck && weight[i] > 0.0) {
        weight[i] = 0.0;
        outward = true;
      }
    }
    if (!outward) break;
  }
  return move;
}

Posture TipSolver::solve(const VectorXd& from, const Vector3d& target, int frozen) const {
  Posture best;
  best.q = from;
  for (Eigen::Index i = 0; i < from.size(); ++i) {
    best.q[i] = std::clamp(from[i], limits_[at(i)].lo, limits_[at(i)].hi);
  }
  best.tip = tip(best.q);
  VectorXd residual = moving_.transpose() * (best.tip - target);
  /// Largest number of damped steps.
  /// @threshold [1] 20..10000; numerical: a local minimum of the distance ends it sooner
  constexpr int kMostSteps = 200;
  double damping = 1e-3;
  for (int iteration = 0; iteration < kMostSteps && residual.norm() > kConverged; ++iteration) {
    const MatrixXd jacobian =
        moving_.transpose() *
        point_jacobian_matrix(machine_, best.q, machine_.tip.joint, machine_.tip.xyz);
    VectorXd next = best.q + step(jacobian, residual, damping, best.q, frozen);
    for (Eigen::Index i = 0; i < next.size(); ++i) {
      next[i] = std::clamp(next[i], limits_[at(i)].lo, limits_[at(i)].hi);
    }
    const Vector3d next_tip = tip(next);
    const VectorXd next_residual = moving_.transpose() * (next_tip - target);
    if (next_residual.norm() < residual.norm()) {
      /// Progress of a step below which it has stalled.
      /// @threshold [m] 0..1e-9; numerical: rounding of a tip position
      constexpr double kNoProgress = 1e-13;
      const bool stalled = residual.norm() - next_residual.norm() < kNoProgress;
      best.q = next;
      best.tip = next_tip;
      residual = next_residual;
      damping = std::max(1e-14, 0.1 * damping);
      if (stalled) break;
    } else {
      damping = std::max(1e-6, damping * 10.0);
      /// Damping beyond which no descent is possible.
      /// @threshold [1] 1e4..1e12; numerical: a step then is a rounding error long: a local minimum of the distance
      constexpr double kMostDamping = 1e8;
      if (damping > kMostDamping) break;  // no descent is possible: a local minimum of the distance
    }
  }
  best.distance = (best.tip - target).norm();
  return best;
}

Posture TipSolver::pull_towards(const Posture& posture, const VectorXd& anchor,
                                const Vector3d& target) const {
  Posture best = posture;
  double length = distance(best.q, anchor, scale_);
  /// Share of the step to the anchor below which no shorter one is tried.
  /// @threshold [1] 1e-6..0.1; chosen: ten halvings
  constexpr double kLeastShare = 1e-3;
  for (double share = 1.0; share > kLeastShare;) {
    // The step goes straight to the anchor, less its part that would move the tip.
    const MatrixXd jacobian =
        moving_.transpose() *
        point_jacobian_matrix(machine_, best.q, machine_.tip.joint, machine_.tip.xyz);
    VectorXd wanted = anchor - best.q;
    for (Eigen::Index i = 0; i < wanted.size(); ++i) {
      const Range& range = limits_[at(i)];
      if ((best.q[i] <= range.lo && wanted[i] < 0.0) || (best.q[i] >= range.hi && wanted[i] > 0.0))
        wanted[i] = 0.0;
    }
    wanted += step(jacobian, jacobian * wanted, 1e-12, best.q, -1);
    const Posture next = solve(best.q + share * wanted, target);
    const double next_length = distance(next.q, anchor, scale_);
    if (next.distance <= std::max(best.distance, kConverged * 10.0) &&
        next_length < length - 1e-9) {
      best = next;
      length = next_length;
    } else {
      share *= 0.5;
    }
  }
  return best;
}

GoalPostures sample_goal(const MotionProblem& problem, ClearanceModel& clearance, int samples,
                         std::uint64_t seed) {
  GoalPostures result;
  result.nearest.distance = std::numeric_limits<double>::infinity();
  result.blocked.distance = -std::numeric_limits<double>::infinity();
  const TipSolver solver(problem);
  const VectorXd& scale = solver.scale();

  const auto keep = [&](const Posture& found) {
    if (found.distance > kTipTolerance) {
      if (!result.reachable && found.distance < result.nearest.distance) result.nearest = found;
      return;
    }
    result.reachable = true;
    for (const VectorXd& known : result.postures) {
      if (distance(known, found.q, scale) < kSame) return;
    }
    const Nearest gap = clearance.nearest(found.q.data());
    if (gap.distance >= 0.0) {
      result.postures.push_back(found.q);
    } else if (gap.distance > result.blocked.distance) {
      result.blocked = gap;
    }
  };

  if (const auto* goal = std::get_if<JointGoal>(&problem.goal)) {
    keep({goal->q, solver.tip(goal->q), 0.0});
    return result;
  }
  const Vector3d target = std::get<TipGoal>(problem.goal).tip;
  const Posture direct = solver.solve(problem.start, target);
  keep(direct);
  const int joints = problem.machine.joint_count();
  if (solver.redundancy() > 0) {
    for (int j = 0; j < joints; ++j) keep(solver.solve(problem.start, target, j));
  }
  std::mt19937_64 engine(seed);
  const auto uniform = [&engine] { return static_cast<double>(engine() >> 11) * 0x1.0p-53; };
  VectorXd from(joints);
  for (int s = 0; s < samples; ++s) {
    for (Eigen::Index i = 0; i < joints; ++i) {
      const Range& range = problem.limits.position[at(i)];
      from[i] = range.lo + uniform() * (range.hi - range.lo);
    }
    keep(solver.solve(from, target));
  }
  if (result.postures.empty()) return result;

  const auto nearer = [&](const VectorXd& a, const VectorXd& b) {
    return distance(a, problem.start, scale) < distance(b, problem.start, scale);
  };
  if (solver.redundancy() > 0) {
    // Several of the nearest samples are moved towards the start, because their basins may differ.
    std::vector<VectorXd> by_distance = result.postures;
    std::sort(by_distance.begin(), by_distance.end(), nearer);
    by_distance.resize(std::min<std::size_t>(by_distance.size(), 4));
    for (const VectorXd& q : by_distance) {
      const Vector3d there = solver.tip(q);
      keep(solver.pull_towards({q, there, (there - target).norm()}, problem.start, target));
    }
  }
  std::iter_swap(result.postures.begin(),
                 std::min_element(result.postures.begin(), result.postures.end(), nearer));
  return result;
}

void spread_out(const std::vector<VectorXd>& postures, const VectorXd& scale, std::size_t count,
                double least, std::vector<std::size_t>& chosen) {
  if (postures.empty()) return;
  if (chosen.empty() && count > 0) chosen.push_back(0);
  while (chosen.size() < count) {
    std::size_t furthest = 0;
    double widest = -1.0;
    for (std::size_t i = 0; i < postures.size(); ++i) {
      double gap = std::numeric_limits<double>::infinity();
      for (const std::size_t c : chosen) {
        gap = std::min(gap, distance(postures[i], postures[c], scale));
      }
      if (gap > widest) {
        widest = gap;
        furthest = i;
      }
    }
    if (widest <= least) break;
    chosen.push_back(furthest);
  }
}

}  // namespace sparflow
