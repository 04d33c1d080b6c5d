#include "apps/report/charts/working_area.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// Returns the smallest of 0.05, 0.1, 0.2, 0.5, 1, ... m that is at least `width` [m].
double round_width(double width) {
  double decade = 0.01;
  while (true) {
    for (const double step : {1.0, 2.0, 5.0}) {
      if (decade * step >= 0.05 - 1e-9 && decade * step >= width) return decade * step;
    }
    decade *= 10.0;
  }
}

Eigen::VectorXd edges(double lo, double hi, double width) {
  const double first = std::floor(lo / width);
  const auto count = static_cast<Index>(std::floor(hi / width) - first) + 1;
  Eigen::VectorXd at(count + 1);
  for (Index i = 0; i <= count; ++i) at[i] = (first + static_cast<double>(i)) * width;
  return at;
}

}  // namespace

HeatMap rms_over_working_area(const std::vector<Eigen::Vector2d>& tip,
                              const Eigen::VectorXd& residual, int cells, int least_samples) {
  SPARFLOW_CHECK(static_cast<Index>(tip.size()) == residual.size(), "one residual a tip position");
  SPARFLOW_CHECK(cells > 0, "at least one cell");
  HeatMap map;
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Eigen::Vector2d lo(kInf, kInf), hi(-kInf, -kInf);
  std::vector<Index> used;
  for (Index i = 0; i < residual.size(); ++i) {
    const Eigen::Vector2d& p = tip[static_cast<std::size_t>(i)];
    if (!p.allFinite() || !std::isfinite(residual[i])) continue;
    used.push_back(i);
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  if (used.empty()) return map;
  const double width = round_width((hi - lo).maxCoeff() / cells);
  map.x_edges = edges(lo.x(), hi.x(), width);
  map.z_edges = edges(lo.y(), hi.y(), width);
  const Index rows = map.z_edges.size() - 1, columns = map.x_edges.size() - 1;
  map.counts.setZero(rows, columns);
  map.values.setZero(rows, columns);
  for (const Index i : used) {
    const Eigen::Vector2d& p = tip[static_cast<std::size_t>(i)];
    const auto cell = [&](double value, const Eigen::VectorXd& at, Index count) {
      return std::clamp<Index>(static_cast<Index>(std::floor((value - at[0]) / width)), 0,
                               count - 1);
    };
    const Index row = cell(p.y(), map.z_edges, rows), column = cell(p.x(), map.x_edges, columns);
    map.counts(row, column) += 1.0;
    map.values(row, column) += residual[i] * residual[i];
  }
  for (Index r = 0; r < rows; ++r) {
    for (Index c = 0; c < columns; ++c) {
      double& value = map.values(r, c);
      value = map.counts(r, c) >= least_samples ? std::sqrt(value / map.counts(r, c))
                                                : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return map;
}

}  // namespace sparflow
