#include <algorithm>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

/// Shares of the offset that the sensors of bore side and rod side have; `chamber` chooses the sensor.
double share_a(double chamber) { return std::clamp(0.5 * (1.0 + chamber), 0.0, 1.0); }
double share_b(double chamber) { return std::clamp(0.5 * (1.0 - chamber), 0.0, 1.0); }

class PressureOffset final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "pressure_offset",
        .title = "pressure sensor offset",
        .stage = EffectStage::kSensor,
        .place = EffectPlace::kCylinder,
        .parameters = {{"offset",
                        "bar",
                        units::kBar,
                        -20 * units::kBar,
                        20 * units::kBar,
                        3 * units::kBar,
                        "measured minus true pressure",
                        true,
                        {}},
                       {"chamber",
                        "-",
                        1.0,
                        -1.0,
                        1.0,
                        1.0,
                        "1: sensor of the bore side (A), -1: sensor of the rod side (B)",
                        false,
                        {1.0, -1.0},
                        true,
                        false,
                        {"bore side, A", "rod side, B"}}},
        .equation =
            "p_A (or p_B) measured = true + offset; measured force = true + A_A offset (or - A_B "
            "offset)",
        .signals = {"both chamber pressures"},
        .confused_with = {"force_offset", "unmodelled_mass", "flow_dependent_margin"},
        .separated_by = "a zero check: engine off, hoses relieved, machine on its rest",
        .citation = "Isermann (2011), Fault-Diagnosis Applications, offset faults of sensors",
        .in_motion = "nothing: the error is the sensor's, not the machine's"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kForce,        EvidenceKind::kReturnExtend,  EvidenceKind::kReturnRetract,
            EvidenceKind::kSupplyExtend, EvidenceKind::kSupplyRetract, EvidenceKind::kPump};
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    if (c.pressure_a.size() == 0 || c.pressure_b.size() == 0)
      return false;  // The force is measured directly.
    const double a = share_a(shape[0]), b = share_b(shape[0]);
    if (measured.kind == EvidenceKind::kPump) {
      // The pump pressure is compared with the demand of the measured pressures.
      if (log.machine->pump_of_cylinder(at) != measured.index) return false;
      const Eigen::VectorXi& leader = log.pumps[static_cast<std::size_t>(measured.index)].leader;
      if (leader.size() == 0) return false;
      columns.setZero(log.samples(), 1);
      for (Eigen::Index k = 0; k < log.samples(); ++k) {
        if (leader[k] == at) columns(k, 0) = c.direction[k] > 0 ? -a : -b;
      }
      const double size = info().parameters[0].typical;
      columns.col(0) = reaching_pump(log, measured.index, size * columns.col(0)) / size;
      return true;
    }
    if (measured.index != at) return false;
    double value = 0.0;
    if (measured.kind == EvidenceKind::kForce) {
      const Cylinder& cylinder = log.machine->cylinders[static_cast<std::size_t>(at)];
      value = cylinder.area_piston() * a - cylinder.area_rod() * b;
    } else {
      const bool supply = supply_side(measured.kind) != 0;
      const int side = supply ? supply_side(measured.kind) : return_side(measured.kind);
      value = (side > 0) == supply ? a : b;
    }
    // The column is zero in the chamber whose sensor is right: the other's error acts there by way of the force only.
    columns.setConstant(log.samples(), 1, value);
    return true;
  }
};

}  // namespace

std::unique_ptr<Effect> make_pressure_offset() { return std::make_unique<PressureOffset>(); }

}  // namespace sparflow
