#include "models/effects/tip_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/machine/kinematics.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Phase by which the pendulum swings in a step of integration, whose error by Runge's rule of fourth order is then 1e-7 of a
/// swing.
/// @threshold [rad] 0.01..0.5; chosen: far below the error of the tip's acceleration
constexpr double kStepPhase = 0.1;

/// A spherical pendulum of unit length below an accelerated point.
struct Pendulum {
  Vector3d down, rate;  // unit vector to the weight, its derivative [1/s]

  /// Second derivative. @param pull G = (g - a) / rope [1/s^2]
  Vector3d slope(const Vector3d& pull, double decay) const {
    return pull - down * (down.dot(pull) + rate.squaredNorm()) - 2.0 * decay * rate;
  }
  Pendulum moved(const Vector3d& by_down, const Vector3d& by_rate) const {
    return {down + by_down, rate + by_rate};
  }
  /// One step of Runge's rule while the pull changes linearly. @param decay damping times frequency [1/s]
  void step(const Vector3d& from, const Vector3d& to, double dt, double decay) {
    const Vector3d middle = 0.5 * (from + to);
    const Vector3d v1 = rate, a1 = slope(from, decay);
    const Pendulum p2 = moved(0.5 * dt * v1, 0.5 * dt * a1);
    const Vector3d v2 = p2.rate, a2 = p2.slope(middle, decay);
    const Pendulum p3 = moved(0.5 * dt * v2, 0.5 * dt * a2);
    const Vector3d v3 = p3.rate, a3 = p3.slope(middle, decay);
    const Pendulum p4 = moved(dt * v3, dt * a3);
    const Vector3d v4 = p4.rate, a4 = p4.slope(to, decay);
    down += dt / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    rate += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    down.normalize();
    rate -= down * down.dot(rate);
  }
};

}  // namespace

TipMotion tip_motion(const MachineSeries& log) {
  const Machine& machine = *log.machine;
  const int n = machine.joint_count();
  TipMotion out;
  out.acceleration.setConstant(log.samples(), 3, std::nan(""));
  out.jacobian.setConstant(log.samples(), Index{3} * n, std::nan(""));
  ChainGeometry chain(machine);
  Eigen::VectorXd q(n);
  std::vector<Vector3d> jacobian(static_cast<std::size_t>(n));
  for (Index row = 0; row < log.samples(); ++row) {
    q = log.q.row(row);
    if (!q.allFinite()) continue;
    chain.update(machine, q.data());
    const Vector3d tip = chain.point(machine.tip.joint, machine.tip.xyz);
    Vector3d a = Vector3d::Zero();
    for (int k = 0; k < n; ++k) {
      Vector3d& column = jacobian[static_cast<std::size_t>(k)];
      column = point_jacobian(chain, machine.tip.joint, tip, k);
      a += column * log.qdd(row, k);
      for (int i = 0; i <= k; ++i) {
        const double twice = i < k ? 2.0 : 1.0;
        a += point_hessian(chain, i, column) * (twice * log.qd(row, i) * log.qd(row, k));
      }
      out.jacobian.block<1, 3>(row, Index{3} * k) = column.transpose();
    }
    out.acceleration.row(row) = a;
  }
  return out;
}

Eigen::MatrixX3d pull_of_hanging_weight(const MachineSeries& log,
                                        const Eigen::MatrixX3d& acceleration, double rope,
                                        double damping) {
  const Vector3d gravity = log.machine->gravity;
  const double frequency = std::sqrt(gravity.norm() / rope), decay = damping * frequency;
  Eigen::MatrixX3d out =
      Eigen::MatrixX3d::Constant(log.samples(), 3, std::numeric_limits<double>::quiet_NaN());
  for (const auto& [first, last] : log.runs) {
    Vector3d pull = gravity / rope;
    Pendulum p{pull.normalized(), Vector3d::Zero()};
    bool begun = false;
    for (Index i = first; i < last; ++i) {
      const Vector3d a = acceleration.row(i);
      const Vector3d now = a.allFinite() ? Vector3d((gravity - a) / rope) : pull;
      if (!begun) {
        if (!a.allFinite()) continue;
        p.down = now.normalized();
        begun = true;
      } else {
        const double dt = log.time[i] - log.time[i - 1];
        const int steps = std::max(1, static_cast<int>(std::ceil(dt * frequency / kStepPhase)));
        for (int s = 0; s < steps; ++s) {
          const double from = static_cast<double>(s) / steps,
                       to = static_cast<double>(s + 1) / steps;
          p.step((1.0 - from) * pull + from * now, (1.0 - to) * pull + to * now, dt / steps, decay);
        }
      }
      pull = now;
      if (!a.allFinite()) continue;
      out.row(i) = rope * (pull - p.down * (p.down.dot(pull) + p.rate.squaredNorm()));
    }
  }
  return out;
}

}  // namespace sparflow
