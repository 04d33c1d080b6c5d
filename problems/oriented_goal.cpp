#include "problems/oriented_goal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "models/machine/kinematics.h"
#include "models/math/linear_algebra.h"
#include "problems/motion_limits.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Residual of position [m] and angle [rad] at which a configuration reaches the goal.
/// @threshold [m or rad] 1e-12..1e-5; numerical: below what the check of a motion's end accepts
constexpr double kPostureReached = 1e-9;

/// The last revolute joint that moves the tip; -1 = none.
int pointing_joint(const Machine& machine) {
  int joint = machine.tip.joint;
  while (joint >= 0 && machine.joints[static_cast<std::size_t>(joint)].type != JointType::kRevolute)
    --joint;
  return joint;
}

Vector3d outward(const Vector3d& tip) {
  const Vector3d flat(tip.x(), tip.y(), 0.0);
  return flat.norm() > 0.0 ? Vector3d(flat.normalized()) : Vector3d::UnitX();
}

/// The direction in which the tip points, not normalised.
Vector3d pointing(const Machine& machine, const VectorXd& q) {
  const int joint = pointing_joint(machine);
  const auto frames = forward_kinematics<double>(machine, q);
  return point_in_base(frames, machine.tip.joint, machine.tip.xyz) -
         point_in_base(frames, joint, Vector3d(Vector3d::Zero()));
}

/// Damped Newton steps on position and angle.
class PostureSearch {
 public:
  PostureSearch(const MotionProblem& problem, const OrientedTip& goal)
      : machine_(problem.machine),
        limits_(problem.limits.position),
        goal_(goal),
        scale_(speed_scale(problem)),
        moving_(moving_tip_directions(problem.machine)) {}

  /// @return whether q reaches the goal afterwards
  bool solve(VectorXd& q) const {
    double damping = 1e-3;
    VectorXd r = residual(q);
    /// Largest number of steps.
    /// @threshold [1] 20..10000; numerical: a local minimum ends the search sooner
    constexpr int kMostSteps = 200;
    for (int k = 0; k < kMostSteps && r.norm() > 0.1 * kPostureReached; ++k) {
      const MatrixXd scaled = jacobian(q) * scale_.asDiagonal();
      MatrixXd normal = scaled * scaled.transpose();
      normal.diagonal().array() += damping * (normal.trace() + 1e-12);
      VectorXd next = q - scale_.cwiseProduct(scaled.transpose() * solve_symmetric(normal, r));
      for (Eigen::Index i = 0; i < next.size(); ++i) {
        const Range& range = limits_[static_cast<std::size_t>(i)];
        next[i] = std::clamp(next[i], range.lo, range.hi);
      }
      const VectorXd next_r = residual(next);
      if (next_r.norm() < r.norm()) {
        q = next;
        r = next_r;
        damping = std::max(1e-14, 0.1 * damping);
      } else {
        damping = std::max(1e-6, 10.0 * damping);
        /// Damping beyond which no descent is possible.
        /// @threshold [1] 1e4..1e12; numerical: a step then is a rounding error long
        constexpr double kMostDamping = 1e8;
        if (damping > kMostDamping) break;
      }
    }
    // The fixed directions of a planar machine count in the distance only.
    return r.norm() < kPostureReached &&
           (tip_position<double>(machine_, q) - goal_.tip).norm() < 1e-4;
  }

 private:
  VectorXd residual(const VectorXd& q) const {
    VectorXd r(moving_.cols() + 1);
    r.head(moving_.cols()) = moving_.transpose() * (tip_position<double>(machine_, q) - goal_.tip);
    r[moving_.cols()] =
        std::remainder(tip_angle(machine_, q, goal_.tip) - goal_.angle, 2.0 * std::numbers::pi);
    return r;
  }
  MatrixXd jacobian(const VectorXd& q) const {
    const MatrixXd tip = point_jacobian_matrix(machine_, q, machine_.tip.joint, machine_.tip.xyz);
    const MatrixXd pivot =
        point_jacobian_matrix(machine_, q, pointing_joint(machine_), Vector3d::Zero());
    const Vector3d d = pointing(machine_, q), h = outward(goal_.tip);
    const double along = d.dot(h), up = d.z(), size2 = std::max(along * along + up * up, 1e-12);
    MatrixXd j(moving_.cols() + 1, q.size());
    j.topRows(moving_.cols()) = moving_.transpose() * tip;
    j.row(moving_.cols()) =
        (along * Vector3d::UnitZ() - up * h).transpose() * (tip - pivot) / size2;
    return j;
  }

  const Machine& machine_;
  const std::vector<Range>& limits_;
  OrientedTip goal_;
  VectorXd scale_;
  Eigen::Matrix3Xd moving_;
};

}  // namespace

double tip_angle(const Machine& machine, const VectorXd& q, const Vector3d& tip) {
  const Vector3d d = pointing(machine, q);
  return std::atan2(d.z(), d.dot(outward(tip)));
}

std::vector<VectorXd> oriented_postures(const MotionProblem& problem, const OrientedTip& goal) {
  std::vector<VectorXd> found;
  if (pointing_joint(problem.machine) < 0) return found;
  const VectorXd scale = speed_scale(problem);
  const auto distance = [&](const VectorXd& a, const VectorXd& b) {
    return (a - b).cwiseQuotient(scale).norm();
  };
  const PostureSearch search(problem, goal);
  /// Random configurations from which the search begins, besides the start.
  /// @threshold [1] 10..10000; chosen: each solution's basin is met many times
  constexpr int kBeginnings = 200;
  /// Distance below which two configurations are one.
  /// @threshold [s] 1e-6..0.1; chosen: a millimetre of travel
  constexpr double kSamePosture = 1e-3;
  std::mt19937_64 engine(1);
  VectorXd q = problem.start;
  for (int k = 0; k <= kBeginnings; ++k) {
    if (search.solve(q) && std::none_of(found.begin(), found.end(), [&](const VectorXd& known) {
          return distance(known, q) < kSamePosture;
        }))
      found.push_back(q);
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const Range& range = problem.limits.position[static_cast<std::size_t>(i)];
      q[i] = range.lo + static_cast<double>(engine() >> 11) * 0x1.0p-53 * (range.hi - range.lo);
    }
  }
  std::sort(found.begin(), found.end(), [&](const VectorXd& a, const VectorXd& b) {
    return distance(a, problem.start) < distance(b, problem.start);
  });
  return found;
}

}  // namespace sparflow
