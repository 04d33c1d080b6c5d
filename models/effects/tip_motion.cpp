#include "models/effects/tip_motion.h"

#include <cmath>
#include <vector>

#include "models/machine/kinematics.h"

namespace sparflow {

using Eigen::Index;
using Eigen::Vector3d;

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

}  // namespace sparflow
