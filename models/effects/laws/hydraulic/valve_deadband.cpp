#include <algorithm>
#include <cmath>

#include "models/effects/builtin.h"
#include "models/effects/hydraulics.h"
#include "models/effects/valve_flow.h"

namespace sparflow {
namespace {

/// Beyond the dead band the flow is smaller by gain * u0 than the straight line through zero; inside it there is none.
/// A least-squares fit to the log gives the dead band's end (models/effects/valve_flow.h), so that the column is linear
/// in u0 and few samples inside the dead band suffice.
class ValveDeadband final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info = {
        .id = "valve_deadband",
        .title = "valve dead band",
        .stage = EffectStage::kFlow,
        .place = EffectPlace::kCylinder,
        .parameters = {{"u0_extend", "-", 1.0, 0.0, 0.4, 0.06, "dead band extending", true, {}},
                       {"u0_retract", "-", 1.0, 0.0, 0.4, 0.06, "dead band retracting", true, {}},
                       {"full_flow",
                        "-",
                        1.0,
                        0.0,
                        1.0,
                        0.0,
                        "1: full command still gives full flow, g = gain / (1 - u0); 0: it gives "
                        "gain * u0 less",
                        false,
                        {0.0, 1.0},
                        true,
                        false,
                        {"gain stays", "full flow stays"}}},
        .equation = "Q = g max(0, |u| - u0), g = gain or gain / (1 - u0)",
        .signals = {"command", "position"},
        .confused_with = {"valve_lag"},
        .separated_by = "slow ramps of the command through zero",
        .citation = "H. E. Merritt (1967), Hydraulic Control Systems, ch. 5 (overlapped spools)",
        .form_error = 0.1,
        .in_motion = "nothing: a motion prescribes the flow; only the command for it is larger"};
    return info;
  }
  std::vector<int> places(const Machine& machine) const override {
    return hydraulic_cylinders(machine);
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kFlow}; }

  void shape_opening(int cylinder, int at, std::span<const double> p,
                     Eigen::VectorXd& opening) const override {
    if (cylinder != at) return;
    const bool full_flow = p[2] >= 0.5;
    for (double& u : opening) {
      const double band = u > 0.0 ? p[0] : p[1], beyond = std::max(0.0, std::abs(u) - band);
      u = std::copysign(full_flow ? beyond / (1.0 - band) : beyond, u);
    }
  }

  bool acts_on_opening() const override { return true; }

  bool columns(const MachineSeries& log, const MeasuredQuantity& measured, int at,
               std::span<const double> shape, Eigen::MatrixXd& columns) const override {
    if (measured.kind != EvidenceKind::kFlow || measured.index != at) return false;
    const Eigen::VectorXd& command = log.cylinders[static_cast<std::size_t>(at)].command;
    const Eigen::VectorXd& share = log.cylinders[static_cast<std::size_t>(at)].reached_share;
    if (command.size() == 0) return false;
    const SectionFit fit = fit_dead_bands(log, at, measured.sections);
    const bool full_flow = shape[0] >= 0.5;
    columns.setZero(log.samples(), 2);
    for (Eigen::Index k = 0; k < log.samples(); ++k) {
      const double u = std::abs(command[k]);
      if (!(u > 0.0)) {
        if (std::isnan(u)) columns.row(k).setConstant(u);
        continue;
      }
      const double knee = std::clamp(fit.dead_band(command[k]), 1e-3, 0.5);
      // With full flow at full command the line through zero has the gain g (1 - u0) and meets the law again at u = 1.
      double lack = fit.gain(command[k]);
      if (full_flow) lack *= 1.0 - std::min(u, 1.0);
      if (u < knee) lack = fit.gain(command[k]) * (full_flow ? 1.0 - knee : 1.0) * u / knee;
      if (share.size() > 0) lack *= share[k];
      columns(k, command[k] > 0.0 ? 0 : 1) = command[k] > 0.0 ? -lack : lack;
    }
    return columns.array().isNaN().any() || columns.array().abs().maxCoeff() > 0.0;
  }
};

}  // namespace

std::unique_ptr<Effect> make_valve_deadband() { return std::make_unique<ValveDeadband>(); }

}  // namespace sparflow
