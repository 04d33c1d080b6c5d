#include <algorithm>
#include <cmath>
#include <limits>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

/// An edge of constant opening carries the root of its pressure difference. A compensator keeps that difference at its
/// setting while the pump's pressure suffices. Without one the flow goes on rising; in a single log that is the same law with a
/// setting above all differences and another gain, so that only a reference, which tells the gain, determines it.
/// A compensator before the edge knows its own section's load. One behind the edge knows the highest load of all sections (flow
/// sharing), so that every edge has the same difference left where the pump falls short, and all sections lose in proportion.
class ValvePressureDrop final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "valve_pressure_drop",
        .title = "flow limited by the valve's pressure drop",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters = {{"share",
                        "-",
                        1.0,
                        0.5,
                        2.0,
                        1.0,
                        "share of the flow that follows the pressure drop, about 1",
                        true,
                        {}},
                       {"setting",
                        "bar",
                        units::kBar,
                        0.5 * units::kBar,
                        500 * units::kBar,
                        10 * units::kBar,
                        "pressure drop at which the valve passes its flow: the compensator's "
                        "setting; above all pressure drops of the log the valve has none",
                        false,
                        {2 * units::kBar, 5 * units::kBar, 10 * units::kBar, 20 * units::kBar,
                         40 * units::kBar, 80 * units::kBar, 160 * units::kBar, 320 * units::kBar}},
                       {"compensator",
                        "-",
                        1.0,
                        0.0,
                        2.0,
                        1.0,
                        "1: holds the pressure drop at the setting, where the pump's pressure "
                        "suffices; 2: the same behind the edge, where it holds the drop to the "
                        "highest load of all sections (flow sharing); 0: has failed, so that the "
                        "flow rises beyond",
                        false,
                        {1.0, 2.0, 0.0},
                        true,
                        false,
                        {"compensator before the edge", "compensator behind the edge, flow shared",
                         "compensator has failed"}}},
        .equation =
            "Q = Q_valve(u) (max(0, p_pump - p) / setting)^0.5, with a compensator at most "
            "Q_valve(u); p = pressure of the supply chamber, with flow sharing the highest of "
            "the pump's cylinders that are commanded",
        .signals = {"command", "position", "pump pressure", "chamber pressures"},
        .confused_with = {"line_loss", "valve_lag", "flow_saturation", "pump_lag"},
        .separated_by =
            "the same command alone and beside a cylinder of higher load; a step of "
            "the command from standby",
        .citation =
            "H. E. Merritt (1967), Hydraulic Control Systems, eq. 3-34 (orifice equation); "
            "P. Krus (1988), On Load Sensing Fluid Power Systems (flow sharing); "
            "H. Murrenhoff (2011), Grundlagen der Fluidtechnik, Teil 1: Hydraulik (pressure "
            "compensators)",
        // A compensator's spring and flow forces let the flow bend before its setting.
        .form_error = 0.1,
        .in_motion = "nothing: a motion prescribes the flow; only the command for it is larger"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }
  bool needs_reference(std::span<const double> shape) const override { return shape[1] < 0.5; }

  bool acts_on_opening() const override { return true; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    const Eigen::VectorXd& command = c.late.size() > 0 ? c.late : c.command;
    const Eigen::VectorXd lacking = lacking_flow(log, at, shape);
    if (lacking.size() == 0) return false;
    const Eigen::VectorXd passed = command.cwiseProduct((1.0 - lacking.array()).matrix());
    const SectionFit fit = fit_gains(log, at, passed, measured.sections);
    columns.resize(log.samples(), 1);
    for (Eigen::Index k = 0; k < log.samples(); ++k)
      columns(k, 0) = -fit.gain(command[k]) * command[k] * lacking[k];
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }
  Eigen::VectorXd passed_flow(const MachineSeries& log, int cylinder, int at,
                              std::span<const double> p,
                              const Eigen::VectorXd& lost) const override {
    if (cylinder != at) return {};
    const Eigen::VectorXd lacking = lacking_flow(log, at, p.subspan(1), lost);
    return lacking.size() == 0 ? lacking : (1.0 - p[0] * lacking.array()).matrix();
  }

 private:
  /// Highest pressure in the supply chambers of the cylinders that are commanded [samples, Pa]; 0 where none is.
  static Eigen::VectorXd highest_load(const MachineSeries& log, const std::vector<int>& feeds) {
    Eigen::VectorXd highest = Eigen::VectorXd::Zero(log.samples());
    for (const int i : feeds) {
      const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(i)];
      const Eigen::VectorXd& command = c.opening.size() > 0 ? c.opening : c.command;
      if (command.size() == 0 || c.pressure_a.size() == 0 || c.pressure_b.size() == 0) continue;
      for (Eigen::Index k = 0; k < log.samples(); ++k) {
        const double load = command[k] > 0.0   ? c.pressure_a[k]
                            : command[k] < 0.0 ? c.pressure_b[k]
                                               : 0.0;
        highest[k] = std::max(highest[k], load);
      }
    }
    return highest;
  }
  /// Share of the valve's flow that the measured pressure drop does not pass, negative where it passes more; empty where it is
  /// not measured.
  static Eigen::VectorXd lacking_flow(const MachineSeries& log, int at,
                                      std::span<const double> shape,
                                      const Eigen::VectorXd& lost = {}) {
    const double setting = shape[0];
    const double most = shape[1] < 0.5 ? std::numeric_limits<double>::infinity() : 1.0;
    const CylinderSeries& c = log.cylinders[static_cast<std::size_t>(at)];
    const int pump = log.machine->pump_of_cylinder(at);
    if (pump < 0) return {};
    const bool shares = shape[1] > 1.0;
    const std::vector<int>& feeds = log.machine->pumps[static_cast<std::size_t>(pump)].feeds;
    if (shares && feeds.size() < 2) return {};
    const Eigen::VectorXd& supply = log.pumps[static_cast<std::size_t>(pump)].pressure;
    const Eigen::VectorXd& command = c.opening.size() > 0 ? c.opening : c.command;
    if (command.size() == 0 || supply.size() == 0 || c.pressure_a.size() == 0 ||
        c.pressure_b.size() == 0)
      return {};
    Eigen::VectorXd lacking = Eigen::VectorXd::Zero(log.samples());
    const Eigen::VectorXd highest = shares ? highest_load(log, feeds) : Eigen::VectorXd();
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      double drop = supply[k] - (command[k] > 0.0 ? c.pressure_a[k] : c.pressure_b[k]) -
                    (lost.size() > 0 ? lost[k] : 0.0);
      if (shares) drop = std::min(drop, supply[k] - highest[k]);
      if (command[k] != 0.0) lacking[k] = 1.0 - std::sqrt(std::clamp(drop / setting, 0.0, most));
    }
    return lacking;
  }
};

}  // namespace

std::unique_ptr<Effect> make_valve_pressure_drop() { return std::make_unique<ValvePressureDrop>(); }

}  // namespace sparflow
