#include "models/hydraulics/engine_map.h"

#include <algorithm>

namespace sparflow {
namespace {

using Eigen::Index;

/// The interval of an ascending grid in which x lies, and the share of it; a grid of one value has share 0.
std::pair<Index, double> place_in(const Eigen::VectorXd& grid, double x) {
  if (grid.size() < 2) return {0, 0.0};
  const double* end = grid.data() + grid.size();
  const double* after = std::upper_bound(grid.data(), end, x);
  const Index i = std::clamp<Index>(after - grid.data() - 1, 0, grid.size() - 2);
  return {i, (x - grid[i]) / (grid[i + 1] - grid[i])};
}

}  // namespace

double EngineMap::efficiency_at(double p, double q) const {
  auto [i, a] = place_in(pressure, p);
  auto [j, b] = place_in(flow, q);
  a = std::clamp(a, 0.0, 1.0);
  b = std::clamp(b, 0.0, 1.0);
  const Index i1 = std::min(i + 1, efficiency.rows() - 1);
  const Index j1 = std::min(j + 1, efficiency.cols() - 1);
  return (1.0 - a) * ((1.0 - b) * efficiency(i, j) + b * efficiency(i, j1)) +
         a * ((1.0 - b) * efficiency(i1, j) + b * efficiency(i1, j1));
}

double EngineMap::shaft_power(double p, double q) const {
  if (q == 0.0 || p <= 0.0) return 0.0;
  return p * q / efficiency_at(p, q);
}

double EngineMap::fuel_rate(double shaft) const {
  if (power.size() < 2) return fuel[0];
  const auto [i, share] = place_in(power, shaft);
  return fuel[i] + std::max(share, 0.0) * (fuel[i + 1] - fuel[i]);
}

double fuel_of(const EngineMap& map, const PumpTrace& trace) {
  const auto rate = [&](Index k) {
    double shaft = 0.0;
    for (Index p = 0; p < trace.flow.cols(); ++p)
      if (trace.flow(k, p) != 0.0) shaft += map.shaft_power(trace.pressure(k, p), trace.flow(k, p));
    return map.fuel_rate(shaft);
  };
  double fuel = 0.0;
  double before = trace.t.size() > 0 ? rate(0) : 0.0;
  for (Index k = 1; k < trace.t.size(); ++k) {
    const double now = rate(k);
    fuel += 0.5 * (before + now) * (trace.t[k] - trace.t[k - 1]);
    before = now;
  }
  return fuel;
}

}  // namespace sparflow
