#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/memory.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

class ValveLag final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "valve_lag",
        .title = "valve response lag",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.5,
                        2.0,
                        1.0,
                        "share of the flow's change that is delayed, about 1",
                        true,
                        {}},
                       {"tau",
                        "s",
                        1.0,
                        0.01,
                        1.5,
                        0.2,
                        "time constant (of two stages their sum), or the pure delay",
                        false,
                        {0.03, 0.05, 0.08, 0.12, 0.16, 0.21, 0.27, 0.35, 0.46, 0.6}},
                       {"delay",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "0: first-order lag, 0.5: two equal stages of tau/2 each (pilot and main "
                        "spool), 1: pure delay of tau",
                        false,
                        {0.0, 0.5, 1.0},
                        true,
                        false,
                        {"first order", "two stages", "pure delay"}}},
        .equation =
            "tau dQ/dt + Q = Q_valve(u), or (tau/2 d/dt + 1)^2 Q = Q_valve(u), or Q(t) = "
            "Q_valve(u(t - tau))",
        .signals = {"command", "position"},
        .confused_with = {"valve_deadband", "sensor_delay", "compressibility"},
        .separated_by = "repeated steps of the command",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 6 and 7 (valve dynamics)",
        // A valve has stages of unequal speed, which two equal ones or a single one approximate.
        .form_error = 0.06,
        .in_motion =
            "nothing: a motion prescribes the flow; only the command for it must come earlier"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }

  bool acts_on_opening() const override { return true; }
  void delay_opening(const MachineSeries& log, int cylinder, int at, std::span<const double> p,
                     Eigen::VectorXd& opening) const override {
    if (cylinder != at) return;
    const std::span<const double> shape = p.subspan(1);
    const Eigen::VectorXd reached =
        late(log, opening.cwiseMax(0.0), shape) + late(log, opening.cwiseMin(0.0), shape);
    opening += p[0] * (reached - opening);
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    // Inside a dead band that the model contains the command has no flow that could be delayed.
    const Eigen::VectorXd& command = c.opening.size() > 0 ? c.opening : c.command;
    if (command.size() == 0) return false;
    const Eigen::VectorXd extend = command.cwiseMax(0.0), retract = command.cwiseMin(0.0);
    const Eigen::VectorXd late_extend = late(log, extend, shape),
                          late_retract = late(log, retract, shape);
    Eigen::VectorXd reached = late_extend + late_retract;
    if (c.passed.size() > 0) reached = reached.cwiseProduct(c.passed);
    // The gains are those of the late opening; those of the opening itself would be biased towards zero.
    const SectionFit fit = fit_gains(log, at, reached, measured.sections);
    columns =
        fit.gain_extend * (late_extend - extend) + fit.gain_retract * (late_retract - retract);
    if (c.reached_share.size() > 0) columns.array().colwise() *= c.reached_share.array();
    return true;
  }

 private:
  static Eigen::VectorXd late(const MachineSeries& log, const Eigen::VectorXd& x,
                              std::span<const double> shape) {
    /// Value of the form above which the lag is a pure delay.
    /// @threshold [1] 0.5..1; derived: the grid's values are 0, 0.5 and 1
    constexpr double kDelayFrom = 0.75;
    /// Value of the form below which the lag is of first order.
    /// @threshold [1] 0..0.5; derived: the grid's values are 0, 0.5 and 1
    constexpr double kFirstOrderTo = 0.25;
    if (shape[1] > kDelayFrom) return delayed(log, x, shape[0]);
    if (shape[1] < kFirstOrderTo) return first_order_lag(log, x, shape[0]);
    return first_order_lag(log, first_order_lag(log, x, 0.5 * shape[0]), 0.5 * shape[0]);
  }
};

}  // namespace

std::unique_ptr<Effect> make_valve_lag() { return std::make_unique<ValveLag>(); }

}  // namespace sparflow
