#include "identification/learning/learn_loads_beyond.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/hydraulics/return_rise.h"
#include "models/math/linear_algebra.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

/// @return share of an additional load that raises the supply pressure, by the branch that the slope indicates: 1 on the
///   static branch, else the valve's
double branch_share(double slope) {
  const double on_static =
      std::clamp((slope - return_rise::kSteepestValve) /
                     (return_rise::kFlattestLoad - return_rise::kSteepestValve),
                 0.0, 1.0);
  return on_static + (1.0 - on_static) * std::clamp(slope, 0.0, return_rise::kSteepestValve);
}

double supply_area(const Cylinder& cylinder, int side) {
  return side > 0 ? cylinder.area_piston() : cylinder.area_rod();
}

/// @return the same share by the level of the pressure above the load, for samples that show no slope
double share_on_static(const GpDataset& samples, double supply, int side) {
  const ArrayXd excess = samples.pressure - side * samples.force / supply;
  const double above = quantile(excess.matrix(), 0.5);
  return 1.0 / (1.0 + std::exp((above - return_rise::kValveFrom) / return_rise::kValveSpread));
}

/// Share of an additional load that raises the supply pressure, with its standard deviation.
struct Share {
  double value = 0.0, deviation = 0.0;
};

/// Estimates the share by regression of pressure on load, both after removing a parabola over the flow. Friction and
/// dynamics correlate the errors of a motion, so at most LoadsBeyondOptions::worth samples count as independent.
Share share_in(const GpDataset& samples, double supply, int side,
               const LoadsBeyondOptions& options) {
  // A share lies between 0 and 1: the first deviation says nothing about it, the second is as good as exact.
  constexpr double kUnknown = 1e3, kExact = 1e-3;
  const Index n = samples.force.size();
  const double largest_flow = samples.flow.abs().maxCoeff();
  constexpr Index kCoefficients = 4;  // of the flow and of the load
  if (n <= kCoefficients || !(largest_flow > 0.0)) return {0.0, kUnknown};
  const ArrayXd flow = samples.flow / largest_flow;
  Eigen::MatrixXd by_flow(n, 3);
  by_flow << ArrayXd::Ones(n), flow, flow.square();
  const auto beside_flow = [&](const Eigen::VectorXd& y) -> Eigen::VectorXd {
    return y - by_flow * least_squares_of_least_norm(by_flow, y);
  };
  const Eigen::VectorXd load = beside_flow(side / supply * samples.force.matrix());
  const Eigen::VectorXd pressure = beside_flow(samples.pressure.matrix());
  const double spread = load.squaredNorm();
  if (!(spread > options.no_spread * options.no_spread * static_cast<double>(n)))
    return {0.0, kUnknown};
  const double share = load.dot(pressure) / spread;
  const double worth = std::min(1.0, options.worth / static_cast<double>(n));
  const double left =
      (pressure - share * load).squaredNorm() / static_cast<double>(n - kCoefficients);
  return {share, std::max(kExact, std::sqrt(left / (worth * spread)))};
}

/// Combines two independent estimates by inverse-variance weighting.
Share together(const Share& a, const Share& b) {
  const double of_a = 1.0 / (a.deviation * a.deviation), of_b = 1.0 / (b.deviation * b.deviation);
  return {(of_a * a.value + of_b * b.value) / (of_a + of_b), 1.0 / std::sqrt(of_a + of_b)};
}

}  // namespace

std::optional<SimilarLoads> similar_loads(const GpDataset& samples, const Cylinder& cylinder,
                                          int side, const LoadsBeyondOptions& options) {
  if (samples.force.size() == 0) return {};
  const double supply = supply_area(cylinder, side);
  const double span = samples.force.maxCoeff() - samples.force.minCoeff();
  if (span >= options.similar_loads * supply) return {};
  const double usual = share_on_static(samples, supply, side);
  const Share known{usual, std::max(options.surest_share, std::sqrt(usual * (1.0 - usual)))};
  const Share share = together(known, share_in(samples, supply, side, options));
  return SimilarLoads{median(samples.force.matrix()),
                      side * std::clamp(share.value, 0.0, 1.0) / supply, share.deviation / supply};
}

GpDataset at_one_load(GpDataset samples, const SimilarLoads& loads) {
  samples.pressure -= loads.slope * (samples.force - loads.force);
  samples.force.setConstant(loads.force);
  return samples;
}

GpParameters for_any_load(GpParameters learned, const SimilarLoads& loads,
                          const GpDataset& samples) {
  // The length-scale exceeds any load, so that the learned dependence on the flow holds at every force.
  constexpr double kEndless = 1e9;  // [N]
  learned.length_force = kEndless;
  learned.mean_constant -= (loads.slope - learned.mean_slope) * loads.force;
  learned.mean_slope = loads.slope;
  learned.force_min = samples.force.minCoeff();
  learned.force_max = samples.force.maxCoeff();
  const Eigen::Index n = learned.weight.size();
  if (learned.variance_core.size() > 0) {
    const double open = loads.slope_deviation * loads.slope_deviation;
    learned.variance_core(n, n) -= open * loads.force * loads.force;
    learned.variance_core(n, n + 1) += open * loads.force;
    learned.variance_core(n + 1, n) += open * loads.force;
    learned.variance_core(n + 1, n + 1) -= open;
  }
  return learned;
}

LoadsBeyond learn_loads_beyond(const GpParameters& parameters, const GpDataset& samples,
                               const Cylinder& cylinder, int side,
                               const LoadsBeyondOptions& options) {
  LoadsBeyond out;
  const double supply = supply_area(cylinder, side), other = supply_area(cylinder, -side);
  out.side = side;
  out.static_slope = 1.0 / supply;
  const ArrayXd load = side * samples.force;
  const ArrayXd excess = samples.pressure - load / supply;
  const double lightest = side > 0 ? parameters.force_min : -parameters.force_max;
  const double heaviest = side > 0 ? parameters.force_max : -parameters.force_min;
  out.static_level = std::clamp(quantile(excess.matrix(), options.static_quantile), 0.0,
                                other / supply * return_rise::kReturnLine);
  out.least = std::clamp(quantile(samples.pressure.matrix(), options.least_quantile), 0.0,
                         options.largest_least);
  const double seen = heaviest - lightest;
  if (seen < return_rise::kLeastSeen * supply) {
    out.slope_heavier = out.slope_lighter =
        share_on_static(samples, supply, side) * out.static_slope;
    return out;
  }
  const GaussianProcess process(parameters);
  const double width =
      std::min(seen, std::max(options.border_share * seen, return_rise::kLeastLoad * supply));
  const auto slope_from = [&](double from) {  // [Pa/N] between from and from + width
    std::vector<double> flows;
    for (Index k = 0; k < load.size(); ++k) {
      if (load[k] >= from && load[k] <= from + width) flows.push_back(samples.flow[k]);
    }
    const double flow =
        median(Eigen::Map<Eigen::VectorXd>(flows.data(), static_cast<Index>(flows.size())));
    const double rise = process.mean(flow, side * (from + width)) - process.mean(flow, side * from);
    return branch_share(rise * supply / width) * out.static_slope;
  };
  out.slope_heavier = slope_from(heaviest - width);
  out.slope_lighter = slope_from(lightest);
  return out;
}

}  // namespace sparflow
