#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"

namespace sparflow {
namespace {

/// [degC] The losses contained in the learned pressure models and margins are referred to this temperature.
/// @threshold [degC] 20..60; chosen: usual temperature of warm oil
constexpr double kReference = 40.0;

/// Lines are sized for the flow of their section, so that losses at rated flow are alike. The law therefore has one
/// pressure for the whole machine, scaled by each section's flow over its rated flow.
class OilTemperature final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "oil_temperature",
        .title = "temperature-dependent line losses",
        .stage = EffectStage::kPressure,
        .place = EffectPlace::kMachine,
        // The parameters are slopes at 40 degC rather than losses, because a log determines how the pressure falls with
        // temperature; how loss and beta share that shows only in the curvature.
        .parameters = {{"return_slope",
                        "bar/K",
                        units::kBar,
                        0.0,
                        3 * units::kBar,
                        0.3 * units::kBar,
                        "decrease of the loss from cylinder to tank per kelvin, at the section's "
                        "full flow and 40 degC",
                        true,
                        {}},
                       {"supply_slope",
                        "bar/K",
                        units::kBar,
                        0.0,
                        3 * units::kBar,
                        0.3 * units::kBar,
                        "the same from pump to cylinder",
                        true,
                        {}},
                       {"beta",
                        "1/K",
                        1.0,
                        0.005,
                        0.1,
                        0.03,
                        "relative decrease of the viscosity per kelvin; loss = slope / beta",
                        false,
                        {0.005, 0.01, 0.02, 0.03, 0.04, 0.055, 0.075}}},
        .equation = "dp = slope Q/Q_full (exp(-beta (T - 40)) - 1) / beta",
        .signals = {"oil temperature", "chamber pressures", "pump pressure"},
        .confused_with = {"return_back_pressure", "flow_dependent_margin", "sensor drift"},
        .separated_by = "the same motions with cold and with warm oil",
        .citation =
            "O. Reynolds (1886), Phil. Trans. R. Soc. 177 (mu = mu0 exp(-beta T)); Merritt "
            "(1967), ch. 2",
        .form_error = 0.3,
        .in_motion = "pressure and pump: at the problem's oil temperature"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override { return whole_circuit(machine); }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kReturnExtend, EvidenceKind::kReturnRetract, EvidenceKind::kPump};
  }

  template <class T>
  void add_return_law(const Instant<T>& s, int, std::span<const double> p, std::span<T> out) const {
    const double excess = factor(s.oil, p[2]);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const Cylinder& c = s.machine->cylinders[i];
      const int side = s.side[i];
      if (side == 0 || !c.hydraulic()) continue;
      const double full = rated_flow(*s.machine, static_cast<int>(i), side) * return_area(c, side) /
                          supply_area(c, side);
      out[i] += s.return_flow[i] * (p[0] * excess / full);
    }
  }
  template <class T>
  void add_demand_law(const Instant<T>& s, int, std::span<const double> p, std::span<T> out) const {
    const double excess = factor(s.oil, p[2]);
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (s.side[i] == 0 || !s.machine->cylinders[i].hydraulic()) continue;
      const double full = rated_flow(*s.machine, static_cast<int>(i), s.side[i]);
      out[i] += s.flow[i] * (p[1] * excess / full);
    }
  }
  SPARFLOW_EFFECT_LAW(add_return)
  SPARFLOW_EFFECT_LAW(add_demand)

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (log.oil.size() == 0) return false;
    const int side = return_side(measured.kind);
    if (side == 0) return Effect::columns(log, measured, at, shape, columns);
    const Cylinder& c = log.machine->cylinders[static_cast<std::size_t>(measured.index)];
    if (!c.hydraulic()) return false;
    const CylinderSeries& series = log.cylinders[static_cast<std::size_t>(measured.index)];
    const double full = rated_flow(*log.machine, measured.index, side) * return_area(c, side) /
                        supply_area(c, side);
    columns.setZero(log.samples(), 2);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      columns(k, 0) = series.return_flow[k] / full * factor(log.oil[k], shape[0]);
    }
    return true;
  }

 private:
  /// [K] Temperature below the reference, weighted by the exponential law of viscosity.
  static double factor(double oil, double beta) {
    return std::expm1(-beta * (oil - kReference)) / beta;
  }
};

}  // namespace

std::unique_ptr<Effect> make_oil_temperature() { return std::make_unique<OilTemperature>(); }

}  // namespace sparflow
