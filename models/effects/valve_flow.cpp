#include "models/effects/valve_flow.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/effects/hydraulics.h"
#include "models/math/golden_section.h"

namespace sparflow {
namespace {

/// With fewer commanded samples than this the machine file gives the better gain.
/// @threshold [samples] 2..1000; chosen: a line through them has an error of a fifth of their scatter
constexpr int kFewest = 20;
/// Upper end of the search for a dead band, as share of full command.
/// @threshold [1] 0..1; chosen: a valve with a wider one would be useless
constexpr double kWidest = 0.5;

double file_gain(const Machine& machine, int cylinder, int side) {
  const Valve* valve = machine.valve_of_cylinder(cylinder);
  const double area = supply_area(machine.cylinders[static_cast<std::size_t>(cylinder)], side);
  if (valve == nullptr || area <= 0.0) return 0.0;
  return (side > 0 ? valve->max_flow_extend : valve->max_flow_retract) / area;
}

using Samples = SectionPool::Samples;

/// Least-squares gain [m/s] beyond a dead band. @param cost sum of squares
double gain_of(const Samples& s, double dead_band, double* cost = nullptr) {
  double uu = 0.0, uv = 0.0, vv = 0.0;
  for (std::size_t k = 0; k < s.command.size(); ++k) {
    const double u = s.share[k] * std::max(0.0, s.command[k] - dead_band);
    uu += u * u;
    uv += u * s.speed[k];
    vv += s.speed[k] * s.speed[k];
  }
  const double g = uu > 0.0 ? uv / uu : 0.0;
  if (cost != nullptr) *cost = vv - g * uv;
  return g;
}

/// @param share of the flow that passes; empty: all of it
Samples of_side(const CylinderSeries& c, const Eigen::VectorXd& command,
                const Eigen::VectorXd& share, int side) {
  Samples s;
  for (Eigen::Index k = 0; k < command.size(); ++k) {
    const double u = command[k] * side, v = c.speed[k] * side;
    const double passes = share.size() > 0 ? share[k] : 1.0;
    /// Command up to which a valve is closed.
    /// @threshold [1] 0..1e-2; numerical: rounding of a logged zero
    constexpr double kNoCommand = 1e-6;
    if (!(u > kNoCommand) || !std::isfinite(v) || !std::isfinite(passes)) continue;
    s.command.push_back(u);
    s.share.push_back(passes);
    s.speed.push_back(v);
  }
  return s;
}

double best_dead_band(const Samples& s) {
  const auto cost = [&](double u0) {
    double c = 0.0;
    gain_of(s, u0, &c);
    return c;
  };
  // A dead band near the largest command would leave nothing to fit.
  const double most =
      std::min(kWidest, 0.8 * *std::max_element(s.command.begin(), s.command.end()));
  /// Steps of the first search.
  /// @threshold [1] 5..1000; chosen: a fiftieth of full command, narrower than the cost's minimum
  constexpr int kSteps = 25;
  int best = 0;
  double lowest = cost(0.0);
  for (int k = 1; k <= kSteps; ++k) {
    const double c = cost(most * k / kSteps);
    if (c < lowest) lowest = c, best = k;
  }
  /// Largest number of golden sections.
  /// @threshold [1] 5..100; numerical: the width ends it first
  constexpr int kMostSections = 40;
  /// Width at which the golden sections end, as share of full command.
  /// @threshold [1] 1e-8..1e-2; chosen: far below what a log resolves
  constexpr double kFinest = 1e-4;
  const double lo = most * std::max(0, best - 1) / kSteps,
               hi = most * std::min(kSteps, best + 1) / kSteps;
  const GoldenSection found = golden_section(lo, hi, kMostSections, cost, kFinest);
  return 0.5 * (found.lo + found.hi);
}

}  // namespace

void SectionPool::complete() {
  complete_ = true;
  for (const auto& [place, s] : samples_) {
    Samples& all = all_[{std::get<0>(place), std::get<1>(place)}];
    all.command.insert(all.command.end(), s.command.begin(), s.command.end());
    all.share.insert(all.share.end(), s.share.begin(), s.share.end());
    all.speed.insert(all.speed.end(), s.speed.begin(), s.speed.end());
  }
}

const SectionPool::Samples& SectionPool::together(int cylinder, int side, Samples samples) {
  if (complete_) return all_[{cylinder, side}];
  return samples_[{cylinder, side, log_}] = std::move(samples);
}

double SectionPool::dead_band(int cylinder, int side, const std::function<double()>& search) {
  if (!complete_) return search();
  const auto known = bands_.find({cylinder, side});
  return known != bands_.end() ? known->second : bands_[{cylinder, side}] = search();
}

SectionFit fit_gains(const MachineSeries& log, int cylinder, const Eigen::VectorXd& command,
                     SectionPool* pool) {
  SectionFit fit;
  for (const int side : {1, -1}) {
    const Samples own = of_side(log.cylinders[static_cast<std::size_t>(cylinder)], command,
                                Eigen::VectorXd(), side);
    const Samples& s = pool != nullptr ? pool->together(cylinder, side, own) : own;
    (side > 0 ? fit.gain_extend : fit.gain_retract) =
        s.command.size() < kFewest ? file_gain(*log.machine, cylinder, side) : gain_of(s, 0.0);
  }
  return fit;
}

Eigen::VectorXd late_flow(const MachineSeries& log, int cylinder, const Eigen::VectorXd& opening,
                          const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& late,
                          SectionPool* pool) {
  const Eigen::VectorXd extend = opening.cwiseMax(0.0), retract = opening.cwiseMin(0.0);
  const Eigen::VectorXd late_extend = late(extend), late_retract = late(retract);
  const SectionFit fit = fit_gains(log, cylinder, late_extend + late_retract, pool);
  return fit.gain_extend * (late_extend - extend) + fit.gain_retract * (late_retract - retract);
}

SectionFit fit_dead_bands(const MachineSeries& log, int cylinder, SectionPool* pool) {
  const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(cylinder)];
  SectionFit fit = fit_gains(log, cylinder, c.command, pool);
  for (const int side : {1, -1}) {
    const Samples own = of_side(c, c.command, c.passed, side);
    const Samples& s = pool != nullptr ? pool->together(cylinder, side, own) : own;
    if (s.command.size() < kFewest) continue;
    const auto search = [&] { return best_dead_band(s); };
    const double u0 = pool != nullptr ? pool->dead_band(cylinder, side, search) : search();
    (side > 0 ? fit.dead_band_extend : fit.dead_band_retract) = u0;
    (side > 0 ? fit.gain_extend : fit.gain_retract) = gain_of(s, u0);
  }
  return fit;
}

}  // namespace sparflow
