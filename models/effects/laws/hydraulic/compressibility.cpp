#include <algorithm>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/memory.h"
#include "models/machine/linkage.h"

namespace sparflow {
namespace {

/// [-] Oil volume in hose and ports as a share of the full chamber.
/// @threshold [1] 0..1; chosen: hoses are some metres of a fifth of the piston's diameter
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

class Compressibility final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "compressibility",
        .title = "oil compressibility",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters =
            {{"1/E",
              "1/GPa",
              1e-9,
              0.3e-9,  // no oil is stiffer than 3 GPa
              20e-9,
              1e-9,
              "inverse bulk modulus of oil, hoses and entrained air",
              true,
              {}},
             {"tau",
              "s",
              1.0,
              0.0,
              2.0,
              0.05,
              "time constant with which the rod follows the pressure, since the line limits the "
              "flow",
              false,
              {0.02, 0.12, 0.25, 0.5, 0.9}}},
        .equation =
            "A dx/dt = Q_valve - V/E dp/dt, V = A (stroke + 5 % of the full stroke), with "
            "first-order lag tau",
        .signals = {"chamber pressures", "position", "command"},
        .confused_with = {"valve_lag", "leakage"},
        .separated_by = "load steps at rest and fast starts with and without load",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 2 and 6 (bulk modulus)",
        .form_error = 0.2,
        .in_motion = "nothing: the compressed volume is released again"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }
  bool columns_of_readings() const override { return true; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const auto i = static_cast<std::size_t>(at);
    const CylinderSeries& c = log.cylinders[i];
    // Unfiltered pressures are preferred, because a filter mixes samples before and after the supply chamber changes.
    const bool raw = c.measured_a.size() > 0 && c.measured_b.size() > 0;
    const Eigen::VectorXd& a = raw ? c.measured_a : c.pressure_a;
    const Eigen::VectorXd& b = raw ? c.measured_b : c.pressure_b;
    if (a.size() == 0 || b.size() == 0) return false;
    const Range range = lengths_in_use(*log.machine, at);
    const double dead = kDeadVolume * (range.hi - range.lo);
    const Eigen::VectorXd& force = carried_force(c);
    Eigen::VectorXd speed = Eigen::VectorXd::Zero(log.samples());
    for (const auto& [first, last] : log.runs) {
      for (Eigen::Index k = first + 1; k < last; ++k) {
        // This is the supply chamber; at rest it is the one that holds the load.
        const bool on_piston = c.direction[k] != 0 ? c.direction[k] > 0 : force[k] > 0.0;
        const double height = on_piston ? c.length[k] - range.lo : range.hi - c.length[k];
        const double squeezed = std::max(0.0, height) + dead;  // [m] volume per area
        const double rise = on_piston ? a[k] - a[k - 1] : b[k] - b[k - 1];
        speed[k] = (on_piston ? -squeezed : squeezed) * rise / (log.time[k] - log.time[k - 1]);
      }
    }
    const double tau = shape.empty() ? 0.0 : shape[0];
    columns = tau > 0.0 ? first_order_lag(log, speed, tau) : speed;
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_compressibility() { return std::make_unique<Compressibility>(); }

}  // namespace sparflow
