#include "models/chain/crane_model.h"

#include <algorithm>
#include <cmath>

#include "models/chain/pump_law.h"
#include "models/effects/effective_machine.h"
#include "models/effects/instant.h"
#include "models/hydraulics/return_rise.h"

namespace sparflow {

CraneModel CraneModel::untrained(Machine machine) {
  CraneModel model;
  model.cylinders.resize(machine.cylinders.size());
  for (const Pump& pump : machine.pumps) {
    // Of a constant-pressure supply only its maximum is known before a log shows its pressure.
    const bool constant = pump.type == PumpType::kConstantPressure;
    model.pumps.push_back({constant ? pump.max_pressure : pump.standby});
  }
  model.machine = std::move(machine);
  return model;
}

std::vector<std::string> CraneModel::missing() const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < cylinders.size(); ++i) {
    if (!machine.cylinders[i].hydraulic() || machine.pump_of_cylinder(static_cast<int>(i)) < 0)
      continue;
    if (cylinders[i].extend.empty()) names.push_back(machine.cylinders[i].name + " extend");
    if (cylinders[i].retract.empty()) names.push_back(machine.cylinders[i].name + " retract");
  }
  return names;
}

bool CraneModel::complete() const { return missing().empty(); }

double MachineState::throttling(const Machine& machine, int cylinder) const {
  const int pump = machine.pump_of_cylinder(cylinder);
  if (pump < 0) return 0.0;
  const CylinderState& c = cylinders[static_cast<std::size_t>(cylinder)];
  return (pumps[static_cast<std::size_t>(pump)].pressure - c.pressure) * c.flow;
}

Chain::Chain(const CraneModel& model)
    : model_(&model),
      machine_(effective_machine(model.machine, model.effects)),
      statics_(*machine_) {
  state_.cylinders.resize(model.cylinders.size());
  state_.pumps.resize(model.pumps.size());
  for (const AppliedEffect& e : model.effects) {
    if (acts_in_motion(*e.effect)) laws_.push_back(e);
  }
  if (laws_.empty()) return;
  instant_ = make_instant(*machine_);
  added_.resize(model.cylinders.size());
  added_pump_.resize(model.pumps.size());
}

const MachineState& Chain::evaluate(const JointState& joints, double payload, bool with_std,
                                    double rest_speed) {
  statics_.update(joints.q, payload, 0);
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    CylinderState& c = state_.cylinders[i];
    const Taylor3& x = statics_.length(static_cast<int>(i));
    c.length = x.value;
    c.rate = x.d1;
    c.speed = x.d1 * joints.qd[machine_->cylinders[i].joint];
    c.force = c.total_force = statics_.force()[static_cast<Eigen::Index>(i)];
    set_flow(i, rest_speed);
  }
  if (!laws_.empty()) add_force_effects(joints, payload);
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) set_pressure(i, with_std);
  if (laws_.empty()) {
    pump_stage(nullptr);
    return state_;
  }
  add_pressure_effects();
  std::fill(added_.begin(), added_.end(), 0.0);
  for (const AppliedEffect& e : laws_) e.effect->add_demand(instant_, e.at, e.values, added_);
  pump_stage(added_.data());
  add_pump_effects();
  return state_;
}

const MachineState& Chain::evaluate_pressures(const double* speed, const double* force,
                                              bool with_std, double rest_speed,
                                              const AddedPressures& added) {
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    CylinderState& c = state_.cylinders[i];
    c.speed = speed[i];
    c.force = c.total_force = force[i];
    set_flow(i, rest_speed);
    set_pressure(i, with_std);
    if (added.back != nullptr) raise_by_return(i, added.back[i]);
    if (added.pressure != nullptr && c.moving && machine_->cylinders[i].hydraulic()) {
      c.pressure += added.pressure[i];
    }
  }
  pump_stage(added.demand);
  return state_;
}

void Chain::set_flow(std::size_t cylinder, double rest_speed) {
  CylinderState& c = state_.cylinders[cylinder];
  const Cylinder& geometry = machine_->cylinders[cylinder];
  c.moving = std::abs(c.speed) > rest_speed;
  c.flow = 0.0;
  if (!c.moving || !geometry.hydraulic()) return;
  c.flow = std::abs(c.speed) * (c.speed > 0.0 ? geometry.area_piston() : geometry.area_rod());
}

void Chain::set_pressure(std::size_t cylinder, bool with_std) {
  CylinderState& c = state_.cylinders[cylinder];
  c.pressure = c.pressure_std = 0.0;
  if (!c.moving || !machine_->cylinders[cylinder].hydraulic()) return;
  const CylinderModel& learned = model_->cylinders[cylinder];
  const GaussianProcess& process = c.speed > 0.0 ? learned.extend : learned.retract;
  if (process.empty()) return;
  c.pressure = process.mean(c.flow, c.total_force);
  if (with_std) c.pressure_std = std::sqrt(std::max(0.0, process.variance(c.flow, c.total_force)));
}

void Chain::raise_by_return(std::size_t cylinder, double rise) {
  CylinderState& c = state_.cylinders[cylinder];
  const Cylinder& geometry = machine_->cylinders[cylinder];
  if (rise == 0.0 || !c.moving || !geometry.hydraulic()) return;
  const int side = c.speed > 0.0 ? 1 : -1;
  const CylinderModel& learned = model_->cylinders[cylinder];
  const GaussianProcess& process = side > 0 ? learned.extend : learned.retract;
  if (process.empty()) return;
  c.pressure +=
      supply_rise<double>({process, geometry, side}, c.pressure, c.flow, c.total_force, rise);
}

void Chain::add_force_effects(const JointState& joints, double payload) {
  Instant<double>& s = instant_;
  s.payload = payload;
  s.oil = oil;
  for (std::size_t j = 0; j < s.q.size(); ++j) {
    s.q[j] = joints.q[j];
    s.qd[j] = joints.qd[j];
    s.qdd[j] = joints.qdd == nullptr ? 0.0 : joints.qdd[j];
    s.static_torque[j] = statics_.torque()[static_cast<Eigen::Index>(j)];
  }
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    const CylinderState& c = state_.cylinders[i];
    const Cylinder& geometry = machine_->cylinders[i];
    s.length[i] = c.length;
    s.rate[i] = c.rate;
    s.speed[i] = c.speed;
    s.static_force[i] = s.force[i] = c.force;
    s.side[i] = !c.moving ? 0 : c.speed > 0.0 ? 1 : -1;
    s.flow[i] = c.flow;
    s.return_flow[i] =
        !geometry.hydraulic() || !c.moving
            ? 0.0
            : std::abs(c.speed) * (c.speed > 0.0 ? geometry.area_rod() : geometry.area_piston());
    s.pressure[i] = 0.0;
  }
  for (std::size_t p = 0; p < s.pump_flow.size(); ++p) {
    s.pump_flow[p] = 0.0;
    for (const int i : machine_->pumps[p].feeds)
      s.pump_flow[p] += state_.cylinders[static_cast<std::size_t>(i)].flow;
    s.pump_pressure[p] = model_->pumps[p].standby;
    s.leader[p] = -1;
  }
  std::fill(added_.begin(), added_.end(), 0.0);
  for (const AppliedEffect& e : laws_) e.effect->add_force(s, e.at, e.values, added_);
  for (std::size_t i = 0; i < added_.size(); ++i) {
    s.force[i] = state_.cylinders[i].total_force = state_.cylinders[i].force + added_[i];
  }
}

void Chain::add_pressure_effects() {
  std::fill(added_.begin(), added_.end(), 0.0);
  for (const AppliedEffect& e : laws_) e.effect->add_return(instant_, e.at, e.values, added_);
  for (std::size_t i = 0; i < added_.size(); ++i) raise_by_return(i, added_[i]);
  for (std::size_t i = 0; i < added_.size(); ++i)
    instant_.pressure[i] = state_.cylinders[i].pressure;
  std::fill(added_.begin(), added_.end(), 0.0);
  for (const AppliedEffect& e : laws_) e.effect->add_pressure(instant_, e.at, e.values, added_);
  for (std::size_t i = 0; i < added_.size(); ++i) {
    CylinderState& c = state_.cylinders[i];
    if (c.moving && machine_->cylinders[i].hydraulic()) c.pressure += added_[i];
    instant_.pressure[i] = c.pressure;
  }
}

void Chain::pump_stage(const double* added_demand) {
  state_.power = 0.0;
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) {
    const Pump& pump = machine_->pumps[p];
    PumpState& s = state_.pumps[p];
    s.flow = 0.0;
    PumpLaw law(model_->pumps[p].standby);
    for (const int feed : pump.feeds) {
      const auto i = static_cast<std::size_t>(feed);
      const CylinderState& c = state_.cylinders[i];
      s.flow += c.flow;
      if (pump.type != PumpType::kLoadSensing || !c.moving) continue;
      double demand = c.pressure + model_->cylinders[i].margin;
      if (added_demand != nullptr) demand += added_demand[i];
      law.add(feed, demand);
    }
    s.pressure = law.pressure();
    s.leader = law.leader();
    state_.power += s.pressure * s.flow;
  }
}

void Chain::add_pump_effects() {
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) {
    instant_.pump_pressure[p] = state_.pumps[p].pressure;
    instant_.leader[p] = state_.pumps[p].leader;
  }
  std::fill(added_pump_.begin(), added_pump_.end(), 0.0);
  for (const AppliedEffect& e : laws_) e.effect->add_pump(instant_, e.at, e.values, added_pump_);
  state_.power = 0.0;
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) {
    state_.pumps[p].pressure += added_pump_[p];
    state_.power += state_.pumps[p].pressure * state_.pumps[p].flow;
  }
}

CraneModel::CraneModel() = default;
CraneModel::CraneModel(const CraneModel&) = default;
CraneModel::CraneModel(CraneModel&&) noexcept = default;
CraneModel& CraneModel::operator=(const CraneModel&) = default;
CraneModel& CraneModel::operator=(CraneModel&&) noexcept = default;
CraneModel::~CraneModel() = default;

}  // namespace sparflow
