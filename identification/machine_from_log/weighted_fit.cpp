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

namespace {

/// The directions that rows determine, in coordinates in which their information is the identity.
struct Determined {
  MatrixXd to;    ///< [parameters x directions] parameters of unit coordinates
  VectorXd lost;  ///< by parameter: 1 where a direction without information takes part
};

Determined determined_by(const MatrixXd& jacobian) {
  const Index p = jacobian.cols();
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
  Index rank = 0;
  for (Index k = 0; k < p; ++k) rank += eigen.eigenvalues()[k] > 10.0 * kRounding;
  Determined out{MatrixXd(p, rank), VectorXd::Zero(p)};
  for (Index k = 0; k < p; ++k) {
    const VectorXd direction = eigen.eigenvectors().col(k);
    if (eigen.eigenvalues()[k] <= 10.0 * kRounding) {
      for (Index i = 0; i < p; ++i)
        if (direction[i] * direction[i] > kRounding) out.lost[i] = 1.0;
      continue;
    }
    // Eigenvalues ascend: those that are kept are the last.
    out.to.col(k - (p - rank)) =
        (direction / std::sqrt(eigen.eigenvalues()[k])).cwiseQuotient(scale);
  }
  return out;
}

/// Variance of the coordinates by leaving out each cluster, and by the known variance of priors.
MatrixXd jackknife(const WeightedRows& rows, const MatrixXd& unit, int longer, double& clusters) {
  const Index r = unit.cols();
  struct Cluster {
    MatrixXd information;
    VectorXd score;
  };
  std::map<int, Cluster> all;
  MatrixXd variance = MatrixXd::Zero(r, r);
  for (Index k = 0; k < unit.rows(); ++k) {
    const VectorXd row = unit.row(k).transpose();
    if (rows.block[k] < 0) {
      variance += rows.prior_weight * row * row.transpose();
      continue;
    }
    Cluster& c =
        all.try_emplace(rows.block[k] / longer, Cluster{MatrixXd::Zero(r, r), VectorXd::Zero(r)})
            .first->second;
    c.information += row * row.transpose();
    c.score += rows.residual[k] * row;
  }
  clusters = static_cast<double>(all.size());
  /// Information that an estimate keeps in each direction when a cluster is left out, as share of all.
  /// @threshold [-] 1e-9..0.01; numerical: what one cluster alone determines gets a very wide interval, not an infinite one
  constexpr double kKept = 1e-4;
  for (const auto& [b, c] : all) {
    MatrixXd left = MatrixXd::Identity(r, r) * (1.0 + kKept) - c.information;
    const VectorXd change = left.ldlt().solve(c.score);
    variance += (clusters - 1.0) / clusters * change * change.transpose();
  }
  return variance;
}

}  // namespace

double Intervals::half_of(const VectorXd& weights) const {
  double largest = 0.0;
  for (const MatrixXd& s : squared) largest = std::max(largest, weights.dot(s * weights));
  return std::sqrt(largest);
}

Intervals intervals_of(const WeightedRows& rows, const std::vector<int>& longer) {
  const Index p = rows.jacobian.cols();
  Intervals out;
  const double unknown = std::numeric_limits<double>::infinity();
  out.half = VectorXd::Constant(p, unknown);
  if (rows.jacobian.rows() <= p || p == 0) {
    out.squared.push_back(MatrixXd::Zero(p, p));
    return out;
  }
  const Determined determined = determined_by(rows.jacobian);
  const MatrixXd unit = rows.jacobian * determined.to;
  const double excess =
      std::max(1.0, rows.residual.squaredNorm() / static_cast<double>(rows.residual.size() - p));
  const auto square = [](double x) { return x * x; };
  double most = 1.0;
  for (const int length : longer) {
    double clusters = 0.0;
    const MatrixXd variance = jackknife(rows, unit, length, clusters);
    most = std::max(most, clusters);
    if (clusters < 2.0) continue;
    out.squared.push_back(square(t_quantile(clusters - 1.0)) * determined.to * variance *
                          determined.to.transpose());
  }
  out.squared.push_back(square(t_quantile(std::max(1.0, most - 1.0))) * excess * determined.to *
                        determined.to.transpose());
  for (Index k = 0; k < p; ++k)
    if (determined.lost[k] == 0.0) out.half[k] = out.half_of(VectorXd::Unit(p, k));
  return out;
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
