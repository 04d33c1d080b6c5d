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
        .parameters =
            {{"k",
              "l/min per 100 bar",
              units::kLitrePerMinute / (100 * units::kBar),
              0.0,
              20 * units::kLitrePerMinute / (100 * units::kBar),
              0.5 * units::kLitrePerMinute / (100 * units::kBar),
              "laminar leakage out of the chamber that holds the load",
              true,
              {}},
             {"moving",
              "-",
              1.0,
              0.0,
              1.0,
              0.0,
              "0: past the closed spool, at rest only; 1: past the piston, in motion as well",
              false,
              {0.0, 1.0},
              true}},
        .equation = "dx/dt = Q_valve/A - sign(F) k p_load/A_hold, p_load = |F|/A_hold",
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
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const auto i = static_cast<std::size_t>(at);
    const Cylinder& c = log.machine->cylinders[i];
    const Eigen::VectorXd& force = carried_force(log.cylinders[i]);
    const Eigen::VectorXi& direction = log.cylinders[i].direction;
    columns.setZero(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (shape[0] < 0.5 && direction[k] != 0) continue;
      const double area =
          supply_area(c, force[k] > 0.0 ? 1 : -1);  // of the chamber that holds the load
      columns(k, 0) = -force[k] / (area * area);
    }
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_leakage() { return std::make_unique<Leakage>(); }

}  // namespace sparflow
