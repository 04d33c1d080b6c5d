#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/linkage.h"

namespace sparflow {
namespace {

/// Oil in hose and ports, as a share of the full chamber.
constexpr double kDeadVolume = 0.05;

/// A chamber that begins to be fed, or to hold the load, takes on its pressure through valves within a filter's
/// width: what is compressed then does not come out of the rod's way. [s]
constexpr double kTakesOver = 0.3;

/// Shortest and longest length the joint's range (or the stated stroke) allows. [m]
Range lengths_in_use(const Machine& machine, int cylinder) {
  const Cylinder& c = machine.cylinders[static_cast<std::size_t>(cylinder)];
  if (c.length_at_zero_stroke && c.stroke) {
    return {*c.length_at_zero_stroke, *c.length_at_zero_stroke + *c.stroke};
  }
  const Range q = machine.joints[static_cast<std::size_t>(c.joint)].position;
  const double a = linkage_rates(machine, cylinder, q.lo).value;
  const double b = linkage_rates(machine, cylinder, q.hi).value;
  return {std::min(a, b), std::max(a, b)};
}

/// dx/dt by central differences inside each run. [unit/s]
Eigen::VectorXd rate_of(const MachineSeries& log, const Eigen::VectorXd& x) {
  Eigen::VectorXd rate =
      Eigen::VectorXd::Constant(x.size(), std::numeric_limits<double>::quiet_NaN());
  for (const auto& [first, last] : log.runs) {
    for (Eigen::Index k = first; k < last && last - first > 1; ++k) {
      const Eigen::Index a = std::max(first, k - 1), b = std::min(last - 1, k + 1);
      rate[k] = (x[b] - x[a]) / (log.time[b] - log.time[a]);
    }
  }
  return rate;
}

/// Rates that a sensor's noise alone may make count as none: they would stand in the regressor all the time, where
/// the oil is squeezed only now and then, and the modulus would come out many times too high. The noise is what
/// differs between instants half a second apart, beyond the filter's width; a steady rise is none.
void drop_noise(const MachineSeries& log, Eigen::VectorXd& rate) {
  constexpr double kLevel = 3.0, kApart_s = 0.5;  // [-] standard deviations
  const auto apart = std::max<Eigen::Index>(1, std::lround(kApart_s / std::max(log.step, 1e-3)));
  std::vector<double> changes;
  for (Eigen::Index k = apart; k < rate.size(); ++k) {
    const double change = std::abs(rate[k] - rate[k - apart]);
    if (std::isfinite(change)) changes.push_back(change);
  }
  if (changes.empty()) return;
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  const double least = kLevel * *middle / (0.6745 * std::sqrt(2.0));
  for (double& r : rate) {
    if (std::abs(r) < least) r = 0.0;
  }
}

class Compressibility final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "compressibility",
        .title = "oil volume is compressed before the rod moves",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters = {{"1/E",
                        "1/GPa",
                        1e-9,
                        0.0,
                        20e-9,
                        1e-9,
                        "inverse bulk modulus of oil, hoses and entrained air",
                        true,
                        {}}},
        .equation = "A dx/dt = Q_valve - V/E dp/dt, V = A (stroke + 5 % of the full stroke)",
        .signals = {"chamber pressures", "position", "command"},
        .confused_with = {"valve_lag", "leakage"},
        .separated_by = "load steps at rest and fast starts with and without load",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 2 and 6 (bulk modulus)",
        .form_error = 0.2,
        .in_motion = "nothing: the compressed volume is taken and given back"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }

  bool columns_filtered() const override { return true; }  // differences of filtered pressures
  bool columns(const MachineSeries& log, EvidenceKind kind, int index, int at,
               std::span<const double>, Eigen::MatrixXd& columns) const override {
    if (kind != EvidenceKind::kFlow || index != at) return false;
    const auto i = static_cast<std::size_t>(at);
    const CylinderSeries& c = log.cylinders[i];
    if (c.pressure_a.size() == 0 || c.pressure_b.size() == 0) return false;
    const Range range = lengths_in_use(*log.machine, at);
    const double dead = kDeadVolume * (range.hi - range.lo);
    Eigen::VectorXd rate_a = rate_of(log, c.pressure_a), rate_b = rate_of(log, c.pressure_b);
    drop_noise(log, rate_a);
    drop_noise(log, rate_b);
    const Eigen::VectorXd& force = carried_force(c);
    columns.resize(log.samples(), 1);
    Eigen::Array<bool, Eigen::Dynamic, 1> on_piston(log.samples());
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      // the chamber that is supplied; at rest the one that holds the load
      on_piston[k] = c.direction[k] != 0 ? c.direction[k] > 0 : force[k] > 0.0;
    }
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const bool piston_side = on_piston[k];
      const double height = piston_side ? c.length[k] - range.lo : range.hi - c.length[k];
      const double squeezed = std::max(0.0, height) + dead;  // volume per area
      columns(k, 0) = piston_side ? -squeezed * rate_a[k] : squeezed * rate_b[k];
    }
    for (Eigen::Index k = 1; k < log.samples(); ++k) {
      if (on_piston[k] == on_piston[k - 1]) continue;
      const double at_change = log.time[k];
      for (Eigen::Index j = k; j < log.samples() && log.time[j] - at_change < kTakesOver; ++j)
        columns(j, 0) = 0.0;
      for (Eigen::Index j = k; j-- > 0 && at_change - log.time[j] < kTakesOver;)
        columns(j, 0) = 0.0;
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_compressibility() { return std::make_unique<Compressibility>(); }

}  // namespace sparflow
