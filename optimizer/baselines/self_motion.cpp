#include "optimizer/baselines/self_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/motion_limits.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Distance of the tip at which Newton's method stops.
/// @threshold [m] 1e-14..1e-8; numerical: rounding of a tip position is near 1e-15 m
constexpr double kProjectionError = 1e-11;
/// Largest number of steps of a trace in one direction.
/// @threshold [1] 100..1e6; numerical: ends a trace that never closes; ranges are left far sooner
constexpr int kMostTraceSteps = 4000;
/// Step of a trace as share of the grid's spacing.
/// @threshold [1] 0.1..1; derived: a step then passes at most one value of a joint, the growth by projection included
constexpr double kTraceShare = 0.6;
/// Largest number of joints of which self-motions are traced.
/// @threshold [joints] 1..4; derived: three directions of the tip and one redundant joint give a curve
constexpr Eigen::Index kMostTracedJoints = 4;

using SquareSystem = std::array<std::array<double, kMostTracedJoints + 1>, kMostTracedJoints>;

/// Gauss elimination with pivots of [a | b], n x n. @return false when singular; the solution is in column n
bool eliminate_square(SquareSystem& a, std::size_t n) {
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < n; ++r) {
      if (std::abs(a[r][c]) > std::abs(a[pivot][c])) pivot = r;
    }
    /// Pivot below which the system counts as singular.
    /// @threshold [1] 1e-15..1e-6; numerical: rounding of entries near one, cancelled over some steps
    constexpr double kSingularPivot = 1e-12;
    if (!(std::abs(a[pivot][c]) > kSingularPivot)) return false;
    std::swap(a[c], a[pivot]);
    for (std::size_t r = 0; r < n; ++r) {
      if (r == c) continue;
      const double f = a[r][c] / a[c][c];
      for (std::size_t k = c; k <= n; ++k) a[r][k] -= f * a[c][k];
    }
  }
  for (std::size_t r = 0; r < n; ++r) a[r][n] /= a[r][r];
  return true;
}

}  // namespace

SelfMotion::SelfMotion(const MotionProblem& problem)
    : problem_(problem), chain_(problem.machine), scale_(speed_scale(problem)) {
  const Eigen::Index n = scale_.size();
  lo_.resize(n);
  hi_.resize(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
    lo_[j] = r.lo / scale_[j];
    hi_[j] = r.hi / scale_[j];
  }
  origin_ = scaled(problem.start);
  // The directions perpendicular to the fixed ones are found by Gram-Schmidt over the axes.
  const std::vector<Eigen::Vector3d> fixed = fixed_tip_directions(problem.machine);
  std::vector<Eigen::Vector3d> all = fixed;
  for (int axis = 0; axis < 3 && all.size() < 3; ++axis) {
    Eigen::Vector3d d = Eigen::Vector3d::Unit(axis);
    for (const Eigen::Vector3d& e : all) d -= e * e.dot(d);
    /// Length of a unit vector's remainder from which it is a new direction.
    /// @threshold [1] 0..0.57; derived: the largest of the three is at least 1/sqrt(3) = 0.58, so one is always found
    constexpr double kLeastRemainder = 0.4;
    if (d.norm() > kLeastRemainder)
      all.push_back(d.normalized());  // the largest is at least 1 / sqrt 3
  }
  basis_.resize(static_cast<Eigen::Index>(all.size() - fixed.size()), 3);
  for (std::size_t i = fixed.size(); i < all.size(); ++i) {
    basis_.row(static_cast<Eigen::Index>(i - fixed.size())) = all[i].transpose();
  }
  jacobian_.resize(basis_.rows(), n);
}

int SelfMotion::redundancy() const { return static_cast<int>(scale_.size() - basis_.rows()); }

bool SelfMotion::within_range(const VectorXd& z) const {
  for (Eigen::Index j = 0; j < z.size(); ++j) {
    if (z[j] < lo_[j] || z[j] > hi_[j]) return false;
  }
  return true;
}

void SelfMotion::derivative(const VectorXd& z) {
  const VectorXd q = joints(z);
  chain_.update(problem_.machine, q.data());
  const Tip& tip = problem_.machine.tip;
  tip_ = chain_.point(tip.joint, tip.xyz);
  for (Eigen::Index j = 0; j < z.size(); ++j) {
    const Eigen::Vector3d column =
        point_jacobian(chain_, tip.joint, tip_, static_cast<int>(j)) * scale_[j];
    for (Eigen::Index d = 0; d < basis_.rows(); ++d) {
      jacobian_(d, j) =
          basis_(d, 0) * column[0] + basis_(d, 1) * column[1] + basis_(d, 2) * column[2];
    }
  }
}

VectorXd SelfMotion::tangent() const {
  // Component j is the minor without column j, whose sign is continuous along the curve.
  const Eigen::Index n = scale_.size(), m = n - 1;
  VectorXd t(n);
  const auto at = [&](Eigen::Index row, Eigen::Index left_out, Eigen::Index c) {
    return jacobian_(row, c < left_out ? c : c + 1);
  };
  for (Eigen::Index j = 0; j < n; ++j) {
    double minor = at(0, j, 0);
    if (m == 2) minor = at(0, j, 0) * at(1, j, 1) - at(0, j, 1) * at(1, j, 0);
    if (m == 3) {
      minor = 0.0;
      for (Eigen::Index c = 0; c < 3; ++c) {
        const Eigen::Index a = (c + 1) % 3, b = (c + 2) % 3;
        minor += at(0, j, c) * (at(1, j, a) * at(2, j, b) - at(1, j, b) * at(2, j, a));
      }
    }
    t[j] = j % 2 == 0 ? minor : -minor;
  }
  const double norm = t.norm();
  if (norm > 0.0) t /= norm;
  return t;
}

bool SelfMotion::project(const Eigen::Vector3d& tip, int held, VectorXd& z) {
  const auto n = static_cast<std::size_t>(z.size());
  /// Largest number of Newton steps.
  /// @threshold [1] 5..100; chosen: near a solution each step doubles the digits
  constexpr int kNewtonSteps = 15;
  for (int i = 0; i < kNewtonSteps; ++i) {
    derivative(z);
    const Eigen::Vector3d error = tip - tip_;
    SquareSystem a{};
    double miss = 0.0;
    for (std::size_t d = 0; d + 1 < n; ++d) {
      const auto row = static_cast<Eigen::Index>(d);
      for (std::size_t j = 0; j < n; ++j) a[d][j] = jacobian_(row, static_cast<Eigen::Index>(j));
      a[d][n] = basis_.row(row).dot(error);
      miss = std::max(miss, std::abs(a[d][n]));
    }
    if (miss < kProjectionError) return true;
    if (held >= 0) {
      a[n - 1][static_cast<std::size_t>(held)] = 1.0;
    } else {
      const VectorXd t = tangent();
      for (std::size_t j = 0; j < n; ++j) a[n - 1][j] = t[static_cast<Eigen::Index>(j)];
    }
    if (!eliminate_square(a, n)) return false;
    for (std::size_t j = 0; j < n; ++j) {
      if (static_cast<int>(j) == held) continue;  // its value stays bitwise equal
      z[static_cast<Eigen::Index>(j)] += a[j][n];
    }
    if (!z.allFinite()) return false;
  }
  return false;
}

void SelfMotion::trace(const Eigen::Vector3d& tip, const VectorXd& from, double spacing,
                       double reach, std::vector<VectorXd>& samples) {
  samples.push_back(from);
  const double step = kTraceShare * spacing;
  const int steps = std::min(kMostTraceSteps, static_cast<int>(std::ceil(reach / step)));
  const auto sample_at = [&](VectorXd guess, Eigen::Index joint, double value) {
    const VectorXd before = guess;
    guess[joint] = value;
    /// Distance from its guess beyond which a projected posture belongs to another branch.
    /// @threshold [spacings] 1..10; chosen: a guess is a spacing from its neighbour, so that a projection on the same
    /// branch moves it by about as much; another branch is a joint's folding away, which is many spacings
    constexpr double kLongestStep = 2.0;
    if (project(tip, static_cast<int>(joint), guess) && within_range(guess) &&
        (guess - before).norm() < kLongestStep * spacing) {
      samples.push_back(std::move(guess));
    }
  };
  for (const double sign : {1.0, -1.0}) {
    VectorXd z = from;
    derivative(z);
    VectorXd direction = sign * tangent();
    /// Length of a traced step over the wanted one, beyond which the trace has left its branch.
    /// @threshold [steps] 1..10; chosen: a curve that turns this quickly is a singularity
    constexpr double kLongestTraceStep = 2.0;
    for (int i = 0; i < steps; ++i) {
      VectorXd next = z + step * direction;
      if (!project(tip, -1, next) || (next - z).norm() > kLongestTraceStep * step) break;
      for (Eigen::Index j = 0; j < z.size(); ++j) {
        const double cell = std::floor((z[j] - origin_[j]) / spacing),
                     other = std::floor((next[j] - origin_[j]) / spacing);
        const auto between = [&](double value) {
          if (value == z[j]) return;  // this value has been sampled
          const double share = (value - z[j]) / (next[j] - z[j]);
          sample_at(z + share * (next - z), j, value);
        };
        if (cell != other) between(origin_[j] + spacing * std::max(cell, other));
        if (next[j] > hi_[j] && z[j] < hi_[j]) between(hi_[j]);
        if (next[j] < lo_[j] && z[j] > lo_[j]) between(lo_[j]);
      }
      if (!within_range(next)) break;
      derivative(next);
      VectorXd turn = tangent();
      if (turn.dot(direction) < 0.0) turn = -turn;
      /// Steps before a closed curve is looked for.
      /// @threshold [steps] 2..20; derived: the first few are near the start on every curve
      constexpr int kStepsBeforeClosing = 4;
      // The trace of a closed curve ends where it began.
      if (i > kStepsBeforeClosing && (next - from).norm() < 0.5 * step) break;
      direction = turn;
      z = next;
    }
  }
}

}  // namespace sparflow
