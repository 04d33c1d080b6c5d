#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

/// Load-holding valves are set to 70 bar and more, and pilot ratios reach 10 (Chapple 2003, ch. 4), so that they open at 7 bar without
/// load. Where the pressure falls with the load and there is no such part, another cause changes it.
/// @threshold [Pa] 0..7e5; derived: half of that, for areas and seals
constexpr double kLeastSetting = 3.5 * units::kBar;

/// The effect is one valve on one side; where a cylinder has two, its pressure model has learned the other one already.
/// With pilot ratio R and setting p_set, opening needs p_load + R p_supply + (A_supply/A_hold) p_supply = p_set:
///   p_supply = (p_set - p_load) / (R + A_supply/A_hold),
/// so slope = 1 / (R + A_supply/A_hold) and setting = slope * p_set.
class Counterbalance final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "counterbalance",
        .title = "counterbalance valve",
        .stage = EffectStage::kPressure,
        .place = EffectPlace::kCylinder,
        .parameters = {{"setting",
                        "bar",
                        units::kBar,
                        kLeastSetting,
                        200 * units::kBar,
                        40 * units::kBar,
                        "supply pressure that opens the valve without load, above that of an "
                        "unloaded chamber",
                        true,
                        {}},
                       {"slope",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.2,
                        "decrease of the supply pressure per load pressure, 1 / (pilot ratio + "
                        "A_supply/A_hold)",
                        true,
                        {}},
                       {"side",
                        "-",
                        1.0,
                        -1.0,
                        1.0,
                        -1.0,
                        "-1: the valve acts while retracting, 1: while extending",
                        false,
                        {-1.0, 1.0},
                        true,
                        false,
                        {"while retracting", "while extending"}}},
        .equation =
            "p_supply = max(static branch, setting - slope p_load), p_load = -side F/A_hold",
        .signals = {"both chamber pressures", "position"},
        .confused_with = {"return_back_pressure", "coulomb_friction", "load_friction"},
        .separated_by = "lowering at the same speed with three payloads",
        .citation =
            "P. Chapple (2003), Principles of Hydraulic System Design, ch. 4 (over-centre "
            "valves)",
        .form_error = 0.2,
        .in_motion = "pressure: in the direction of the overrunning load"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kSupplyExtend, EvidenceKind::kSupplyRetract};
  }

  template <class T>
  void add_pressure_law(const Instant<T>& s, int at, std::span<const double> p,
                        std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    const int side = s.side[i];
    if (side == 0 || side != side_of(p[2])) return;
    const Cylinder& c = s.machine->cylinders[i];
    // [Pa] load pressure in the chamber that holds an overrunning load; negative when the load resists
    const T load = s.force[i] * (-side / return_area(c, side));
    T rise = p[0] - p[1] * load;
    // A resisting load requires part of that pressure already.
    const T opposed = s.force[i] * (side / supply_area(c, side));
    if (opposed > T(0.0)) rise = rise - opposed;
    if (rise > T(0.0)) out[i] += rise;
  }
  SPARFLOW_EFFECT_LAW(add_pressure)

  /// The force has passed the filter already; filtered twice, its noise would explain that of the chamber pressure.
  bool columns_filtered() const override { return true; }
  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const int side = supply_side(measured.kind);
    if (side == 0 || measured.index != at || side != side_of(shape[0])) return false;
    const auto i = static_cast<std::size_t>(at);
    const CylinderSeries& c = log.cylinders[i];
    const double area = return_area(log.machine->cylinders[i], side);
    const Eigen::VectorXd& force = steady_force(c);
    columns.setZero(log.samples(), 2);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (c.direction[k] != side) continue;
      columns(k, 0) = 1.0;
      columns(k, 1) = force[k] * side / area;  // minus the pressure of the overrunning load
    }
    return true;
  }

 private:
  static int side_of(double parameter) { return parameter > 0.0 ? 1 : -1; }
};

}  // namespace

std::unique_ptr<Effect> make_counterbalance() { return std::make_unique<Counterbalance>(); }

}  // namespace sparflow
