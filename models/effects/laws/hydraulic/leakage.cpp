#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

class Leakage final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "leakage",
        .title = "internal leakage",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters = {{"k",
                        "l/min per 100 bar",
                        units::kLitrePerMinute / (100 * units::kBar),
                        0.0,
                        20 * units::kLitrePerMinute / (100 * units::kBar),
                        0.5 * units::kLitrePerMinute / (100 * units::kBar),
                        "laminar leakage: out of the chamber that holds the load at rest, from A "
                        "to B in motion",
                        true,
                        {}},
                       {"moving",
                        "-",
                        1.0,
                        0.0,
                        3.0,
                        0.0,
                        "0: past the closed spool, at rest only; 1: past the piston, at rest as "
                        "well; 2: past "
                        "the piston with tight ports, in motion only; 3: the same, and the "
                        "pressures follow the flow over the return edge by the learned laws",
                        false,
                        {0.0, 1.0, 2.0, 3.0},
                        true,
                        false,
                        {"past the closed spool, at rest", "past the piston",
                         "past the piston, tight ports",
                         "past the piston, tight ports, pressures follow"}}},
        .equation =
            "dx/dt = Q_valve/A - F k/A_hold^2; tight ports: dx/dt = Q_valve/A - k (p_A - "
            "p_B)/A_supply in motion",
        .signals = {"position", "command"},
        .confused_with = {"valve_deadband", "compressibility"},
        .separated_by = "holding a load at zero command for a minute, at two payloads",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 6 (leakage coefficients)",
        .form_error = 0.5,
        .in_motion =
            "nothing: the valve replaces the leaked oil, and the flow taken from the pump is "
            "that of the motion"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override {
    using enum EvidenceKind;
    return {kFlow, kReturnExtend, kReturnRetract, kSupplyExtend, kSupplyRetract};
  }
  /// In motion, a flow that falls with the pressure across the piston is also that of a valve whose compensator yields.
  bool needs_reference(std::span<const double> shape) const override { return is_tight(shape); }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const auto i = static_cast<std::size_t>(at);
    const Cylinder& c = log.machine->cylinders[i];
    const CylinderSeries& log_cylinder = log.cylinders[i];
    const Eigen::VectorXd& force = carried_force(log_cylinder);
    const Eigen::VectorXi& direction = log_cylinder.direction;
    const bool chambers = log_cylinder.pressure_a.size() > 0 && log_cylinder.pressure_b.size() > 0;
    const bool tight = is_tight(shape), at_rest_only = shape[0] < 0.5;  // no threshold: 0 to 3
    columns.setZero(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double load_area = supply_area(c, force[k] > 0.0 ? 1 : -1);  // holds the load
      const bool rests = direction[k] == 0;
      if (tight && !rests) {
        // The valve delivers into the supply chamber, from which or into which the oil passes the piston.
        const double across = chambers ? log_cylinder.pressure_a[k] - log_cylinder.pressure_b[k]
                                       : force[k] / load_area;
        columns(k, 0) = -across / supply_area(c, direction[k]);
      } else if (!tight && (rests || !at_rest_only)) {
        columns(k, 0) = -force[k] / (load_area * load_area);
      }
    }
    return true;
  }

  /// What passes the piston from A to B leaves B beside the rod's flow while the rod extends, and does not leave A while it retracts.
  bool return_edge_flow(const MachineSeries& log, int at, std::span<const double> shape,
                        Eigen::MatrixXd& columns) const override {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    const bool followed = shape[0] > 2.5;  // no threshold: 0 to 3
    if (!followed || c.pressure_a.size() == 0 || c.pressure_b.size() == 0) return false;
    columns = c.direction.cast<double>().cwiseProduct(c.pressure_a - c.pressure_b);
    return true;
  }

 private:
  static bool is_tight(std::span<const double> shape) {
    return shape[0] > 1.5;  // no threshold: 0 to 3
  }
};

}  // namespace

std::unique_ptr<Effect> make_leakage() { return std::make_unique<Leakage>(); }

}  // namespace sparflow
