#include "identification/learning/gaussian_process/box_bfgs.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Component i is held: it lies on a bound and descent would leave the box.
bool held(const VectorXd& x, const VectorXd& gradient, const VectorXd& lower, const VectorXd& upper,
          Eigen::Index i) {
  return (x[i] <= lower[i] && gradient[i] > 0.0) || (x[i] >= upper[i] && gradient[i] < 0.0);
}

/// Quasi-Newton direction in the free components, steepest descent if that is no descent.
VectorXd direction(const MatrixXd& inverse_hessian, const VectorXd& gradient,
                   const Eigen::Array<bool, Eigen::Dynamic, 1>& is_held) {
  MatrixXd h = inverse_hessian;
  VectorXd g = gradient;
  for (Eigen::Index i = 0; i < g.size(); ++i) {
    if (!is_held[i]) continue;
    h.row(i).setZero();
    h.col(i).setZero();
    g[i] = 0.0;
  }
  const VectorXd d = -(h * g);
  return d.dot(g) < -1e-12 * d.norm() * g.norm() ? d : VectorXd(-g);
}

}  // namespace

BoxBfgsResult minimise_in_box(const std::function<double(const VectorXd&, VectorXd&)>& function,
                              const VectorXd& start, const VectorXd& lower, const VectorXd& upper,
                              const BoxBfgsOptions& options) {
  const Eigen::Index n = start.size();
  BoxBfgsResult r;
  r.x = start.cwiseMax(lower).cwiseMin(upper);
  r.gradient = VectorXd::Zero(n);
  r.value = function(r.x, r.gradient);
  r.evaluations = 1;
  MatrixXd inverse_hessian = MatrixXd::Identity(n, n);
  bool scaled = false;
  VectorXd x_new(n), gradient_new(n);
  Eigen::Array<bool, Eigen::Dynamic, 1> is_held(n);
  int flat = 0;
  for (; std::isfinite(r.value) && r.iterations < options.max_iterations; ++r.iterations) {
    double largest = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      is_held[i] = held(r.x, r.gradient, lower, upper, i);
      if (!is_held[i]) largest = std::max(largest, std::abs(r.gradient[i]));
    }
    if (largest < options.gradient_tolerance) {
      r.converged = true;
      break;
    }
    VectorXd d = direction(inverse_hessian, r.gradient, is_held);
    d *= std::min(1.0, (scaled ? options.max_step : 0.5) / d.cwiseAbs().maxCoeff());
    double value_new = r.value;
    bool accepted = false;
    for (double t = 1.0; t > 1e-8 && !accepted; t *= 0.4) {
      x_new = (r.x + t * d).cwiseMax(lower).cwiseMin(upper);
      value_new = function(x_new, gradient_new);
      ++r.evaluations;
      accepted = std::isfinite(value_new) && gradient_new.allFinite() &&
                 value_new <= r.value + 1e-4 * r.gradient.dot(x_new - r.x);
    }
    if (!accepted) {
      if (!scaled || inverse_hessian.isIdentity()) break;
      inverse_hessian.setIdentity();  // a stale curvature: once more along the gradient
      scaled = false;
      continue;
    }
    const VectorXd s = x_new - r.x, y = gradient_new - r.gradient;
    const double decrease = r.value - value_new;
    r.x = x_new;
    r.value = value_new;
    r.gradient = gradient_new;
    const double sy = s.dot(y);
    if (sy > 1e-10 * s.norm() * y.norm()) {
      if (!scaled) inverse_hessian = MatrixXd::Identity(n, n) * (sy / y.squaredNorm());
      scaled = true;
      const MatrixXd left = MatrixXd::Identity(n, n) - s * y.transpose() / sy;
      inverse_hessian =
          product(product(left, inverse_hessian), left.transpose()) + s * s.transpose() / sy;
    }
    // Twice in a row, since one short step may only be a poor line search.
    flat = decrease < options.value_tolerance * (1.0 + std::abs(r.value)) ? flat + 1 : 0;
    if (flat == 2) {
      r.converged = true;
      ++r.iterations;
      break;
    }
  }
  return r;
}

}  // namespace sparflow
