#include "identification/machine_from_log/weighted_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "models/math/linear_algebra.h"

namespace sparflow::from_log {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Share of a parameter's size by which numeric derivatives step.
/// @threshold [1] 1e-9..1e-4; numerical: the root of a double's precision
constexpr double kStep = 1e-7;

bool jacobian_at(const Residuals& residuals, const VectorXd& theta, const VectorXd& scale,
                 MatrixXd& jacobian) {
  VectorXd up, down;
  for (Index p = 0; p < theta.size(); ++p) {
    VectorXd moved = theta;
    const double h = kStep * scale[p];
    moved[p] = theta[p] + h;
    if (!residuals(moved, up)) return false;
    moved[p] = theta[p] - h;
    if (!residuals(moved, down)) return false;
    if (jacobian.rows() != up.size()) jacobian.resize(up.size(), theta.size());
    jacobian.col(p) = (up - down) / (2.0 * h);
  }
  return true;
}

}  // namespace

double t_quantile(double degrees) {
  const double n = std::max(degrees, 1.0);
  constexpr double z = 1.959964;  // no threshold: mathematics
  return z + (z * z * z + z) / (4.0 * n) +
         (5.0 * std::pow(z, 5) + 16.0 * z * z * z + 3.0 * z) / (96.0 * n * n);
}

VectorXd half_widths(const MatrixXd& jacobian, const VectorXd& residual,
                     const Eigen::VectorXi& block, MatrixXd* covariance) {
  const Index p = jacobian.cols();
  const double unknown = std::numeric_limits<double>::infinity();
  if (jacobian.rows() <= p || p == 0) return VectorXd::Constant(p, unknown);
  VectorXd scale(p);
  for (Index k = 0; k < p; ++k) {
    scale[k] = jacobian.col(k).norm();
    if (!(scale[k] > 0.0)) scale[k] = 1.0;
  }
  const MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(transposed_product(scaled, scaled));
  /// Smallest eigenvalue of the scaled information that is not rounding.
  /// @threshold [1] 1e-16..1e-8; numerical: sums of products of thousands of rows
  constexpr double kRounding = 1e-12;
  const VectorXd values = eigen.eigenvalues().cwiseMax(kRounding);
  const MatrixXd inverse =
      eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  std::map<int, VectorXd> score;
  for (Index k = 0; k < residual.size(); ++k) {
    VectorXd& s = score.try_emplace(block[k], VectorXd::Zero(p)).first->second;
    s += residual[k] * scaled.row(k).transpose();
  }
  MatrixXd meat = MatrixXd::Zero(p, p);
  for (const auto& [b, s] : score) meat += s * s.transpose();
  const auto blocks = static_cast<double>(score.size());
  const double spare = std::max(blocks - static_cast<double>(p), 1.0);
  const double excess =
      std::max(1.0, residual.squaredNorm() / static_cast<double>(residual.size() - p));
  MatrixXd cov = blocks / spare * inverse * meat * inverse;
  for (Index k = 0; k < p; ++k) {
    // The larger variance, with the correlations of the blocks.
    const double factor =
        std::sqrt(std::max(1.0, excess * inverse(k, k) / std::max(cov(k, k), 1e-300)));
    cov.row(k) *= factor;
    cov.col(k) *= factor;
  }
  VectorXd half(p);
  for (Index k = 0; k < p; ++k) {
    half[k] = t_quantile(spare) * std::sqrt(std::max(cov(k, k), 0.0)) / scale[k];
    // A direction without information has no finite interval.
    const bool lost = (eigen.eigenvectors().row(k).transpose().array().square() *
                       (eigen.eigenvalues().array() < kRounding).cast<double>())
                          .sum() > kRounding;
    if (lost) half[k] = unknown;
  }
  if (covariance != nullptr) {  // without the directions that the rows do not determine
    VectorXd determined = values.cwiseInverse();
    for (Index k = 0; k < p; ++k) {
      if (eigen.eigenvalues()[k] <= 10.0 * kRounding) determined[k] = 0.0;
    }
    const MatrixXd part =
        eigen.eigenvectors() * determined.asDiagonal() * eigen.eigenvectors().transpose();
    const MatrixXd independent = excess * part, sandwich = blocks / spare * part * meat * part;
    *covariance = scale.cwiseInverse().asDiagonal() *
                  MatrixXd(sandwich.trace() > independent.trace() ? sandwich : independent) *
                  scale.cwiseInverse().asDiagonal();
  }
  return half;
}

CurveFit fit_curve(const Residuals& residuals, const VectorXd& start, const VectorXd& scale,
                   int iterations) {
  CurveFit fit;
  fit.theta = start;
  if (!residuals(fit.theta, fit.residual)) return fit;
  fit.cost = 0.5 * fit.residual.squaredNorm();
  fit.defined = std::isfinite(fit.cost) && jacobian_at(residuals, fit.theta, scale, fit.jacobian) &&
                fit.jacobian.allFinite();
  if (!fit.defined) return fit;
  double damping = 1e-3;  // no threshold: it adapts
  for (int i = 0; i < iterations; ++i) {
    const VectorXd gradient = fit.jacobian.transpose() * fit.residual;
    MatrixXd normal = transposed_product(fit.jacobian, fit.jacobian);
    const VectorXd diagonal = normal.diagonal().cwiseMax(1e-300);
    normal.diagonal() += damping * diagonal;
    const VectorXd step = -solve_symmetric(normal, gradient);
    VectorXd residual;
    const VectorXd next = fit.theta + step;
    const bool defined = step.allFinite() && residuals(next, residual);
    const double cost = defined ? 0.5 * residual.squaredNorm() : 0.0;
    MatrixXd jacobian;
    if (!defined || !(cost < fit.cost) || !jacobian_at(residuals, next, scale, jacobian) ||
        !jacobian.allFinite()) {
      damping *= 10.0;
      if (damping > 1e12) break;
      continue;
    }
    const bool done = fit.cost - cost < 1e-10 * fit.cost;
    fit.theta = next;
    fit.residual = residual;
    fit.jacobian = jacobian;
    fit.cost = cost;
    damping = std::max(damping * 0.2, 1e-12);
    if (done) break;
  }
  return fit;
}

}  // namespace sparflow::from_log
