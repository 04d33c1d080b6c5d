#include "identification/learning/find_branch_corner.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/hydraulics/return_rise.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Largest number of samples; more would only increase the computing time.
constexpr Index kEnough = 800;
/// Largest number of rounds of fit and assignment from one initial corner; most settle earlier.
constexpr int kRounds = 20;

/// Samples with the flow scaled by its maximum; load over the supply area and pressure in Pa.
struct Samples {
  ArrayXd flow, load, pressure;
  Index size() const { return flow.size(); }
};

/// V = valve.(1, q, load), S = load + line.(1, q)
struct Branches {
  Eigen::Vector3d valve = Eigen::Vector3d::Zero();
  Eigen::Vector2d line = Eigen::Vector2d::Zero();
  double valve_at(const Samples& s, Index k) const {
    return valve[0] + valve[1] * s.flow[k] + valve[2] * s.load[k];
  }
  double line_at(const Samples& s, Index k) const {
    return s.load[k] + line[0] + line[1] * s.flow[k];
  }
};

/// Fits the static branch to the samples with `on_line` and the valve's to the others.
/// @return false when one branch has too few samples
bool fit_branches(const Samples& s, const std::vector<char>& on_line, Index fewest, Branches& out) {
  const auto lines = static_cast<Index>(std::count(on_line.begin(), on_line.end(), 1));
  const Index valves = s.size() - lines;
  if (lines < fewest || valves < fewest) return false;
  MatrixXd x_line(lines, 2), x_valve(valves, 3);
  VectorXd y_line(lines), y_valve(valves);
  for (Index k = 0, l = 0, v = 0; k < s.size(); ++k) {
    if (on_line[static_cast<std::size_t>(k)]) {
      x_line.row(l) << 1.0, s.flow[k];
      y_line[l++] = s.pressure[k] - s.load[k];
    } else {
      x_valve.row(v) << 1.0, s.flow[k], s.load[k];
      y_valve[v++] = s.pressure[k];
    }
  }
  out.line = least_squares(x_line, y_line);
  out.valve = least_squares(x_valve, y_valve);
  const double slope = std::clamp(out.valve[2], 0.0, return_rise::kSteepestValve);
  if (slope != out.valve[2]) {
    y_valve -= slope * x_valve.col(2);
    out.valve.head<2>() = least_squares(x_valve.leftCols(2), y_valve);
    out.valve[2] = slope;
  }
  return true;
}

double squared_error(const Samples& s, const Branches& b) {
  double sum = 0.0;
  for (Index k = 0; k < s.size(); ++k)
    sum += std::pow(s.pressure[k] - std::max(b.valve_at(s, k), b.line_at(s, k)), 2);
  return sum;
}

/// @return squared error of a quadratic law of flow and load
double smooth_error(const Samples& s) {
  MatrixXd x(s.size(), 6);
  const double scale = std::max(1.0, s.load.abs().maxCoeff());
  const ArrayXd load = s.load / scale;
  x << ArrayXd::Ones(s.size()), s.flow, s.flow.square(), load, load.square(), s.flow * load;
  return (s.pressure.matrix() - x * least_squares(x, s.pressure.matrix())).squaredNorm();
}

Samples thinned_samples(const GpDataset& all, double supply, int side, double flow_scale) {
  std::vector<Index> rows;
  const Index step = std::max<Index>(1, (all.flow.size() + kEnough - 1) / kEnough);
  rows.reserve(static_cast<std::size_t>(all.flow.size() / step + 1));
  for (Index k = step / 2; k < all.flow.size(); k += step) rows.push_back(k);
  return {all.flow(rows) / flow_scale, side * all.force(rows) / supply, all.pressure(rows)};
}

}  // namespace

BranchCorner find_branch_corner(const GpDataset& samples, const Cylinder& cylinder, int side,
                                const BranchCornerOptions& options) {
  const double supply = side > 0 ? cylinder.area_piston() : cylinder.area_rod();
  const double flow_scale = samples.flow.size() > 0 ? samples.flow.maxCoeff() : 0.0;
  if (!(flow_scale > 0.0)) return {};
  const Samples s = thinned_samples(samples, supply, side, flow_scale);
  if (s.size() < 2 * options.fewest) return {};
  Branches best;
  double least = options.clearly * smooth_error(s);
  bool found = false;
  std::vector<char> on_line(static_cast<std::size_t>(s.size()));
  // Initial corners, spread over the range of the load.
  for (const double at : {0.1, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95}) {
    const double lo = s.load.minCoeff(), hi = s.load.maxCoeff();
    for (Index k = 0; k < s.size(); ++k)
      on_line[static_cast<std::size_t>(k)] = s.load[k] > lo + at * (hi - lo);
    Branches b;
    for (int round = 0; round < kRounds && fit_branches(s, on_line, options.fewest, b); ++round) {
      const double error = squared_error(s, b);
      if (error < least) {
        least = error;
        best = b;
        found = true;
      }
      for (Index k = 0; k < s.size(); ++k)
        on_line[static_cast<std::size_t>(k)] = b.line_at(s, k) > b.valve_at(s, k);
    }
  }
  if (!found) return {};
  return {best.line[0] - best.valve[0], (best.line[1] - best.valve[1]) / flow_scale,
          side * (1.0 - best.valve[2]) / supply};
}

}  // namespace sparflow
