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
                                        double damping, std::span<const LoadPart> parts) {
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
      while (!parts.empty() && parts.front().first < i) parts = parts.subspan(1);
      if (!parts.empty() && parts.front().first == i) {
        p = parts.front().start;
        begun = true;
      } else if (!begun) {
        if (!a.allFinite()) continue;
        p.down = now.normalized();
        begun = true;
      } else {
        p.move(pull, now, log.time[i] - log.time[i - 1], decay, frequency, kStepPhase);
      }
      pull = now;
      if (a.allFinite()) out.row(i) = rope * p.beyond_fixed(pull);
    }
  }
  return out;
}

}  // namespace sparflow
