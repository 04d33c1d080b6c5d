#include <fmt/format.h>

#include "optimizer/crane/crane_knot_model.h"

namespace sparflow {

TipAtGoal::TipAtGoal(const Machine& machine, const Eigen::Vector3d& goal)
    : machine_(&machine), chain_(machine), goal_(goal) {
  // The directions in which the tip can move are the complement of those in which it cannot.
  const std::vector<Eigen::Vector3d> fixed = fixed_tip_directions(machine);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d d = Eigen::Vector3d::Unit(axis);
    for (const Eigen::Vector3d& f : fixed) d -= f * f.dot(d);
    for (const Eigen::Vector3d& e : directions_) d -= e * e.dot(d);
    /// Length of a unit vector's remainder up to which it is no direction of its own.
    /// @threshold [1] 1e-12..0.1; numerical: rounding of the goal's free directions as a user writes them
    constexpr double kDependent = 1e-6;
    if (d.norm() > kDependent) directions_.push_back(d.normalized());
  }
}

void TipAtGoal::bounds(double* lower, double* upper) const {
  for (std::size_t i = 0; i < directions_.size(); ++i)
    lower[i] = upper[i] = directions_[i].dot(goal_);
}

std::string TipAtGoal::name(int row) const {
  const Eigen::Vector3d& d = directions_[static_cast<std::size_t>(row)];
  Eigen::Index axis = 0;
  const bool along_axis = d.cwiseAbs().maxCoeff(&axis) > 1.0 - 1e-9;
  if (along_axis)
    return fmt::format("{} of the tip at its goal ({:.4g} m)", "xyz"[axis], goal_[axis]);
  return fmt::format("tip along ({:.3f}, {:.3f}, {:.3f}) at its goal ({:.4g} m)", d.x(), d.y(),
                     d.z(), d.dot(goal_));
}

void TipAtGoal::value(const double* q, double* g) {
  chain_.update(*machine_, q);
  const Eigen::Vector3d p = chain_.point(machine_->tip.joint, machine_->tip.xyz);
  for (std::size_t i = 0; i < directions_.size(); ++i) g[i] = directions_[i].dot(p);
}

void TipAtGoal::jacobian(const double* q, double* jacobian) {
  chain_.update(*machine_, q);
  const Eigen::Vector3d p = chain_.point(machine_->tip.joint, machine_->tip.xyz);
  const int n = machine_->joint_count();
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector3d column = point_jacobian(chain_, machine_->tip.joint, p, k);
    for (std::size_t i = 0; i < directions_.size(); ++i) {
      jacobian[static_cast<std::ptrdiff_t>(i) * n + k] = directions_[i].dot(column);
    }
  }
}

void TipAtGoal::add_hessian(const double* q, const double* multiplier, double* hessian) {
  chain_.update(*machine_, q);
  const Eigen::Vector3d p = chain_.point(machine_->tip.joint, machine_->tip.xyz);
  const int n = machine_->joint_count();
  Eigen::Vector3d weight = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < directions_.size(); ++i) weight += multiplier[i] * directions_[i];
  Eigen::Map<Eigen::MatrixXd> h(hessian, n, n);
  for (int k = 0; k <= machine_->tip.joint; ++k) {
    const Eigen::Vector3d column = point_jacobian(chain_, machine_->tip.joint, p, k);
    for (int i = 0; i <= k; ++i) {
      const double value = weight.dot(point_hessian(chain_, i, column));
      h(i, k) += value;
      if (i != k) h(k, i) += value;
    }
  }
}

TipNearGoal::TipNearGoal(const Machine& machine, const Eigen::Vector3d& goal, double tolerance)
    : machine_(&machine), chain_(machine), goal_(goal), scale_(1.0 / (tolerance * tolerance)) {}

void TipNearGoal::bounds(double* lower, double* upper) const {
  lower[0] = -kNoBound;
  upper[0] = 1.0;
}

std::string TipNearGoal::name(int /*row*/) const {
  return fmt::format("distance of the tip from its stop ({:.4g}, {:.4g}, {:.4g})", goal_.x(),
                     goal_.y(), goal_.z());
}

void TipNearGoal::value(const double* q, double* g) {
  chain_.update(*machine_, q);
  const Tip& tip = machine_->tip;
  g[0] = scale_ * (chain_.point(tip.joint, tip.xyz) - goal_).squaredNorm();
}

void TipNearGoal::jacobian(const double* q, double* jacobian) {
  chain_.update(*machine_, q);
  const Tip& tip = machine_->tip;
  const Eigen::Vector3d p = chain_.point(tip.joint, tip.xyz);
  for (int k = 0; k < machine_->joint_count(); ++k)
    jacobian[k] = 2.0 * scale_ * (p - goal_).dot(point_jacobian(chain_, tip.joint, p, k));
}

void TipNearGoal::add_hessian(const double* q, const double* multiplier, double* hessian) {
  chain_.update(*machine_, q);
  const Tip& tip = machine_->tip;
  const Eigen::Vector3d p = chain_.point(tip.joint, tip.xyz);
  const int n = machine_->joint_count();
  const double factor = 2.0 * scale_ * multiplier[0];
  for (int k = 0; k <= tip.joint; ++k) {
    const Eigen::Vector3d column = point_jacobian(chain_, tip.joint, p, k);
    for (int i = 0; i <= k; ++i) {
      const double value = factor * (column.dot(point_jacobian(chain_, tip.joint, p, i)) +
                                     (p - goal_).dot(point_hessian(chain_, i, column)));
      hessian[k * n + i] += value;
      if (i != k) hessian[i * n + k] += value;
    }
  }
}

}  // namespace sparflow
