#include <algorithm>
#include <array>
#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

/// The position of the chamber's pressure sensor decides which channel shows the loss. With a sensor at the cylinder the
/// pump pressure contains the loss while this cylinder is the load-sensing leader. With a sensor at the valve the
/// measured force contains A_supply times the loss, and the pump adds nothing. A log shows one of the two, never both.
/// With a sensor at the cylinder the drop over the valve's edge is smaller by the loss than the one that is measured, so that the flow
/// is smaller where the model computes it from that drop (valve_pressure_drop).
class LineLoss final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "line_loss",
        .title = "supply-line pressure loss",
        .stage = EffectStage::kPump,
        .place = EffectPlace::kCylinder,
        .parameters = {{"k",
                        "bar/(l/min)^2",
                        units::kBarPerLpm2,
                        0.0,
                        0.2 * units::kBarPerLpm2,
                        2e-3 * units::kBarPerLpm2,
                        "turbulent part",
                        true,
                        {}},
                       {"k1",
                        "bar/(l/min)",
                        units::kBarPerLpm,
                        0.0,
                        2.0 * units::kBarPerLpm,
                        0.1 * units::kBarPerLpm,
                        "laminar part",
                        true,
                        {}},
                       {"at_valve",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "0: pressure sensors at the cylinder, 1: at the valve",
                        false,
                        {0.0, 1.0},
                        true,
                        false,
                        {"sensors at the cylinder", "sensors at the valve"}}},
        .equation =
            "dp = k Q^2 + k1 Q; p_pump += dp while the cylinder is the load-sensing leader, or "
            "(sensor at the valve) p_supply += dp and F += A_supply dp; beside "
            "valve_pressure_drop the drop over the valve is smaller by dp",
        .signals = {"pump pressure or chamber pressures", "commands", "position"},
        .confused_with = {"flow_dependent_margin", "viscous_friction", "oil_temperature",
                          "valve_pressure_drop"},
        .separated_by =
            "steps of this cylinder at three flows, alone and while another cylinder is the "
            "load-sensing leader",
        .citation =
            "H. E. Merritt (1967), Hydraulic Control Systems, ch. 3 (laminar and turbulent "
            "losses in lines)",
        .form_error = 0.2,
        .in_motion =
            "pump: demand of the cylinder (sensors at the cylinder), or force and with it "
            "working pressure (sensors at the valve)"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override {
    return {EvidenceKind::kPump, EvidenceKind::kForce, EvidenceKind::kFlow};
  }
  bool depends_on_size() const override { return true; }

  bool acts_on_opening() const override { return true; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow)
      return Effect::columns(log, measured, at, shape, columns);
    std::array<double, 3> p = {info().parameters[0].typical, info().parameters[1].typical,
                               shape[0]};
    if (measured.index != at || at_valve(p)) return false;
    if (measured.about.size() == 2 && measured.about[0] + measured.about[1] > 0.0)
      std::copy(measured.about.begin(), measured.about.end(), p.begin());
    const Passed flow = passed(log, at, p, measured.sections);
    if (flow.share.size() == 0) return false;
    columns.setZero(log.samples(), 2);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double lost = loss(flow.flow[k], p);
      if (!(lost > 0.0)) continue;
      const double for_each_pascal = flow.speed[k] * (flow.share[k] - flow.without[k]) / lost;
      columns(k, 0) = for_each_pascal * flow.flow[k] * flow.flow[k];
      columns(k, 1) = for_each_pascal * flow.flow[k];
    }
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }
  Eigen::VectorXd lost_behind_valve(const MachineSeries& log, int cylinder, int at,
                                    std::span<const double> p) const override {
    if (cylinder != at || at_valve(p)) return {};
    return passed(log, at, p).flow.unaryExpr([&](double q) { return loss(q, p); });
  }

  template <class T>
  void add_demand_law(const Instant<T>& s, int at, std::span<const double> p,
                      std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    if (!at_valve(p)) out[i] += loss(s.flow[i], p);
  }
  template <class T>
  void add_force_law(const Instant<T>& s, int at, std::span<const double> p,
                     std::span<T> out) const {
    const auto i = static_cast<std::size_t>(at);
    if (!at_valve(p) || s.side[i] == 0) return;
    out[i] += loss(s.flow[i], p) * (s.side[i] * supply_area(s.machine->cylinders[i], s.side[i]));
  }
  SPARFLOW_EFFECT_LAW(add_demand)
  SPARFLOW_EFFECT_LAW(add_force)

 private:
  static bool at_valve(std::span<const double> p) { return p[2] >= 0.5; }
  template <class T>
  static T loss(const T& flow, std::span<const double> p) {
    return flow * (p[0] * flow + p[1]);
  }

  /// What a valve passes whose flow follows the pressure drop, with a loss behind it. Empty without such a law.
  struct Passed {
    Eigen::VectorXd share,
        without;            ///< [samples, -] of the valve's flow, with and without the loss
    Eigen::VectorXd speed;  ///< [samples, m/s] of the rod at a share of one
    Eigen::VectorXd flow;   ///< [samples, m^3/s] into the supply chamber, >= 0
  };
  /// The share solves share = passed(drop - loss(share * flow)), whose right side falls with the share.
  static Passed passed(const MachineSeries& log, int at, std::span<const double> p,
                       SectionPool* sections = nullptr) {
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    const LawOfModel& law = c.passing;
    Passed out;
    if (law.effect == nullptr) return out;
    out.without = law.effect->passed_flow(log, at, law.at, law.values, {});
    if (out.without.size() == 0) return out;
    const Eigen::VectorXd& opening = c.late.size() > 0 ? c.late : c.command;
    const Cylinder& cylinder = log.machine->cylinders[static_cast<std::size_t>(at)];
    out.share = out.without;
    out.speed.resize(log.samples());
    out.flow.resize(log.samples());
    for (int turn = 0; turn < kTurns; ++turn) {
      const SectionFit gains = fit_gains(log, at, opening.cwiseProduct(out.share), sections);
      for (Eigen::Index k = 0; k < log.samples(); ++k) {
        const double u = opening[k];
        out.speed[k] = gains.gain(u) * u;
        out.flow[k] = std::abs(out.speed[k]) * supply_area(cylinder, u > 0.0 ? 1 : -1);
      }
      out.share = share_passed(log, law, at, p, out);
    }
    out.flow = out.flow.cwiseProduct(out.share.cwiseMax(0.0));
    return out;
  }
  /// By bisection between nothing and the share without a loss.
  static Eigen::VectorXd share_passed(const MachineSeries& log, const LawOfModel& law, int at,
                                      std::span<const double> p, const Passed& valve) {
    Eigen::VectorXd lo = Eigen::VectorXd::Zero(log.samples()), hi = valve.without.cwiseMax(0.0);
    Eigen::VectorXd lost(log.samples());
    for (int halving = 0; halving < kHalvings; ++halving) {
      const Eigen::VectorXd middle = 0.5 * (lo + hi);
      for (Eigen::Index k = 0; k < log.samples(); ++k) lost[k] = loss(middle[k] * valve.flow[k], p);
      const Eigen::VectorXd there = law.effect->passed_flow(log, at, law.at, law.values, lost);
      for (Eigen::Index k = 0; k < log.samples(); ++k)
        (there[k] > middle[k] ? lo : hi)[k] = middle[k];
    }
    return 0.5 * (lo + hi);
  }
  /// Turns in which the valve's gains and the share are computed, which depend on each other.
  /// @threshold [1] 2..20; numerical: an edge that passes a half everywhere has a share within 2 % then
  static constexpr int kTurns = 5;
  /// Halvings of the interval in which the share lies.
  /// @threshold [1] 8..40; numerical: the last of them changes a share by a millionth
  static constexpr int kHalvings = 20;
};

}  // namespace

std::unique_ptr<Effect> make_line_loss() { return std::make_unique<LineLoss>(); }

}  // namespace sparflow
