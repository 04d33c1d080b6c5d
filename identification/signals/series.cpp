#include "identification/signals/series.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "identification/signals/load_sensing_leader.h"
#include "models/effects/memory.h"
#include "models/effects/tip_motion.h"
#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kSteadyForce_s = 1.0;  ///< [s] width of the moving average against sensor noise

CylinderSeries cylinder_series(const Cylinder& cylinder, const CylinderSignals& c) {
  CylinderSeries out;
  out.length = c.length;
  out.rate = c.rate;
  out.speed = c.speed;
  out.stroke_measured = c.stroke_measured;
  out.acceleration = c.acceleration;
  out.static_force = c.static_force;
  out.force = c.force_smooth;
  out.command = c.command;
  out.pressure_a = c.pressure_a_smooth;
  out.pressure_b = c.pressure_b_smooth;
  out.measured_a = c.pressure_a;
  out.measured_b = c.pressure_b;
  out.direction = c.direction;
  out.flow = c.flow;
  out.return_flow = VectorXd::Zero(c.flow.size());
  if (!cylinder.hydraulic()) return out;
  const double a = cylinder.area_piston(), b = cylinder.area_rod();
  for (Index k = 0; k < c.flow.size(); ++k) {
    if (c.direction[k] != 0) out.return_flow[k] = c.flow[k] * (c.direction[k] > 0 ? b / a : a / b);
  }
  return out;
}

/// Sets max(standby, working pressures + margins) as far as the log measures them.
void demand(const CraneModel& model, const MachineSignals& signals, std::size_t index,
            PumpSeries& out) {
  const Pump& pump = model.machine.pumps[index];
  const Index n = signals.samples();
  out.standby = model.pumps[index].standby;
  out.leader = Eigen::VectorXi::Constant(n, -1);
  out.demand = VectorXd::Constant(n, out.standby);
  if (pump.type != PumpType::kLoadSensing) return;
  out.asked = Eigen::MatrixXd::Constant(n, static_cast<Index>(pump.feeds.size()), kNaN);
  for (const int feed : pump.feeds) {
    const auto i = static_cast<std::size_t>(feed);
    const CylinderSignals& c = signals.cylinders[i];
    if (!model.machine.cylinders[i].hydraulic()) continue;
    if (!c.has_command() || !c.has_pressure()) {
      out.demand.resize(0);
      out.leader.resize(0);
      return;
    }
    const double margin = model.cylinders[i].margin;
    const auto column = static_cast<Index>(out.feeds.size());
    out.feeds.push_back(feed);
    for (Index k = 0; k < n; ++k) {
      if (c.direction[k] == 0) continue;
      out.asked(k, column) = c.working_pressure[k] + margin;
      if (std::isnan(out.asked(k, column))) out.demand[k] = kNaN;  // the leader is unknown
    }
  }
  for (Index k = 0; k < n; ++k) {
    if (!signals.usable[k]) out.demand[k] = kNaN;
  }
}

/// Calls visit(sample, statics) wherever pose and payload are known and every four-bar closes.
template <class Visit>
void visit_statics(const Machine& machine, const MachineSeries& log, int order,
                   const Visit& visit) {
  StaticForce statics(machine);
  VectorXd q(machine.joint_count());
  for (Index k = 0; k < log.samples(); ++k) {
    q = log.q.row(k);
    if (!q.allFinite() || !std::isfinite(log.payload[k])) continue;
    try {
      statics.update(q.data(), log.payload[k], order);
    } catch (const std::domain_error&) {
      continue;  // a four-bar does not close
    }
    visit(k, statics);
  }
}

VectorXd static_forces(const Machine& machine, const MachineSeries& log, int cylinder) {
  VectorXd force = VectorXd::Constant(log.samples(), kNaN);
  visit_statics(machine, log, 0,
                [&](Index k, const StaticForce& statics) { force[k] = statics.force()[cylinder]; });
  return force;
}

/// Sets the derivatives of every cylinder's static force with respect to the joint positions.
void set_static_slopes(const Machine& machine, MachineSeries& log) {
  for (CylinderSeries& c : log.cylinders)
    c.static_slope = Eigen::MatrixXd::Constant(log.samples(), machine.joint_count(), kNaN);
  visit_statics(machine, log, 1, [&](Index k, const StaticForce& statics) {
    for (std::size_t i = 0; i < log.cylinders.size(); ++i)
      log.cylinders[i].static_slope.row(k) = statics.force_jacobian().row(static_cast<Index>(i));
  });
}

}  // namespace

MachineSeries make_series(const CraneModel& model, const MachineSignals& signals) {
  const Machine& machine = model.machine;
  SPARFLOW_CHECK(signals.cylinders.size() == machine.cylinders.size() &&
                     signals.pumps.size() == machine.pumps.size(),
                 "signals of another machine");
  MachineSeries out;
  out.machine = std::make_shared<const Machine>(machine);
  out.step = signals.step;
  out.time = signals.time;
  for (const SampleRange& run : signals.runs) out.runs.emplace_back(run.begin, run.end);
  out.q = signals.q;
  out.qd = signals.qd;
  out.qdd = signals.qdd;
  out.payload = signals.payload;
  out.oil = signals.oil;
  out.return_pressure = signals.return_pressure;
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    out.cylinders.push_back(cylinder_series(machine.cylinders[i], signals.cylinders[i]));
    CylinderSeries& c = out.cylinders.back();
    if (c.force.size() > 0) {
      c.steady_force = c.static_force +
                       moving_average(out, c.force - c.static_force, c.direction, kSteadyForce_s);
    }
  }
  set_static_slopes(machine, out);
  for (const AppliedEffect& e : model.effects) out.inertia += e.effect->inertial_share(e.values);
  if (machine.tip.joint >= 0) out.tip = tip_motion(out);
  out = with_openings(model.effects, std::move(out));
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    PumpSeries pump;
    pump.pressure = signals.pumps[p].pressure_smooth;
    demand(model, signals, p, pump);
    out.pumps.push_back(std::move(pump));
  }
  out.pumps = pumps_led_by({}, out);  // first without effects, as these may depend on the demand
  out = with_passed_flows(model.effects, std::move(out));
  if (!model.effects.empty()) out.pumps = pumps_led_by(model.effects, out);
  return with_reached(model.effects, std::move(out));
}

MachineSeries with_openings(const std::vector<AppliedEffect>& effects, MachineSeries series) {
  for (std::size_t i = 0; i < series.cylinders.size(); ++i) {
    CylinderSeries& c = series.cylinders[i];
    c.opening = c.command;
    for (const AppliedEffect& e : effects)
      e.effect->shape_opening(static_cast<int>(i), e.at, e.values, c.opening);
    c.late = c.opening;
    if (c.late.size() == 0) continue;
    for (const AppliedEffect& e : effects)
      e.effect->delay_opening(series, static_cast<int>(i), e.at, e.values, c.late);
  }
  return series;
}

MachineSeries with_passed_flows(const std::vector<AppliedEffect>& effects, MachineSeries series) {
  for (std::size_t i = 0; i < series.cylinders.size(); ++i) {
    CylinderSeries& c = series.cylinders[i];
    const int cylinder = static_cast<int>(i);
    c.passed.resize(0);
    c.passing = {};
    for (const AppliedEffect& e : effects) {
      VectorXd passed = e.effect->passed_flow(series, cylinder, e.at, e.values, {});
      if (passed.size() == 0) continue;
      c.passed = std::move(passed);
      c.passing = {e.effect, e.at, e.values};
    }
    if (c.passing.effect == nullptr) continue;
    VectorXd lost;
    for (const AppliedEffect& e : effects) {
      const VectorXd one = e.effect->lost_behind_valve(series, cylinder, e.at, e.values);
      if (one.size() == 0) continue;
      lost = lost.size() == 0 ? one : VectorXd(lost + one);
    }
    if (lost.size() > 0)
      c.passed =
          c.passing.effect->passed_flow(series, cylinder, c.passing.at, c.passing.values, lost);
  }
  return series;
}

MachineSeries with_reached(const std::vector<AppliedEffect>& effects, MachineSeries series) {
  series = with_passed_flows(effects, with_openings(effects, std::move(series)));
  for (std::size_t i = 0; i < series.cylinders.size(); ++i) {
    CylinderSeries& c = series.cylinders[i];
    c.reached.resize(0);
    c.reached_share.resize(0);
    const bool any = std::any_of(effects.begin(), effects.end(), [&](const AppliedEffect& e) {
      return e.effect->acts_on_opening() && e.at == static_cast<int>(i);
    });
    if (!any || c.command.size() == 0) continue;
    c.reached = c.late;
    c.reached_share = c.passed;
    if (c.passed.size() > 0) c.reached = c.reached.cwiseProduct(c.passed);
  }
  return series;
}

VectorXd effect_series(const AppliedEffect& effect, const MachineSeries& log, EvidenceKind kind,
                       int index) {
  const Effect& law = *effect.effect;
  const std::vector<EvidenceKind> kinds = law.shows_in();
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) return {};
  if (kind == EvidenceKind::kForce && law.changes_machine()) {
    Machine changed = *log.machine;
    law.change_machine(changed, effect.at, effect.values);
    return static_forces(changed, log, index) - static_forces(*log.machine, log, index);
  }
  std::vector<double> linear, shape;
  for (std::size_t p = 0; p < effect.values.size(); ++p) {
    (law.info().parameters[p].linear ? linear : shape).push_back(effect.values[p]);
  }
  Eigen::MatrixXd columns;
  if (!law.columns(log, {kind, index, linear}, effect.at, shape, columns)) return {};
  SPARFLOW_CHECK(
      columns.cols() == static_cast<Index>(linear.size()) && columns.rows() == log.samples(),
      "an effect's columns have the wrong shape");
  return columns * Eigen::Map<const VectorXd>(linear.data(), columns.cols());
}

}  // namespace sparflow
