#include "identification/learning/gaussian_process/gp_screening.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// @return residuals from a least-squares quadratic of both inputs; the minimum-norm solution permits constant inputs
VectorXd quadratic_residuals(const GpPoints& p) {
  MatrixXd features(p.size(), 6);
  features << VectorXd::Ones(p.size()), p.x1, p.x2, p.x1.square(), p.x1 * p.x2, p.x2.square();
  const MatrixXd normal = transposed_product(features, features);
  const VectorXd coefficients = least_squares_of_least_norm(normal, features.transpose() * p.y);
  return p.y - features * coefficients;
}

}  // namespace

std::vector<Index> representative_points(const GpPoints& points, int cells) {
  const VectorXd residual = quadratic_residuals(points);
  const auto cell_of = [&](const ArrayXd& x) {
    const double lo = x.minCoeff(), range = x.maxCoeff() - lo;
    const double scale = range > 0.0 ? cells / range : 0.0;
    return ((x - lo) * scale).min(cells - 1.0).cast<int>().eval();
  };
  const Eigen::ArrayXi cell = cell_of(points.x1) * cells + cell_of(points.x2);
  std::vector<std::vector<Index>> members(static_cast<std::size_t>(cells * cells));
  for (Index i = 0; i < points.size(); ++i) {
    members[static_cast<std::size_t>(cell[i])].push_back(i);
  }
  std::vector<Index> chosen;
  for (std::vector<Index>& rows : members) {
    if (rows.empty()) continue;
    const auto middle = rows.begin() + static_cast<std::ptrdiff_t>((rows.size() - 1) / 2);
    std::nth_element(rows.begin(), middle, rows.end(), [&](Index a, Index b) {
      return residual[a] != residual[b] ? residual[a] < residual[b] : a < b;
    });
    chosen.push_back(*middle);
  }
  return chosen;
}

Screening screen_outliers(const GpPoints& points, const std::vector<Index>& representatives,
                          const GpHyper& hyper, double threshold, double max_fraction) {
  const GpPoints few = points.select(representatives);
  const GpPosterior posterior = exact_posterior(few, hyper);
  VectorXd residual = points.basis * posterior.beta - points.y;
  /// Points whose covariances are in memory at a time.
  /// @threshold [points] 1000..1e7; chosen: 64 MB where a hundred points represent all; the residuals do not depend on it
  constexpr Index kAtOnce = 65536;
  for (Index begin = 0; begin < points.size(); begin += kAtOnce) {
    const Index count = std::min(kAtOnce, points.size() - begin);
    residual.segment(begin, count).noalias() +=
        kernel_matrix(posterior.x1, posterior.x2, points.x1.segment(begin, count),
                      points.x2.segment(begin, count), hyper)
            .transpose() *
        posterior.weight;
  }
  residual(representatives) = leave_one_out_residuals(few, hyper);
  Screening out;
  out.robust_std = robust_std(residual);
  const double limit = threshold * out.robust_std;
  for (Index i = 0; i < points.size(); ++i) {
    if (threshold <= 0.0 || std::abs(residual[i]) <= limit) out.kept.push_back(i);
  }
  const double dropped = static_cast<double>(points.size()) - static_cast<double>(out.kept.size());
  if (dropped > max_fraction * static_cast<double>(points.size())) {
    out.too_many = true;
    out.kept.resize(static_cast<std::size_t>(points.size()));
    for (Index i = 0; i < points.size(); ++i) out.kept[static_cast<std::size_t>(i)] = i;
  }
  return out;
}

}  // namespace sparflow
