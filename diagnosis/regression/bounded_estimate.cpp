#include "diagnosis/regression/bounded_estimate.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

ParameterBounds bounds_of(const std::vector<const EffectDesign*>& designs) {
  Index count = 0;
  for (const EffectDesign* d : designs) count += d->linear;
  ParameterBounds b{VectorXd(count), VectorXd(count)};
  Index k = 0;
  for (const EffectDesign* d : designs) {
    for (std::size_t i = 0; i < d->lower.size(); ++i) {
      b.lower[k] = d->lower[i];
      b.upper[k++] = d->upper[i];
    }
  }
  return b;
}

VectorXd solve_bounded(const MatrixXd& n, const VectorXd& g, const ParameterBounds& b,
                       bool* at_bound) {
  const Index m = g.size();
  if (m == 0) return g;
  // scaled by curvature, because parameters differ by many orders of magnitude
  VectorXd scale(m);
  for (Index i = 0; i < m; ++i) scale[i] = n(i, i) > 0.0 ? 1.0 / std::sqrt(n(i, i)) : 0.0;
  MatrixXd h = scale.asDiagonal() * n * scale.asDiagonal();
  h.diagonal().array() += 1e-10;
  const VectorXd gs = scale.cwiseProduct(g);
  VectorXd x = solve_symmetric(h, gs);
  const auto lower = [&](Index i) { return scale[i] > 0.0 ? b.lower[i] / scale[i] : 0.0; };
  const auto upper = [&](Index i) { return scale[i] > 0.0 ? b.upper[i] / scale[i] : 0.0; };
  bool outside = false;
  for (Index i = 0; i < m; ++i) outside = outside || x[i] < lower(i) || x[i] > upper(i);
  if (at_bound != nullptr) *at_bound = outside;
  if (outside) {
    for (Index i = 0; i < m; ++i) x[i] = std::clamp(x[i], lower(i), upper(i));
    for (int sweep = 0; sweep < 500; ++sweep) {
      double moved = 0.0;
      for (Index i = 0; i < m; ++i) {
        const double next =
            std::clamp(x[i] + (gs[i] - h.row(i).dot(x)) / h(i, i), lower(i), upper(i));
        moved = std::max(moved, std::abs(next - x[i]));
        x[i] = next;
      }
      if (moved < 1e-9 * (1.0 + x.norm())) break;
    }
  }
  return scale.cwiseProduct(x);
}

}  // namespace sparflow
