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
        .parameters =
            {{"share",
              "-",
              1.0,
              0.5,
              2.0,
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
             {"form",
              "-",
              1.0,
              0.0,
              3.0,
              0.0,
              "0: hard limit, flow shared in proportion; 1: the same with a smooth limit "
              "(power law of exponent 12); 2: hard limit, not shared: the highest load gets "
              "what the others leave; 3: hard limit in the flow balance of the pump's line (of "
              "pump_lag, where a model has that), in starts and stops as well",
              false,
              {0.0, 1.0, 2.0, 3.0},
              true,
              false,
              {"flow shared", "flow shared, smooth limit", "not shared: the highest load starves",
               "limit in the line's flow balance"}}},
        .equation =
            "Q_i = s Q_i(u), s = min(1, limit / sum of Q(u)), soft: (1 + (sum / "
            "limit)^12)^(-1/12), "
            "pump pressure - margin (1 - s^2); not shared: Q_i = Q_i(u) min(1, (p - p_i)/dp_i)^0.5 "
            "with the pump pressure p at which their sum is the limit; in the line's balance: "
            "C dp/dt = min(Q_pump, limit) - sum Q_i - C p/rest",
        .signals = {"commands", "position"},
        .confused_with = {"torque_limit", "valve_deadband", "pump_lag"},
        .separated_by = "each cylinder alone at full command, then all together",
        .citation =
            "H. Murrenhoff (2011), Grundlagen der Fluidtechnik, Teil 1: Hydraulik (sections "
            "with the compensator behind the edge share in proportion, those with it before do "
            "not)",
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
    if (shape_index == 1) return forms_known(log, at);
    const Demand demand(log, at, std::numeric_limits<double>::infinity(), Form::kShared);
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
    const Form form = shape.size() > 1 ? static_cast<Form>(std::lround(shape[1])) : Form::kShared;
    const Demand demand(log, at, shape[0], form);
    if (!demand.known) return false;
    columns.setZero(log.samples(), 2);
    if (pump && form == Form::kByLine) {
      const Eigen::VectorXd lost = lost_by_line(log, at, shape[0]);
      if (lost.size() == 0) return false;
      columns.col(0) = lost;
      return !columns.isZero(0.0);
    }
    if (pump && demand.lost.size() > 0) {
      columns.col(0) = -demand.lost;
      return true;
    }
    if (pump) {
      // An edge of constant opening carries s Q at s^2 of its pressure difference.
      columns.col(1) = (demand.of_all.array().square() - 1.0).matrix();
      return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
    }
    const Eigen::VectorXd& command =
        opening(log.cylinders[static_cast<std::size_t>(measured.index)]);
    if (by_pressure_drop(log, measured.index)) return false;
    const SectionFit& fit = demand.fits[static_cast<std::size_t>(measured.index)];
    const Eigen::VectorXd& served = demand.served[static_cast<std::size_t>(measured.index)];
    for (Eigen::Index k = 0; k < log.samples(); ++k)
      columns(k, 0) = fit.gain(command[k]) * command[k] * (served[k] - 1.0);
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }

 private:
  enum class Form { kShared, kSoft, kUnshared, kByLine };

  /// [-] What the model's dead band and lag leave of the command.
  static const Eigen::VectorXd& opening(const CylinderSeries& c) {
    return c.late.size() > 0 ? c.late : c.command;
  }
  /// Whether the model computes the flow of a cylinder from the measured pump pressure, in which the lack of flow shows already.
  static bool by_pressure_drop(const MachineSeries& log, int cylinder) {
    return log.cylinders[static_cast<std::size_t>(cylinder)].passed.size() > 0;
  }

  /// What the limit costs by the law that the pump's pressure follows, if that knows the flow; empty otherwise. [samples, Pa]
  static Eigen::VectorXd lost_by_line(const MachineSeries& log, int pump, double limit) {
    const LawOfModel& law = log.pumps[static_cast<std::size_t>(pump)].following;
    if (law.effect == nullptr) return {};
    return law.effect->lost_at_flow_limit(log, pump, law.at, law.values, limit);
  }
  static bool has_line(const MachineSeries& log, int pump) {
    return lost_by_line(log, pump, std::numeric_limits<double>::infinity()).size() > 0;
  }
  /// Forms whose data the log has. [as the parameter]
  static std::vector<double> forms_known(const MachineSeries& log, int pump) {
    std::vector<double> forms = {0.0, 1.0};
    if (loads_known(log, pump)) forms.push_back(2.0);
    if (has_line(log, pump)) forms.push_back(3.0);
    return forms;
  }

  /// Whether the log says which pressure each section asks for and has at its load.
  static bool loads_known(const MachineSeries& log, int pump) {
    bool known = log.pumps[static_cast<std::size_t>(pump)].asked.rows() > 0;
    for (const int i : log.machine->pumps[static_cast<std::size_t>(pump)].feeds) {
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
      known = known && c.pressure_a.size() > 0 && c.pressure_b.size() > 0;
    }
    return known;
  }

  /// Flow that the valve sections demand. Their gains and the delivered share depend on each other; they are computed
  /// alternately.
  struct Demand {
    bool known = true;
    std::vector<SectionFit> fits;         ///< by cylinder
    std::vector<Eigen::VectorXd> served;  ///< [samples] by cylinder: delivered share of its demand
    Eigen::VectorXd of_all;               ///< [samples] the same of the total demand
    double largest = 0.0;                 ///< [m^3/s] largest total demand
    Eigen::VectorXd
        lost;  ///< [samples, Pa] pump pressure that is missing; empty where it is not known

    Demand(const MachineSeries& log, int pump, double limit, Form form) {
      const Machine& machine = *log.machine;
      const std::vector<int>& feeds = machine.pumps[static_cast<std::size_t>(pump)].feeds;
      fits.resize(log.cylinders.size());
      of_all = Eigen::VectorXd::Ones(log.samples());
      served.assign(log.cylinders.size(), of_all);
      for (const int i : feeds) {
        known = known && log.cylinders[static_cast<std::size_t>(i)].command.size() > 0 &&
                machine.cylinders[static_cast<std::size_t>(i)].hydraulic();
      }
      const bool by_load = form == Form::kUnshared || form == Form::kByLine;
      known = known && (!by_load || loads_known(log, pump));
      if (!known) return;
      /// Rounds in which flows and supply are brought into agreement.
      /// @threshold [1] 1..100; chosen: the served share changes little from round to round
      constexpr int kIterations = 12;
      Eigen::MatrixXd asked(log.samples(), static_cast<Eigen::Index>(feeds.size()));
      for (int iteration = 0; iteration < kIterations; ++iteration) {
        asked.setZero();
        for (std::size_t f = 0; f < feeds.size(); ++f) {
          const auto c = static_cast<std::size_t>(feeds[f]);
          const Eigen::VectorXd& u = opening(log.cylinders[c]);
          fits[c] =
              fit_gains(log, feeds[f],
                        u.cwiseProduct(by_pressure_drop(log, feeds[f]) ? log.cylinders[c].passed
                                                                       : served[c]));
          for (Eigen::Index k = 0; k < u.size(); ++k) {
            if (std::isnan(u[k])) continue;
            asked(k, static_cast<Eigen::Index>(f)) =
                fits[c].gain(u[k]) * std::abs(u[k]) *
                supply_area(machine.cylinders[c], u[k] > 0.0 ? 1 : -1);
          }
        }
        const Eigen::VectorXd total = asked.rowwise().sum();
        largest = total.maxCoeff();
        if (form != Form::kSoft && !(largest > limit)) return;
        if (!std::isfinite(limit)) continue;
        /// Exponent of the soft limit.
        /// @threshold [1] 2..100; chosen: at the limit 6 % less are served, at 0.8 of it 0.5 %
        constexpr double kExponent = 12.0;
        // Without demand the ratio is infinite and the share one.
        if (form == Form::kSoft)
          of_all = (1.0 + (total.array() / limit).pow(kExponent)).pow(-1.0 / kExponent);
        else
          of_all = (limit / total.array()).min(1.0);
        if (by_load) {
          serve_by_load(log, pump, asked, limit);
          continue;
        }
        for (const int i : feeds) served[static_cast<std::size_t>(i)] = of_all;
      }
    }

    /// The pump's pressure falls until the edges take no more than the pump delivers; an edge of constant opening carries
    /// the root of its share of the pressure difference.
    void serve_by_load(const MachineSeries& log, int pump, const Eigen::MatrixXd& asked,
                       double limit) {
      const PumpSeries& series = log.pumps[static_cast<std::size_t>(pump)];
      const std::vector<int>& feeds = log.machine->pumps[static_cast<std::size_t>(pump)].feeds;
      lost = Eigen::VectorXd::Zero(asked.rows());
      for (const int i : feeds) served[static_cast<std::size_t>(i)].setOnes();
      Eigen::VectorXd edge(asked.cols());
      for (Eigen::Index k = 0; k < asked.rows(); ++k) {
        if (asked.row(k).sum() <= limit) continue;
        double highest = 0.0;
        for (Eigen::Index f = 0; f < asked.cols(); ++f) {
          const CylinderSeries& c =
              log.cylinders[static_cast<std::size_t>(feeds[static_cast<std::size_t>(f)])];
          const double load = c.direction[k] > 0 ? c.pressure_a[k] : c.pressure_b[k];
          const double margin = series.asked(k, f) - load;
          /// Least pressure difference over an edge at full flow.
          /// @threshold [Pa] 1e4..1e6; chosen: below it an edge is no control of flow; models may have learned none
          constexpr double kLeastDrop_Pa = 2e5;
          edge[f] = std::isfinite(margin) ? std::max(margin, kLeastDrop_Pa) : kLeastDrop_Pa;
          if (asked(k, f) > 0.0 && std::isfinite(series.asked(k, f)))
            highest = std::max(highest, series.asked(k, f));
        }
        const auto share = [&](Eigen::Index f, double p) {
          const double missing = series.asked(k, f) - p;
          return missing > 0.0 ? std::sqrt(std::max(0.0, 1.0 - missing / edge[f])) : 1.0;
        };
        // The sum of flows rises with the pressure.
        constexpr double kResolved_Pa =
            0.1;  // no threshold: rounding of a pressure of 1e7 Pa is 1e-9 Pa
        double low = 0.0, high = highest;
        while (high - low > kResolved_Pa) {
          const double p = 0.5 * (low + high);
          double sum = 0.0;
          for (Eigen::Index f = 0; f < asked.cols(); ++f)
            if (asked(k, f) > 0.0) sum += asked(k, f) * share(f, p);
          (sum > limit ? high : low) = p;
        }
        lost[k] = highest - low;
        for (Eigen::Index f = 0; f < asked.cols(); ++f)
          if (asked(k, f) > 0.0)
            served[static_cast<std::size_t>(feeds[static_cast<std::size_t>(f)])][k] = share(f, low);
      }
    }
  };
};

}  // namespace

std::unique_ptr<Effect> make_flow_saturation() { return std::make_unique<FlowSaturation>(); }

}  // namespace sparflow
