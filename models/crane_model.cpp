#include "models/crane_model.h"

#include <algorithm>
#include <cmath>

namespace sparflow {

CraneModel CraneModel::untrained(Machine machine) {
  CraneModel model;
  model.cylinders.resize(machine.cylinders.size());
  for (const Pump& pump : machine.pumps) {
    // of a constant supply nothing but its ceiling is known before a log shows its pressure
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

Chain::Chain(const CraneModel& model) : model_(&model), statics_(model.machine) {
  state_.cylinders.resize(model.cylinders.size());
  state_.pumps.resize(model.pumps.size());
}

const MachineState& Chain::evaluate(const double* q, const double* qd, double payload,
                                    bool with_std, double rest_speed) {
  statics_.update(q, payload, 0);
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    CylinderState& c = state_.cylinders[i];
    const Taylor3& x = statics_.length(static_cast<int>(i));
    c.length = x.value;
    c.rate = x.d1;
    c.speed = x.d1 * qd[model_->machine.cylinders[i].joint];
    c.force = statics_.force()[static_cast<Eigen::Index>(i)];
  }
  return evaluate_pressures(nullptr, nullptr, with_std, rest_speed);
}

const MachineState& Chain::evaluate_pressures(const double* speed, const double* force,
                                              bool with_std, double rest_speed) {
  const Machine& machine = model_->machine;
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    CylinderState& c = state_.cylinders[i];
    if (speed != nullptr) c.speed = speed[i];
    if (force != nullptr) c.force = force[i];
    const Cylinder& cylinder = machine.cylinders[i];
    c.flow = c.pressure = c.pressure_std = 0.0;
    c.moving = std::abs(c.speed) > rest_speed;
    if (!c.moving || !cylinder.hydraulic()) continue;
    const bool extending = c.speed > 0.0;
    c.flow = std::abs(c.speed) * (extending ? cylinder.area_piston() : cylinder.area_rod());
    const GaussianProcess& process =
        extending ? model_->cylinders[i].extend : model_->cylinders[i].retract;
    if (process.empty()) continue;
    c.pressure = process.mean(c.flow, c.force);
    if (with_std) c.pressure_std = std::sqrt(std::max(0.0, process.variance(c.flow, c.force)));
  }
  state_.power = 0.0;
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) {
    const Pump& pump = machine.pumps[p];
    PumpState& s = state_.pumps[p];
    s.flow = 0.0;
    s.pressure = model_->pumps[p].standby;
    s.leader = -1;
    for (const int i : pump.feeds) {
      const CylinderState& c = state_.cylinders[static_cast<std::size_t>(i)];
      s.flow += c.flow;
      if (pump.type != PumpType::kLoadSensing || !c.moving) continue;
      const double demand = c.pressure + model_->cylinders[static_cast<std::size_t>(i)].margin;
      if (demand > s.pressure) {
        s.pressure = demand;
        s.leader = i;
      }
    }
    state_.power += s.pressure * s.flow;
  }
  return state_;
}

}  // namespace sparflow
