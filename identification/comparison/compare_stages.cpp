#include "identification/comparison/compare_stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "identification/signals/apply_effects.h"
#include "models/math/nan.h"
#include "models/math/units.h"

namespace sparflow {

/// Results of the pressure and pump stages of one log, filled in one pass of the chain.
struct ChainPass {
  std::vector<ComparedSeries> pressure, pump;        ///< by cylinder, by pump
  std::vector<bool> pressure_missing, pump_missing;  ///< a required pressure model is not learned
};

namespace {

using Eigen::Index;
using Eigen::VectorXd;
const FieldUnit kNewton{"N", 1.0};
const FieldUnit kBarUnit{"bar", units::kBar};
const FieldUnit kFlowUnit{"l/min", units::kLitrePerMinute};

ComparedSeries series_for(std::string stage, std::string at, const FieldUnit& unit, Index n) {
  ComparedSeries s;
  s.stage = std::move(stage);
  s.at = std::move(at);
  s.unit = unit;
  s.measured = s.predicted = VectorXd::Constant(n, kNaN);
  s.regime = Eigen::VectorXi::Zero(n);
  s.regimes = {"extend", "retract"};
  return s;
}

void put(ComparedSeries& s, Index k, double measured, double predicted, int regime) {
  if (!std::isfinite(measured) || !std::isfinite(predicted)) return;
  s.measured[k] = measured;
  s.predicted[k] = predicted;
  s.regime[k] = regime;
}

}  // namespace

std::vector<ComparedSeries> Comparison::series(std::set<std::string>& notes) const {
  std::vector<ComparedSeries> out;
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) force(i, out, notes);
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) flow(i, out, notes);
  pressures(out, notes);
  return out;
}

void Comparison::force(std::size_t i, std::vector<ComparedSeries>& out,
                       std::set<std::string>& notes) const {
  const CylinderSignals& c = signals_.cylinders[i];
  const std::string& name = machine_.cylinders[i].name;
  if (!c.has_force()) {
    notes.insert(
        fmt::format("force of {}: not compared, needs pA_{}_bar and pB_{}_bar (or force_{}_N)",
                    name, name, name, name));
    return;
  }
  ComparedSeries s = series_for("force", name, kNewton, signals_.samples());
  for (Index k = 0; k < signals_.samples(); ++k) {
    if (counts(k) && c.moving[k]) put(s, k, c.force[k], c.predicted()[k], c.speed[k] > 0.0 ? 0 : 1);
  }
  out.push_back(std::move(s));
}

void Comparison::flow(std::size_t i, std::vector<ComparedSeries>& out,
                      std::set<std::string>& notes) const {
  const CylinderSignals& c = signals_.cylinders[i];
  const Cylinder& cylinder = machine_.cylinders[i];
  const CylinderModel& m = model_.cylinders[i];
  if (!cylinder.hydraulic()) {
    notes.insert(
        fmt::format("flow and pressures of {}: not compared, the machine file gives it no bore",
                    cylinder.name));
    return;
  }
  if (!c.has_command()) {
    notes.insert(fmt::format("flow of {} from its command: not compared, needs u_{}", cylinder.name,
                             cylinder.name));
  } else if (m.valve_gain_extend <= 0.0 && m.valve_gain_retract <= 0.0) {
    notes.insert(
        fmt::format("flow of {} from its command: not compared, the model has no valve gain for it",
                    cylinder.name));
  } else {
    ComparedSeries s = series_for("flow", cylinder.name, kFlowUnit, signals_.samples());
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (!counts(k) || !c.moving[k]) continue;
      const bool extend = c.direction[k] > 0;
      const double gain = extend ? m.valve_gain_extend : m.valve_gain_retract;
      const double area = extend ? cylinder.area_piston() : -cylinder.area_rod();
      const double predicted = gain * std::abs(c.opening()[k]) + area * or_zero(c.flow_effect, k);
      if (gain > 0.0) put(s, k, c.flow[k], predicted, extend ? 0 : 1);
    }
    out.push_back(std::move(s));
  }
  if (c.measured_flow.size() > 0) {
    ComparedSeries s = series_for("flow_sensor", cylinder.name, kFlowUnit, signals_.samples());
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (counts(k) && c.moving[k]) {
        put(s, k, std::abs(c.measured_flow[k]), c.flow[k], c.direction[k] > 0 ? 0 : 1);
      }
    }
    out.push_back(std::move(s));
  }
}

bool Comparison::speeds_from_commands(Index k, const Pump& pump, std::vector<double>& speed) const {
  std::fill(speed.begin(), speed.end(), 0.0);
  for (const int fed : pump.feeds) {
    const auto i = static_cast<std::size_t>(fed);
    const CylinderSignals& c = signals_.cylinders[i];
    if (!c.has_command() || !std::isfinite(c.command[k])) return false;
    if (c.direction[k] == 0) continue;
    const bool extend = c.direction[k] > 0;
    const CylinderModel& m = model_.cylinders[i];
    const double gain = extend ? m.valve_gain_extend : m.valve_gain_retract;
    const Cylinder& cylinder = machine_.cylinders[i];
    if (gain <= 0.0 || !cylinder.hydraulic()) return false;
    speed[i] = gain * c.opening()[k] / (extend ? cylinder.area_piston() : cylinder.area_rod());
    speed[i] += or_zero(c.flow_effect, k);
    if ((speed[i] > 0.0) != extend) speed[i] = 0.0;  // the command is inside the dead band
  }
  return true;
}

void Comparison::pump_sample(Index k, std::size_t p, const PumpState& state,
                             ChainPass& pass) const {
  const Pump& pump = machine_.pumps[p];
  bool moving = false;
  for (const int i : pump.feeds) {
    const CylinderSignals& c = signals_.cylinders[static_cast<std::size_t>(i)];
    moving = moving || c.moving[k];
    if (pump.type == PumpType::kLoadSensing && c.direction[k] != 0 &&
        !process_learned(static_cast<std::size_t>(i), c.direction[k])) {
      pass.pump_missing[p] = true;
      return;
    }
  }
  if (!moving) return;
  int regime = 0;  // standby
  for (std::size_t f = 0; f < pump.feeds.size(); ++f) {
    if (pump.feeds[f] == state.leader) regime = static_cast<int>(f) + 1;
  }
  const PumpSignals& s = signals_.pumps[p];
  put(pass.pump[p], k, s.pressure[k], state.pressure + or_zero(s.pressure_effect, k), regime);
}

void Comparison::judge_sample(Index k, const MachineState& state, ChainPass& pass) const {
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
    const CylinderSignals& c = signals_.cylinders[i];
    if (!c.has_pressure() || !c.moving[k]) continue;
    if (!process_learned(i, c.direction[k])) {
      pass.pressure_missing[i] = true;
      continue;
    }
    const CylinderState& s = state.cylinders[i];
    put(pass.pressure[i], k, c.working_pressure[k],
        s.pressure + or_zero(c.pressure_sensor_effect, k), c.direction[k] > 0 ? 0 : 1);
    const CylinderModel& m = model_.cylinders[i];
    const GpParameters& p = (c.direction[k] > 0 ? m.extend : m.retract).parameters();
    pass.pressure[i].deviation[k] = std::hypot(s.pressure_std, p.noise_std);
    pass.pressure[i].extrapolated[k] = !(s.flow >= p.flow_min && s.flow <= p.flow_max &&
                                         s.force >= p.force_min && s.force <= p.force_max);
  }
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    if (signals_.pumps[p].pressure.size() > 0) pump_sample(k, p, state.pumps[p], pass);
  }
}

void Comparison::pressures(std::vector<ComparedSeries>& out, std::set<std::string>& notes) const {
  const Index n = signals_.samples();
  ChainPass pass;
  for (const Cylinder& cylinder : machine_.cylinders) {
    pass.pressure.push_back(series_for("pressure", cylinder.name, kBarUnit, n));
    pass.pressure.back().deviation = VectorXd::Constant(n, kNaN);
    pass.pressure.back().extrapolated = Mask::Constant(n, false);
  }
  for (const Pump& pump : machine_.pumps) {
    pass.pump.push_back(series_for("pump", pump.name, kBarUnit, n));
    pass.pump.back().regimes = {pump.type == PumpType::kLoadSensing ? "standby" : "constant"};
    for (const int i : pump.feeds) {
      pass.pump.back().regimes.push_back(machine_.cylinders[static_cast<std::size_t>(i)].name);
    }
  }
  pass.pressure_missing.assign(machine_.cylinders.size(), false);
  pass.pump_missing.assign(machine_.pumps.size(), false);
  Chain chain(model_);
  ChainInputs inputs(machine_.cylinders.size());
  for (Index k = 0; k < n; ++k) {
    if (!counts(k)) continue;
    inputs.set(signals_, k);
    judge_sample(k, inputs.evaluate(chain, true), pass);
  }
  for (std::size_t i = 0; i < machine_.cylinders.size(); ++i) {
    const Cylinder& cylinder = machine_.cylinders[i];
    if (!cylinder.hydraulic()) continue;
    const CylinderSignals& c = signals_.cylinders[i];
    for (const bool bore : {true, false}) {
      if (bore ? c.logs_a : c.logs_b) continue;
      notes.insert(fmt::format("pressure of {} {}: not compared, needs p{}_{}_bar", cylinder.name,
                               bore ? "extending" : "retracting", bore ? "A" : "B", cylinder.name));
    }
    if (pass.pressure_missing[i]) {
      notes.insert(
          fmt::format("pressure of {}: compared only in the direction whose pressure model is "
                      "learned",
                      cylinder.name));
    }
    if (c.has_pressure()) out.push_back(std::move(pass.pressure[i]));
  }
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    if (signals_.pumps[p].pressure.size() == 0) {
      notes.insert(fmt::format("pressure and energy of pump {}: not compared, needs p_{}_bar",
                               machine_.pumps[p].name, machine_.pumps[p].name));
      continue;
    }
    if (pass.pump_missing[p]) {
      notes.insert(fmt::format(
          "pump {}: compared only where the pressure models of all active cylinders are learned",
          machine_.pumps[p].name));
    }
    out.push_back(std::move(pass.pump[p]));
  }
  if (machine_.pumps.empty())
    notes.insert("pump and energy: not compared, the machine has no pump");
}

void Comparison::energy(std::vector<EnergyScore>& scores) const {
  const VectorXd duration = sample_durations(signals_.time, signals_.runs);
  Chain chain(model_);
  ChainInputs inputs(machine_.cylinders.size());
  for (std::size_t p = 0; p < machine_.pumps.size(); ++p) {
    const Pump& pump = machine_.pumps[p];
    const VectorXd& pressure = signals_.pumps[p].pressure;
    if (pressure.size() == 0) continue;
    double from_commands = 0.0;
    bool commanded = true;
    for (Index k = 0; k < signals_.samples(); ++k) {
      if (!counts(k) || !std::isfinite(pressure[k])) continue;
      bool learned = true;
      for (const int i : pump.feeds) {
        const int direction = signals_.cylinders[static_cast<std::size_t>(i)].direction[k];
        learned = learned && (pump.type == PumpType::kConstantPressure || direction == 0 ||
                              process_learned(static_cast<std::size_t>(i), direction));
      }
      if (!learned) continue;
      inputs.set(signals_, k);
      const PumpState state = inputs.evaluate(chain).pumps[p];
      const double effect = or_zero(signals_.pumps[p].pressure_effect, k);
      if (!std::isfinite(state.pressure + effect)) continue;
      scores[p].measured += pressure[k] * state.flow * duration[k];
      scores[p].predicted += (state.pressure + effect) * state.flow * duration[k];
      scores[p].duration += duration[k];
      commanded = commanded && speeds_from_commands(k, pump, inputs.speed);
      if (!commanded) continue;
      const PumpState asked = inputs.evaluate(chain).pumps[p];
      from_commands += (asked.pressure + effect) * asked.flow * duration[k];
    }
    if (!commanded || !scores[p].from_commands) {
      scores[p].from_commands.reset();
    } else {
      *scores[p].from_commands += from_commands;
    }
  }
}

}  // namespace sparflow
