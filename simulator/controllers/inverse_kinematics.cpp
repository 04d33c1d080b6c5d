#include "simulator/controllers/inverse_kinematics.h"

#include <algorithm>

#include "models/machine/kinematics.h"

namespace sparflow::control {
namespace {

/// Steps of the search.
/// @threshold [1] 10..10000; numerical: a search that has not come near by then is at its ranges' ends
constexpr int kSteps = 300;
/// Longest way of the tip in a step.
/// @threshold [m] 0.01..1; numerical: the Jacobian holds over it
constexpr double kTipStep = 0.15;
/// Damping of the search beside the arm's own lever.
/// @threshold [1] 1e-6..0.1; numerical: keeps rates finite where the arm is stretched
constexpr double kDamping = 1e-3;

}  // namespace

Eigen::VectorXd driven_ranges(const Machine& machine) {
  Eigen::VectorXd range = Eigen::VectorXd::Zero(machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Range r = machine.joints[static_cast<std::size_t>(k)].position;
    if (machine.cylinder_of_joint(k) >= 0) range[k] = r.hi - r.lo;
  }
  return range;
}

Eigen::VectorXd weighted_rates(const Eigen::Matrix3Xd& jacobian, const Eigen::VectorXd& weights,
                               const Eigen::Vector3d& v, double damping) {
  const Eigen::MatrixXd mobility = weights.cwiseInverse().asDiagonal();
  const Eigen::Matrix3d core = jacobian * mobility * jacobian.transpose();
  const double scale = std::max(core.trace(), 1e-12);
  const Eigen::Matrix3d damped = core + damping * scale * Eigen::Matrix3d::Identity();
  return mobility * jacobian.transpose() * damped.ldlt().solve(v);
}

std::optional<Eigen::VectorXd> posture_with_tip(const Machine& machine, const Eigen::VectorXd& near,
                                                const Eigen::Vector3d& tip, double within) {
  const Eigen::VectorXd range = driven_ranges(machine);
  Eigen::VectorXd q = near;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Vector3d error = tip - tip_position<double>(machine, q);
    if (error.norm() < 0.1 * within) return q;
    if (error.norm() > kTipStep) error *= kTipStep / error.norm();
    const Eigen::Matrix3Xd jacobian =
        point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz);
    Eigen::VectorXd weights(q.size());
    for (Eigen::Index k = 0; k < q.size(); ++k)
      weights[k] = range[k] > 0.0 ? 1.0 / (range[k] * range[k]) : 1e12;
    // a joint at its range's end that the step would push further takes no part
    Eigen::VectorXd move;
    for (Eigen::Index again = 0; again <= q.size(); ++again) {
      move = weighted_rates(jacobian, weights, error, kDamping);
      bool blocked = false;
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        const Range r = machine.joints[static_cast<std::size_t>(k)].position;
        const double slack = 1e-9 * (r.hi - r.lo);
        const bool out =
            (q[k] <= r.lo + slack && move[k] < 0.0) || (q[k] >= r.hi - slack && move[k] > 0.0);
        if (!out || weights[k] >= 1e11) continue;
        weights[k] = 1e12;
        blocked = true;
      }
      if (!blocked) break;
    }
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const Range r = machine.joints[static_cast<std::size_t>(k)].position;
      if (range[k] > 0.0) q[k] = std::clamp(q[k] + move[k], r.lo, r.hi);
    }
  }
  if ((tip - tip_position<double>(machine, q)).norm() < within) return q;
  return std::nullopt;
}

}  // namespace sparflow::control
