#include <algorithm>
#include <cmath>
#include <limits>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/linkage.h"

namespace sparflow {
namespace {

/// Oil in hose and ports, as a share of the full chamber.
constexpr double kDeadVolume = 0.05;

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
    const Eigen::VectorXd rate_a = rate_of(log, c.pressure_a), rate_b = rate_of(log, c.pressure_b);
    const Eigen::VectorXd& force = carried_force(c);
    columns.resize(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      // the chamber that is supplied; at rest the one that holds the load
      const bool piston_side = c.direction[k] != 0 ? c.direction[k] > 0 : force[k] > 0.0;
      const double height = piston_side ? c.length[k] - range.lo : range.hi - c.length[k];
      const double squeezed = std::max(0.0, height) + dead;  // volume per area
      columns(k, 0) = piston_side ? -squeezed * rate_a[k] : squeezed * rate_b[k];
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_compressibility() { return std::make_unique<Compressibility>(); }

}  // namespace sparflow
