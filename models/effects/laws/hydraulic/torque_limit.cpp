#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/memory.h"

namespace sparflow {
namespace {

/// [s] Window over which the demand is averaged, because clipping a noisy signal leaves a bias like the effect.
/// @threshold [s] 0..5; chosen: longer than the noise, shorter than a motion
constexpr double kWindow = 0.3;

class TorqueLimit final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "torque_limit",
        .title = "pump power limit",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kPump,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.7,
                        1.35,
                        1.0,
                        "share of the excess pressure that is cut off, about 1",
                        true,
                        {}},
                       {"power",
                        "kW",
                        1e3,
                        0.2e3,
                        500e3,
                        20e3,
                        "largest product of pressure and flow",
                        false,
                        {1e3, 2e3, 4e3, 8e3, 16e3, 32e3, 64e3, 128e3}}},
        .equation = "p_pump = min(demand, power / sum of flows)",
        .signals = {"pump pressure", "working pressures", "commands", "position"},
        .confused_with = {"flow_saturation", "pump_lag"},
        .separated_by = "full flow at high load, and the same flow at half the load",
        .citation =
            "H. Murrenhoff (2011), Grundlagen der Fluidtechnik 1, ch. 4 (power control of "
            "variable pumps)",
        .form_error = 0.05,
        .in_motion = "pump: pressure held below power / flow"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return pumps_of_type(machine, PumpType::kLoadSensing);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kPump}; }

  template <class T>
  void add_pump_law(const Instant<T>& s, int at, std::span<const double> p,
                    std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    const T& pressure = s.pump_pressure[i];
    const T& flow = s.pump_flow[i];
    if (!(pressure * flow > T(p[1]))) return;
    out[i] += p[0] * (p[1] / flow - pressure);
  }
  SPARFLOW_EFFECT_LAW(add_pump)

  std::vector<double> grid(const MachineSeries& log, int at, int) const override {
    const Eigen::VectorXd demand = smooth_demand(log, at);
    const Eigen::VectorXd flow = pump_flow(log, at);
    double largest = 0.0;
    for (Eigen::Index k = 0; k < demand.size(); ++k) {
      if (demand[k] * flow[k] > largest) largest = demand[k] * flow[k];  // false for NaN
    }
    if (largest <= 0.0) return {};
    std::vector<double> powers;
    for (const double part : {0.25, 0.35, 0.45, 0.53, 0.61, 0.69, 0.77, 0.84, 0.9, 0.95}) {
      powers.push_back(part * largest);
    }
    return powers;
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kPump || measured.index != at) return false;
    const Eigen::VectorXd demand = smooth_demand(log, at);
    if (demand.size() == 0) return false;
    const Eigen::VectorXd flow = pump_flow(log, at);
    columns.setZero(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      if (demand[k] * flow[k] > shape[0]) columns(k, 0) = shape[0] / flow[k] - demand[k];
    }
    return columns.array().abs().maxCoeff() > 0.0;
  }

 private:
  static Eigen::VectorXd smooth_demand(const MachineSeries& log, int pump) {
    const PumpSeries& series = log.pumps[static_cast<std::size_t>(pump)];
    if (series.demand.size() == 0) return {};
    return moving_average(log, series.demand, series.leader, kWindow);
  }
};

}  // namespace

std::unique_ptr<Effect> make_torque_limit() { return std::make_unique<TorqueLimit>(); }

}  // namespace sparflow
