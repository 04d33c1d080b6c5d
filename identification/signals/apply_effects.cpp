#include "identification/signals/apply_effects.h"

#include <algorithm>
#include <cmath>

#include "identification/signals/low_pass.h"
#include "identification/signals/series.h"
#include "identification/signals/smoothing.h"
#include "models/effects/effective_machine.h"
#include "models/effects/instant.h"
#include "models/hydraulics/return_rise.h"
#include "models/math/error.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

void add(const VectorXd& what, VectorXd& to) {
  if (what.size() == 0) return;
  if (to.size() == 0) {
    to = what;
  } else {
    to += what;
  }
}

/// Recomputes poses, speeds and forces with the machine as the effects change it. A measured stroke keeps its speed: another
/// angle for the same stroke changes levers and forces, not what flows into the cylinder.
void evaluate_effective(const Machine& machine, MachineSignals& signals) {
  StaticForce statics(machine);
  VectorXd q(machine.joint_count());
  for (Index k = 0; k < signals.samples(); ++k) {
    for (CylinderSignals& c : signals.cylinders) c.model_force[k] = kNaN;
    if (!signals.usable[k]) continue;
    q = signals.q.row(k);
    try {
      statics.update(q.data(), signals.payload[k], 0);
    } catch (const std::domain_error&) {
      continue;  // a four-bar does not close at this angle, so the forces stay unknown
    }
    for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
      CylinderSignals& c = signals.cylinders[i];
      const Taylor3& x = statics.length(static_cast<int>(i));
      const Cylinder& cylinder = machine.cylinders[i];
      const double rate = signals.qd(k, cylinder.joint);
      c.length[k] = x.value;
      c.rate[k] = x.d1;
      if (!c.stroke_measured) {
        c.speed[k] = x.d1 * rate;
        c.acceleration[k] = x.d1 * signals.qdd(k, cylinder.joint) + x.d2 * rate * rate;
      }
      c.model_force[k] = statics.force()[static_cast<Index>(i)];
      if (c.direction[k] != 0) {
        c.flow[k] = std::max(0.0, c.speed[k] * c.direction[k]) *
                    (c.direction[k] > 0 ? cylinder.area_piston() : cylinder.area_rod());
      }
    }
  }
}

/// Evaluates a law without memory over a log. @param width results per sample  @return [samples x width]
template <class Law>
Eigen::MatrixXd over_log(const MachineSeries& log, std::size_t width, const Law& law) {
  Eigen::MatrixXd result(log.samples(), static_cast<Index>(width));
  Instant<double> instant = make_instant(*log.machine);
  std::vector<double> out(width);
  for (Index k = 0; k < log.samples(); ++k) {
    fill_instant(log, k, instant);
    std::fill(out.begin(), out.end(), 0.0);
    law(instant, std::span<double>(out));
    result.row(k) = Eigen::Map<const Eigen::RowVectorXd>(out.data(), result.cols());
  }
  return result;
}

void force_stage(const CraneModel& model, MachineSeries& log, MachineSignals& signals) {
  for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
    CylinderSignals& c = signals.cylinders[i];
    log.cylinders[i].static_force = c.model_force;
    VectorXd sensors;
    for (const AppliedEffect& e : model.effects) {
      if (e.effect->changes_machine()) continue;  // the changed machine contains its forces
      const bool sensor = e.effect->info().stage == EffectStage::kSensor;
      add(effect_series(e, log, EvidenceKind::kForce, static_cast<int>(i)),
          sensor ? sensors : c.model_force);
    }
    c.predicted_force = c.model_force;
    add(sensors, c.predicted_force);
  }
  for (std::size_t i = 0; i < signals.cylinders.size(); ++i) {
    log.cylinders[i].force = signals.cylinders[i].model_force;  // input of the following laws
  }
}

/// Contribution of a sensor effect to the measured working pressure, from the evidence of both directions. [Pa]
VectorXd sensor_effect(const AppliedEffect& e, const MachineSeries& log, int index) {
  VectorXd sum;
  const Eigen::VectorXi& direction = log.cylinders[static_cast<std::size_t>(index)].direction;
  for (const bool extend : {true, false}) {
    VectorXd one = effect_series(
        e, log, extend ? EvidenceKind::kSupplyExtend : EvidenceKind::kSupplyRetract, index);
    for (Index k = 0; k < one.size(); ++k) {
      if (direction[k] != (extend ? 1 : -1)) one[k] = 0.0;
    }
    add(one, sum);
  }
  return sum;
}

/// Contribution to a cylinder's speed after the low-pass of a filtered speed; unfiltered where the filter reaches beyond
/// a run. [m/s]
VectorXd flow_effect(const AppliedEffect& e, const MachineSeries& log,
                     const MachineSignals& signals, int index) {
  VectorXd speed = effect_series(e, log, EvidenceKind::kFlow, index);
  if (speed.size() == 0 || !e.effect->columns_of_readings() || !(signals.window > 0.0))
    return speed;
  const VectorXd kernel = low_pass_of(log.step, signals.window, signals.order, 1);
  const VectorXd smooth = convolved(speed, kernel, log.runs);
  return smooth.array().isFinite().select(smooth, speed);
}

void pressure_stage(const AppliedEffect& e, const MachineSeries& log, MachineSignals& signals) {
  const std::size_t m = signals.cylinders.size();
  const bool acts = acts_in_motion(*e.effect);
  Eigen::MatrixXd pressure, demand, back;
  if (acts) {
    back = over_log(log, m, [&](const Instant<double>& s, std::span<double> out) {
      e.effect->add_return(s, e.at, e.values, out);
    });
    pressure = over_log(log, m, [&](const Instant<double>& s, std::span<double> out) {
      e.effect->add_pressure(s, e.at, e.values, out);
    });
    demand = over_log(log, m, [&](const Instant<double>& s, std::span<double> out) {
      e.effect->add_demand(s, e.at, e.values, out);
    });
  }
  for (std::size_t i = 0; i < m; ++i) {
    CylinderSignals& c = signals.cylinders[i];
    const int index = static_cast<int>(i);
    if (acts) {
      add(pressure.col(index), c.pressure_effect);
      add(demand.col(index), c.demand_effect);
      if ((back.col(index).array() != 0.0).any()) add(back.col(index), c.return_effect);
    }
    if (e.effect->info().stage == EffectStage::kSensor) {
      add(sensor_effect(e, log, index), c.pressure_sensor_effect);
    }
    if (e.effect->acts_on_opening() && c.reached.size() > 0) continue;  // a factor of the opening
    add(flow_effect(e, log, signals, index), c.flow_effect);
  }
}

/// Sets demand and leader by the model's prediction or, where pressure models are missing, adds the demand effects to the
/// demand of the measured pressures.
void predict_demand(const CraneModel& model, const MachineSignals& signals, MachineSeries& log) {
  const Machine& machine = model.machine;
  Chain chain(model);
  ChainInputs inputs(machine.cylinders.size());
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    if (machine.pumps[p].type != PumpType::kLoadSensing) continue;
    PumpSeries& pump = log.pumps[p];
    bool learned = true;
    for (const int i : machine.pumps[p].feeds) {
      const auto c = static_cast<std::size_t>(i);
      learned =
          learned && (!machine.cylinders[c].hydraulic() ||
                      (!model.cylinders[c].extend.empty() && !model.cylinders[c].retract.empty()));
    }
    if (!learned) {
      for (Index k = 0; k < pump.demand.size(); ++k) {
        const int leader = pump.leader[k];
        if (leader < 0) continue;
        pump.demand[k] +=
            or_zero(signals.cylinders[static_cast<std::size_t>(leader)].demand_effect, k);
      }
      continue;
    }
    pump.demand = VectorXd::Constant(signals.samples(), kNaN);
    pump.leader = Eigen::VectorXi::Constant(signals.samples(), -1);
    for (Index k = 0; k < signals.samples(); ++k) {
      if (!signals.usable[k]) continue;
      inputs.set(signals, k);
      const PumpState& state = inputs.evaluate(chain).pumps[p];
      pump.demand[k] = state.pressure;
      pump.leader[k] = state.leader;
    }
  }
}

void pump_stage(const CraneModel& model, const MachineSeries& log, MachineSignals& signals) {
  for (const AppliedEffect& e : model.effects) {
    if (e.effect->info().stage == EffectStage::kSensor) continue;
    Eigen::MatrixXd law;
    if (acts_in_motion(*e.effect)) {
      law =
          over_log(log, signals.pumps.size(), [&](const Instant<double>& s, std::span<double> out) {
            e.effect->add_pump(s, e.at, e.values, out);
          });
    }
    for (std::size_t p = 0; p < signals.pumps.size(); ++p) {
      // An effect that acts in planned motions is evaluated by its law, because its demand is contained in the maximum.
      add(law.size() > 0 ? VectorXd(law.col(static_cast<Index>(p)))
                         : effect_series(e, log, EvidenceKind::kPump, static_cast<int>(p)),
          signals.pumps[p].pressure_effect);
    }
  }
}

}  // namespace

void ChainInputs::set(const MachineSignals& signals, Index k) {
  // A commanded cylinder that stands still (start, dead band) demands pressure without flow. [m/s]
  constexpr double kStanding = 1e-8;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    const CylinderSignals& c = signals.cylinders[i];
    const int direction = c.direction[k];
    speed[i] = direction == 0 ? 0.0 : direction * std::max(kStanding, c.speed[k] * direction);
    force[i] = c.model_force[k];
    pressure[i] = or_zero(c.pressure_effect, k);
    demand[i] = or_zero(c.demand_effect, k);
    back[i] = or_zero(c.return_effect, k);
  }
}

const MachineState& ChainInputs::evaluate(Chain& chain, bool with_std) const {
  return chain.evaluate_pressures(speed.data(), force.data(), with_std, 1e-9,
                                  {pressure.data(), demand.data(), back.data()});
}

double working_pressure_effect(const CraneModel& model, const MachineSignals& signals, int cylinder,
                               Index k) {
  const auto i = static_cast<std::size_t>(cylinder);
  const CylinderSignals& c = signals.cylinders[i];
  const double own = or_zero(c.pressure_effect, k), back = or_zero(c.return_effect, k);
  if (back == 0.0 || c.direction[k] == 0) return own;
  const CylinderModel& learned = model.cylinders[i];
  const GaussianProcess& process = c.direction[k] > 0 ? learned.extend : learned.retract;
  if (process.empty()) return own;
  const double mean = process.mean(c.flow[k], c.model_force[k]);
  return own + supply_rise<double>({process, model.machine.cylinders[i], c.direction[k]}, mean,
                                   c.flow[k], c.model_force[k], back);
}

MachineSignals with_effects(const CraneModel& model, MachineSignals signals) {
  SPARFLOW_CHECK(!signals.slim || model.effects.empty(), "slim signals have no effects");
  if (signals.slim) return signals;
  for (CylinderSignals& c : signals.cylinders) {
    c.model_force = c.predicted_force = c.static_force;
    for (VectorXd* v : {&c.pressure_effect, &c.return_effect, &c.pressure_sensor_effect,
                        &c.demand_effect, &c.flow_effect, &c.reached})
      v->resize(0);
  }
  for (PumpSignals& p : signals.pumps) p.pressure_effect.resize(0);
  const std::shared_ptr<const Machine> machine = effective_machine(model.machine, model.effects);
  const bool changed = machine.get() != &model.machine;
  if (changed || signals.of_effective_machine) evaluate_effective(*machine, signals);
  signals.of_effective_machine = changed;
  if (model.effects.empty()) return signals;
  MachineSeries log = make_series(model, signals);
  log.machine = machine;
  for (std::size_t i = 0; i < log.cylinders.size(); ++i)
    signals.cylinders[i].reached = log.cylinders[i].reached;
  force_stage(model, log, signals);
  for (const AppliedEffect& e : model.effects) pressure_stage(e, log, signals);
  predict_demand(model, signals, log);
  pump_stage(model, log, signals);
  return signals;
}

}  // namespace sparflow
