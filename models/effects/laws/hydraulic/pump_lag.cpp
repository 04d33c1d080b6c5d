#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/laws/hydraulic/pump_regulator.h"
#include "models/effects/memory.h"
#include "models/effects/valve_flow.h"

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
        .parameters = parameters(),
        .equation =
            "tau dp/dt + p = demand, or (tau/2 d/dt + 1)^2 p = demand, or p''/w^2 + 2 d p'/w + p = "
            "demand, or tau dp/dt = min(demand - p, standby); with late valves: the demand of "
            "those open a time 'late' ago, and rest dp/dt = -p above standby where none was; "
            "with the line's flow balance: C dp/dt = Q_pump - sum Q_valves - C p/rest, Q_pump by a "
            "regulator with proportional and integral action",
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
    if (!is_complete(log, at, shape)) return false;
    columns = late(log, at, Eigen::VectorXd(), shape) - demand;
    return true;
  }

  Eigen::VectorXd followed_demand(const MachineSeries& log, int pump, int at,
                                  std::span<const double> p,
                                  const Eigen::VectorXd& change) const override {
    if (pump != at || log.pumps[static_cast<std::size_t>(pump)].demand.size() == 0) return {};
    const std::span<const double> shape = p.subspan(1);
    if (!is_complete(log, at, shape)) return {};
    const Eigen::VectorXd late_change =
        late(log, at, change, shape) - late(log, at, Eigen::VectorXd(), shape);
    return (1.0 - p[0]) * change + p[0] * late_change;
  }

  Eigen::VectorXd lost_at_flow_limit(const MachineSeries& log, int pump, int at,
                                     std::span<const double> p, double limit) const override {
    const std::span<const double> shape = p.subspan(1);
    if (pump != at || log.pumps[static_cast<std::size_t>(pump)].demand.size() == 0 ||
        form_of(shape) != Form::kFlowBalance || !is_complete(log, at, shape))
      return {};
    const PumpSeries& series = log.pumps[static_cast<std::size_t>(pump)];
    const std::vector<OpenSection> open = sections(log, series, Eigen::VectorXd(), shape);
    const auto pressure = [&](double most) {
      return regulated_pressure(log, series.standby, open,
                                {shape[kTau], shape[kCapacity], shape[kRest], most}, series.demand);
    };
    return p[0] * (pressure(limit) - pressure(std::numeric_limits<double>::infinity()));
  }

 private:
  static std::vector<std::string> variants() {
    return {"first order",
            "two stages",
            "two stages, rising faster",
            "second order that swings",
            "built up by its own margin",
            "flow balance of the pump's line"};
  }
  static std::vector<EffectParameter> parameters() {
    return {{"share",
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
             5.0,
             0.0,
             "variant of the law; 2 rises four times as fast as it falls, 3 has the damping ratio "
             "0.3, in 4 the load-sensing port sees no more than the pump's pressure until the "
             "load's check valve opens, in 5 tau is the regulator's before closed valves",
             false,
             {0.0, 1.0, 2.0, 3.0, 4.0, 5.0},
             true,
             false,
             variants()},
            {"rest",
             "s",
             1.0,
             0.0,
             10.0,
             0.4,
             "time constant with which the pressure falls by leakage while every valve is closed",
             false,
             {0.4},
             false,
             true},
            {"late",
             "s",
             1.0,
             0.0,
             1.0,
             0.1,
             "delay between a lever and what its valve asks of the pump",
             false,
             {0.1},
             false,
             true},
            {"opening",
             "-",
             1.0,
             0.0,
             0.5,
             0.06,
             "command from which a valve asks for pressure",
             false,
             {0.06},
             false,
             true},
            {"capacity",
             "l/bar",
             units::kLitrePerBar,
             0.0,
             0.1 * units::kLitrePerBar,
             1e-3 * units::kLitrePerBar,
             "oil that the line between pump and valves takes up with its pressure (volume over "
             "bulk modulus); only with form 5",
             false,
             {0.0, 3e-4 * units::kLitrePerBar, 1e-3 * units::kLitrePerBar},
             false,
             true}};
  }

  // no threshold: places among the nonlinear parameters
  static constexpr std::size_t kTau = 0, kForm = 1, kRest = 2, kLate = 3, kOpening = 4,
                               kCapacity = 5;

  /// Damping ratio of a regulator that hunts.
  /// @threshold [1] 0.1..0.6; chosen: two or three swings are seen before the pressure rests
  static constexpr double kDamping = 0.3;
  /// Time constant while falling over that while rising, where they differ.
  /// @threshold [1] 1..20; chosen: a regulator destrokes against its spring, and the lever's valve closes late
  static constexpr double kFallingToRising = 4.0;

  enum class Form { kFirstOrder, kTwoStages, kFasterRising, kHunting, kOwnMargin, kFlowBalance };

  static bool is_late(std::span<const double> shape) {
    return shape.size() > kOpening && shape[kRest] > 0.0;
  }
  static Form form_of(std::span<const double> shape) {
    return static_cast<Form>(std::lround(shape[kForm]));
  }
  /// Whether the variant has its parameters, and the log what it needs.
  static bool is_complete(const MachineSeries& log, int at, std::span<const double> shape) {
    const bool balance = form_of(shape) == Form::kFlowBalance;
    if (balance != (shape.size() > kCapacity && shape[kCapacity] > 0.0)) return false;
    if (is_late(shape) && log.pumps[static_cast<std::size_t>(at)].asked.rows() == 0) return false;
    return !balance || (is_late(shape) && chambers_known(log, at));
  }
  static bool chambers_known(const MachineSeries& log, int at) {
    const std::vector<int>& feeds = log.pumps[static_cast<std::size_t>(at)].feeds;
    return std::all_of(feeds.begin(), feeds.end(), [&](int i) {
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
      return c.command.size() > 0 && c.pressure_a.size() > 0 && c.pressure_b.size() > 0;
    });
  }

  static constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

  /// What the valves ask for that are open late.
  struct LateDemand {
    Eigen::VectorXd pressure;  ///< [samples, Pa] demand, standby where every valve is closed
    std::vector<char> closed;  ///< [samples] whether every valve is closed
  };

  static Eigen::VectorXd late(const MachineSeries& log, int at, const Eigen::VectorXd& change,
                              std::span<const double> shape) {
    const PumpSeries& pump = log.pumps[static_cast<std::size_t>(at)];
    const Form form = form_of(shape);
    if (form == Form::kFlowBalance)
      return regulated_pressure(
          log, pump.standby, sections(log, pump, change, shape),
          {shape[kTau], shape[kCapacity], shape[kRest], std::numeric_limits<double>::infinity()},
          pump.demand);
    if (!is_late(shape))
      return followed(log, pump,
                      change.size() > 0 ? Eigen::VectorXd(pump.demand + change) : pump.demand,
                      {shape[kTau], form});
    const LateDemand demand = of_open_valves(log, pump, change, shape[kLate], shape[kOpening]);
    if (form == Form::kFirstOrder || form == Form::kOwnMargin)
      return discharged(log, pump, demand, {shape[kTau], form, shape[kRest]});
    return above_discharge(log, followed(log, pump, demand.pressure, {shape[kTau], form}), demand,
                           shape[kRest]);
  }

  struct Times {
    double tau = 0.0;
    Form form = Form::kFirstOrder;
    double rest = 0.0;
  };

  static Eigen::VectorXd followed(const MachineSeries& log, const PumpSeries& pump,
                                  const Eigen::VectorXd& demand, const Times& t) {
    const double rising = 2.0 / (1.0 + kFallingToRising) * t.tau;
    switch (t.form) {
      case Form::kFirstOrder:
        return first_order_lag(log, demand, t.tau);
      case Form::kTwoStages:
        return first_order_lag(log, first_order_lag(log, demand, 0.5 * t.tau), 0.5 * t.tau);
      case Form::kFasterRising: {
        const double r = 0.5 * rising, f = kFallingToRising * r;
        return first_order_lag(log, first_order_lag(log, demand, r, f), r, f);
      }
      case Form::kOwnMargin:
        return pump.standby > 0.0 ? limited_lag(log, demand, pump.standby, t.tau)
                                  : first_order_lag(log, demand, t.tau);
      default:
        return second_order_lag(log, demand, 2.0 * kDamping / t.tau, kDamping);
    }
  }

  /// A valve is open from a command `opening` on, a time `late` after the lever; one that closes late asks for what it asked last.
  static LateDemand of_open_valves(const MachineSeries& log, const PumpSeries& pump,
                                   const Eigen::VectorXd& change, double late, double opening) {
    LateDemand out;
    out.pressure = Eigen::VectorXd::Constant(log.samples(), pump.standby);
    out.closed.assign(static_cast<std::size_t>(log.samples()), 1);
    for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
      const Eigen::VectorXd& lever = log.cylinders[static_cast<std::size_t>(pump.feeds[f])].command;
      if (lever.size() == 0) continue;
      const Eigen::VectorXd valve = delayed(log, lever, late);
      for (const auto& [first, last] : log.runs) {
        // what it asked last, extending and retracting: the lever may be at rest or reversed already
        double extending = kNothing, retracting = kNothing;
        for (Eigen::Index k = first; k < last; ++k) {
          const double now =
              pump.asked(k, static_cast<Eigen::Index>(f)) + (change.size() > 0 ? change[k] : 0.0);
          if (std::isfinite(now)) (lever[k] > 0.0 ? extending : retracting) = now;
          const double asked = valve[k] > 0.0 ? extending : retracting;
          if (!(std::abs(valve[k]) > opening) || !std::isfinite(asked)) continue;
          out.closed[static_cast<std::size_t>(k)] = 0;
          out.pressure[k] = std::max(out.pressure[k], asked);
        }
      }
    }
    return out;
  }

  /// The same valves with the flows that they pass.
  static std::vector<OpenSection> sections(const MachineSeries& log, const PumpSeries& pump,
                                           const Eigen::VectorXd& change,
                                           std::span<const double> shape) {
    std::vector<OpenSection> out(pump.feeds.size());
    for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(pump.feeds[f])];
      const Eigen::VectorXd valve = delayed(log, c.command, shape[kLate]);
      OpenSection& s = out[f];
      s.load = Eigen::VectorXd::Constant(log.samples(), kNothing);
      s.margin = s.flow = Eigen::VectorXd::Zero(log.samples());
      Eigen::VectorXd opening = s.flow;
      for (const auto& [first, last] : log.runs) {
        double extending = kNothing, retracting = kNothing;
        for (Eigen::Index k = first; k < last; ++k) {
          const double asked = pump.asked(k, static_cast<Eigen::Index>(f));
          if (std::isfinite(asked))
            (c.command[k] > 0.0 ? extending : retracting) =
                asked - (c.command[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k]);
          const double beyond = std::abs(valve[k]) - shape[kOpening];
          s.margin[k] = valve[k] > 0.0 ? extending : retracting;
          if (!(beyond > 0.0) || !(s.margin[k] > 0.0)) continue;
          s.load[k] = (valve[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k]) +
                      (change.size() > 0 ? change[k] : 0.0);
          opening[k] = std::copysign(beyond, valve[k]);
        }
      }
      add_flow(log, pump, pump.feeds[f], opening, s);
    }
    return out;
  }

  /// The flow of an open valve at its full pressure drop: the measured speed gives its gain, where the measured pressures leave a drop.
  static void add_flow(const MachineSeries& log, const PumpSeries& pump, int cylinder,
                       const Eigen::VectorXd& opening, OpenSection& section) {
    Eigen::VectorXd passed = opening;
    for (Eigen::Index k = 0; k < log.samples(); ++k)
      if (opening[k] != 0.0 && std::isfinite(pump.pressure[k]))
        passed[k] *= passed_share(pump.pressure[k] - section.load[k], section.margin[k]);
    const SectionFit fit = fit_gains(log, cylinder, passed);
    const Cylinder& c = log.machine->cylinders[static_cast<std::size_t>(cylinder)];
    for (Eigen::Index k = 0; k < log.samples(); ++k)
      section.flow[k] = std::max(0.0, fit.gain(opening[k])) * std::abs(opening[k]) *
                        supply_area(c, opening[k] > 0.0 ? 1 : -1);
  }

  /// One stage, which falls by leakage alone while every valve is closed.
  static Eigen::VectorXd discharged(const MachineSeries& log, const PumpSeries& pump,
                                    const LateDemand& demand, const Times& t) {
    const bool limited = t.form == Form::kOwnMargin && pump.standby > 0.0;
    Eigen::VectorXd y = demand.pressure;
    for (const auto& [first, last] : log.runs) {
      for (Eigen::Index k = first + 1; k < last; ++k) {
        const double dt = log.time[k] - log.time[k - 1], from = y[k - 1], target = y[k];
        if (demand.closed[static_cast<std::size_t>(k)] != 0 && from > target)
          y[k] = std::max(target, from * std::exp(-dt / t.rest));
        else
          y[k] = limited ? limited_step({from, target, dt}, pump.standby, t.tau)
                         : target + std::exp(-dt / t.tau) * (from - target);
      }
    }
    return y;
  }

  /// The same where a pressure has several stages: it is no lower than what leakage leaves.
  static Eigen::VectorXd above_discharge(const MachineSeries& log, Eigen::VectorXd y,
                                         const LateDemand& demand, double rest) {
    for (const auto& [first, last] : log.runs)
      for (Eigen::Index k = first + 1; k < last; ++k)
        if (demand.closed[static_cast<std::size_t>(k)] != 0)
          y[k] = std::max(y[k], y[k - 1] * std::exp(-(log.time[k] - log.time[k - 1]) / rest));
    return y;
  }
};

}  // namespace

std::unique_ptr<Effect> make_pump_lag() { return std::make_unique<PumpLag>(); }

}  // namespace sparflow
