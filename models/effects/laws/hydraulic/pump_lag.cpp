#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/memory.h"

namespace sparflow {
namespace {

class PumpLag final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "pump_lag",
        .title = "pump response lag",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kPump,
        // The linear parameter switches the effect on or off; the time constant is searched.
        .parameters =
            {{"share",
              "-",
              1.0,
              0.5,
              2.0,
              1.0,
              "share of the demand's change that is delayed, about 1",
              true,
              {}},
             {"tau",
              "s",
              1.0,
              0.02,
              2.0,
              0.2,
              "mean delay: time constant, of two stages their sum (mean of rising and falling), of "
              "a swing 2 d / w",
              false,
              {0.03, 0.05, 0.08, 0.12, 0.17, 0.24, 0.34, 0.48, 0.7, 1.0}},
             {"form",
              "-",
              1.0,
              0.0,
              4.0,
              0.0,
              "0: first order, 1: two equal stages, 2: two equal stages, rising four times "
              "as fast as falling, 3: second order that swings (hunting regulator, "
              "damping ratio 0.3), 4: first order, built up by its own margin (the load-sensing "
              "port sees no more than the pump's pressure until the load's check valve opens)",
              false,
              {0.0, 1.0, 2.0, 3.0, 4.0},
              true}},
        .equation =
            "tau dp/dt + p = demand, or (tau/2 d/dt + 1)^2 p = demand, or p''/w^2 + 2 d p'/w + p = "
            "demand, or tau dp/dt = min(demand - p, standby)",
        .signals = {"pump pressure", "working pressures", "commands"},
        .confused_with = {"sensor_delay"},
        .separated_by = "repeated steps of one cylinder",
        .citation =
            "Kumar, Dasgupta, Ghoshal (2015); first-order lag; H. E. Merritt (1967), Hydraulic "
            "Control Systems, ch. 6 (second order); P. Krus (1988), On Load Sensing Fluid Power "
            "Systems, Linkoping (dynamics of load-sensing pumps)",
        .form_error = 0.1,
        .in_motion =
            "nothing: a planned motion's pump is at its demand; a lag of tenths of a second costs "
            "at falling demand what it saves at rising demand"};
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kPump}; }
  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kPump || measured.index != at) return false;
    const Eigen::VectorXd& demand = log.pumps[static_cast<std::size_t>(at)].demand;
    if (demand.size() == 0) return false;
    columns = late(log, at, demand, shape[0], shape[1]) - demand;
    return true;
  }

  Eigen::VectorXd followed_demand(const MachineSeries& log, int pump, int at,
                                  std::span<const double> p,
                                  const Eigen::VectorXd& change) const override {
    const Eigen::VectorXd& demand = log.pumps[static_cast<std::size_t>(pump)].demand;
    if (pump != at || demand.size() == 0) return {};
    const Eigen::VectorXd late_change =
        late(log, at, demand + change, p[1], p[2]) - late(log, at, demand, p[1], p[2]);
    return (1.0 - p[0]) * change + p[0] * late_change;
  }

 private:
  static Eigen::VectorXd late(const MachineSeries& log, int at, const Eigen::VectorXd& demand,
                              double tau, double form) {
    const PumpSeries& pump = log.pumps[static_cast<std::size_t>(at)];
    /// Damping ratio of a regulator that hunts.
    /// @threshold [1] 0.1..0.6; chosen: two or three swings are seen before the pressure rests
    constexpr double kDamping = 0.3;
    /// Time constant while falling over that while rising, where they differ.
    /// @threshold [1] 1..20; chosen: a regulator destrokes against its spring, and the lever's valve closes late
    constexpr double kFallingToRising = 4.0;
    const double rising = 2.0 / (1.0 + kFallingToRising) * tau;
    switch (static_cast<int>(std::lround(form))) {
      case 0:
        return first_order_lag(log, demand, tau);
      case 1:
        return first_order_lag(log, first_order_lag(log, demand, 0.5 * tau), 0.5 * tau);
      case 2: {
        const double r = 0.5 * rising, f = kFallingToRising * r;
        return first_order_lag(log, first_order_lag(log, demand, r, f), r, f);
      }
      case 4:
        return pump.standby > 0.0 ? limited_lag(log, demand, pump.standby, tau)
                                  : first_order_lag(log, demand, tau);
      default:
        return second_order_lag(log, demand, 2.0 * kDamping / tau, kDamping);
    }
  }
};

}  // namespace

std::unique_ptr<Effect> make_pump_lag() { return std::make_unique<PumpLag>(); }

}  // namespace sparflow
