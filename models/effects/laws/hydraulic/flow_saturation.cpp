#include <algorithm>
#include <cmath>
#include <limits>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

class FlowSaturation final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "flow_saturation",
        .title = "pump flow saturation",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kPump,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.7,
                        1.35,
                        1.0,
                        "share of the excess demand that is not delivered, about 1",
                        true,
                        {}},
                       {"margin",
                        "bar",
                        units::kBar,
                        0.0,
                        60 * units::kBar,
                        15 * units::kBar,
                        "pressure difference over the metering edges that is lost with the flow",
                        true,
                        {},
                        false,
                        true},
                       {"limit",
                        "l/min",
                        units::kLitrePerMinute,
                        2 * units::kLitrePerMinute,
                        2000 * units::kLitrePerMinute,
                        100 * units::kLitrePerMinute,
                        "largest flow of the pump",
                        false,
                        {10 * units::kLitrePerMinute, 30 * units::kLitrePerMinute,
                         100 * units::kLitrePerMinute, 300 * units::kLitrePerMinute}},
                       {"soft",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "0: hard limit, 1: smooth limit (power law of exponent 12)",
                        false,
                        {0.0, 1.0},
                        true}},
        .equation =
            "Q_i = s Q_i(u), s = min(1, limit / sum of Q(u)), soft: (1 + (sum / "
            "limit)^12)^(-1/12); "
            "pump pressure - margin (1 - s^2)",
        .signals = {"commands", "position"},
        .confused_with = {"torque_limit", "valve_deadband", "pump_lag"},
        .separated_by = "each cylinder alone at full command, then all together",
        .citation =
            "H. Murrenhoff (2011), Grundlagen der Fluidtechnik, Teil 1: Hydraulik (sections "
            "that share the flow in proportion)",
        .form_error = 0.05,
        .in_motion = "limit: the pump's flow stays below it"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    std::vector<int> found;
    for (int p = 0; p < machine.pump_count(); ++p) {
      if (!machine.pumps[static_cast<std::size_t>(p)].feeds.empty()) found.push_back(p);
    }
    return found;
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kFlow, EvidenceKind::kPump};
  }
  double flow_limit(const Machine&, int pump, int at, std::span<const double> p) const override {
    return pump == at ? p[2] : std::numeric_limits<double>::infinity();
  }

  std::vector<double> grid(const MachineSeries& log, int at, int shape_index) const override {
    if (shape_index == 1) return {0.0, 1.0};
    const Demand demand(log, at, std::numeric_limits<double>::infinity(), false);
    if (!demand.known || !(demand.largest > 0.0)) return {};
    std::vector<double> limits;
    for (const double part : {0.45, 0.53, 0.6, 0.66, 0.72, 0.78, 0.84, 0.9, 0.95}) {
      limits.push_back(part * demand.largest);
    }
    return limits;
  }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    const bool pump = measured.kind == EvidenceKind::kPump;
    if (pump ? measured.index != at
             : measured.kind != EvidenceKind::kFlow ||
                   log.machine->pump_of_cylinder(measured.index) != at)
      return false;
    const Demand demand(log, at, shape[0], shape.size() > 1 && shape[1] > 0.5);
    if (!demand.known) return false;
    columns.setZero(log.samples(), 2);
    if (pump) {
      // An edge of constant opening carries s Q at s^2 of its pressure difference.
      columns.col(1) = (demand.served.array().square() - 1.0).matrix();
      return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
    }
    const Eigen::VectorXd& command =
        log.cylinders[static_cast<std::size_t>(measured.index)].command;
    const SectionFit& fit = demand.fits[static_cast<std::size_t>(measured.index)];
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      columns(k, 0) = fit.gain(command[k]) * command[k] * (demand.served[k] - 1.0);
    }
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }

 private:
  /// Flow that the valve sections demand. Their gains and the delivered share depend on each other; they are computed
  /// alternately.
  struct Demand {
    bool known = true;
    std::vector<SectionFit> fits;  ///< by cylinder
    Eigen::VectorXd served;        ///< [samples] delivered share of the demand, 0..1
    double largest = 0.0;          ///< [m^3/s] largest total demand

    Demand(const MachineSeries& log, int pump, double limit, bool soft) {
      const Machine& machine = *log.machine;
      const std::vector<int>& feeds = machine.pumps[static_cast<std::size_t>(pump)].feeds;
      fits.resize(log.cylinders.size());
      served = Eigen::VectorXd::Ones(log.samples());
      for (const int i : feeds) {
        known = known && log.cylinders[static_cast<std::size_t>(i)].command.size() > 0 &&
                machine.cylinders[static_cast<std::size_t>(i)].hydraulic();
      }
      if (!known) return;
      /// Rounds in which flows and supply are brought into agreement.
      /// @threshold [1] 1..100; chosen: the served share changes little from round to round
      constexpr int kIterations = 12;
      for (int iteration = 0; iteration < kIterations; ++iteration) {
        Eigen::VectorXd asked = Eigen::VectorXd::Zero(log.samples());
        for (const int i : feeds) {
          const auto c = static_cast<std::size_t>(i);
          const Eigen::VectorXd& u = log.cylinders[c].command;
          fits[c] = fit_gains(log, i, u.cwiseProduct(served));
          for (Eigen::Index k = 0; k < u.size(); ++k) {
            if (std::isnan(u[k])) continue;
            asked[k] += fits[c].gain(u[k]) * std::abs(u[k]) *
                        supply_area(machine.cylinders[c], u[k] > 0.0 ? 1 : -1);
          }
        }
        largest = asked.maxCoeff();
        if (soft && std::isfinite(limit)) {
          /// Exponent of the soft limit.
          /// @threshold [1] 2..100; chosen: at the limit 6 % less are served, at 0.8 of it 0.5 %
          constexpr double kExponent = 12.0;
          served = (1.0 + (asked.array() / limit).pow(kExponent)).pow(-1.0 / kExponent).matrix();
          continue;
        }
        if (!(largest > limit)) return;
        // Without demand the ratio is infinite and the share one.
        served = (limit / asked.array()).min(1.0).matrix();
      }
    }
  };
};

}  // namespace

std::unique_ptr<Effect> make_flow_saturation() { return std::make_unique<FlowSaturation>(); }

}  // namespace sparflow
