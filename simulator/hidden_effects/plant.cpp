#include "simulator/hidden_effects/plant.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/hidden_effects/largest_demand.h"

namespace sparflow::simulator {
namespace {

Machine with_hidden_bodies(const Machine& machine,
                           const std::vector<std::unique_ptr<HiddenLaw>>& hidden) {
  Machine result = machine;
  for (const auto& law : hidden) law->change_machine(result);
  return result;
}

}  // namespace

Plant::Plant(const Machine& machine, const CraneLaws& laws,
             std::vector<std::unique_ptr<HiddenLaw>>& hidden, std::vector<double> start,
             double step)
    : machine_(machine),
      laws_(laws),
      hidden_(hidden),
      bodies_(with_hidden_bodies(machine, hidden)) {
  each([this](const HiddenLaw& law) { inertia_ = inertia_ || law.needs_inertia(); });
  state_.h = step;
  state_.q = std::move(start);
  const std::size_t joints = state_.q.size();
  for (auto* v :
       {&state_.qd, &state_.qdd, &state_.gravity, &state_.inertia, &speed_before_, &speed_before2_})
    v->assign(joints, 0.0);
  state_.q_load = state_.q;
  state_.cylinders.resize(machine.cylinders.size());
  state_.pumps.resize(machine.pumps.size());
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) state_.pumps[p].pressure = laws.standby[p];
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    const Taylor3 x =
        linkage_rates(machine_, static_cast<int>(i),
                      state_.q[static_cast<std::size_t>(machine_.cylinders[i].joint)]);
    state_.cylinders[i].length = x.value;
    state_.cylinders[i].rate = x.d1;
  }
}

void Plant::step(double payload, double oil, const std::vector<double>& command) {
  PlantState& s = state_;
  s.payload = payload;
  s.oil = oil;
  each([&s](HiddenLaw& law) { law.payload(s); });
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    c.command = c.opening = command[i];
    c.drift = 0.0;
  }
  move();
  load();
  pressurise();
  supply();
  s.t += s.h;
}

void Plant::follow(const PlantState& other) {
  state_.q = other.q;
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    state_.cylinders[i].length = other.cylinders[i].length;
    state_.cylinders[i].rate = other.cylinders[i].rate;
  }
}

void Plant::move() {
  PlantState& s = state_;
  each([&s](HiddenLaw& law) { law.opening(s); });
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    c.side = c.asked = sign_of(c.opening);
    const std::size_t d = c.opening > 0.0 ? 0 : 1;
    c.flow = std::abs(c.opening) * laws_.cylinders[i].direction[d].valve_gain;
  }
  each([&s](HiddenLaw& law) { law.flow(s); });
  each([&s](HiddenLaw& law) { law.drift(s); });
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    const Cylinder& drive = machine_.cylinders[i];
    const auto j = static_cast<std::size_t>(drive.joint);
    const double area = c.side > 0 ? drive.area_piston() : drive.area_rod();
    const double other = c.side > 0 ? drive.area_rod() : drive.area_piston();
    // With its lever fully open, a drive without chambers moves at the joint's largest speed.
    double speed =
        drive.hydraulic() ? c.side * c.flow / area : c.opening * machine_.joints[j].velocity.hi;
    // Only oil displaced through the valve enters the return line; leakage and compression bypass it.
    c.return_flow = c.side == 0 ? 0.0 : std::abs(speed) * other;
    speed += c.drift;
    double joint_speed = speed / c.rate;
    const Range range = machine_.joints[j].position;
    if ((s.q[j] >= range.hi && joint_speed > 0.0) || (s.q[j] <= range.lo && joint_speed < 0.0))
      speed = joint_speed = 0.0;  // at the mechanical stop
    c.acceleration = (speed - c.speed) / s.h;
    c.speed = speed;
    speed_before2_[j] = speed_before_[j];
    speed_before_[j] = s.qd[j];
    // A backward difference of second order has no delay relative to the trapezoidal position.
    s.qdd[j] = (3.0 * joint_speed - 4.0 * speed_before_[j] + speed_before2_[j]) / (2.0 * s.h);
    s.q[j] = std::clamp(s.q[j] + 0.5 * s.h * (s.qd[j] + joint_speed), range.lo, range.hi);
    s.qd[j] = joint_speed;
    if (joint_speed != 0.0 || speed_before_[j] != 0.0) {
      const Taylor3 x = linkage_rates(machine_, static_cast<int>(i), s.q[j]);
      c.length = x.value;
      c.rate = x.d1;
    }
  }
}

void Plant::load() {
  PlantState& s = state_;
  s.q_load = s.q;
  each([&s](HiddenLaw& law) { law.posture(s); });
  const bool moving = std::any_of(s.qdd.begin(), s.qdd.end(), [](double a) { return a != 0.0; }) ||
                      std::any_of(s.qd.begin(), s.qd.end(), [](double v) { return v != 0.0; });
  if (inertia_ && moving) {
    bodies_.dynamic(s.q_load.data(), s.qd.data(), s.qdd.data(), s.payload, loads_);
    s.inertia = loads_.inertia;
    s.gravity = loads_.gravity;
    loaded_with_ = -1.0;
  } else {
    std::fill(s.inertia.begin(), s.inertia.end(), 0.0);
    if (loaded_with_ != s.payload || loaded_at_ != s.q_load) {
      bodies_.gravity(s.q_load.data(), s.payload, loads_);
      loaded_with_ = s.payload;
      loaded_at_ = s.q_load;
      s.gravity = loads_.gravity;
    }
  }
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    c.weight = s.gravity[static_cast<std::size_t>(machine_.cylinders[i].joint)] / c.rate;
    c.force = c.weight;
  }
  each([this, &s](HiddenLaw& law) { law.force(s, bodies_); });
}

void Plant::pressurise() {
  PlantState& s = state_;
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    if (c.side == 0) continue;
    const DirectionLaws& law = laws_.cylinders[i].direction[c.side > 0 ? 0 : 1];
    c.return_pressure = law.return_offset + law.return_laminar * c.return_flow +
                        law.return_orifice * c.return_flow * c.return_flow;
  }
  each([&s](HiddenLaw& law) { law.return_line(s); });
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    if (c.side == 0) continue;
    const Cylinder& drive = machine_.cylinders[i];
    const DirectionLaws& law = laws_.cylinders[i].direction[c.side > 0 ? 0 : 1];
    const double holding = c.side > 0 ? drive.area_rod() : drive.area_piston();
    // A load that drives the motion pressurises the return chamber.
    const double load_pressure = drive.hydraulic() ? -c.side * c.force / holding : 0.0;
    c.pilot_pressure = law.counterbalance ? law.pilot_pressure - law.pilot_slope * load_pressure +
                                                law.pilot_flow * c.flow
                                          : 0.0;
  }
  each([&s](HiddenLaw& law) { law.pilot(s); });
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    CylinderState& c = s.cylinders[i];
    const Cylinder& drive = machine_.cylinders[i];
    c.working = 0.0;
    if (!drive.hydraulic()) continue;
    const double area_a = drive.area_piston(), area_b = drive.area_rod();
    if (c.side == 0) {
      // With a closed valve the loaded chamber carries the load, and the other one is near tank pressure.
      const double tank = laws_.cylinders[i].rest_tank;
      const bool on_a = c.force + area_b * tank > area_a * tank;
      c.pressure_a = on_a ? (c.force + area_b * tank) / area_a : tank;
      c.pressure_b = on_a ? tank : (area_a * tank - c.force) / area_b;
      continue;
    }
    const double fed = c.side > 0 ? area_a : area_b, other = c.side > 0 ? area_b : area_a;
    const double against = c.side * c.force;  // [N] positive against the motion
    double supply = (against + other * c.return_pressure) / fed;
    double back = c.return_pressure;
    // Below tank pressure the anti-cavitation valve lets oil in.
    const double least = std::max(c.pilot_pressure, laws_.cylinders[i].rest_tank);
    if (least > supply) {
      supply = least;
      back = (fed * supply - against) / other;
    }
    c.pressure_a = c.side > 0 ? supply : back;
    c.pressure_b = c.side > 0 ? back : supply;
    c.working = supply;
  }
}

void Plant::supply() {
  PlantState& s = state_;
  for (std::size_t i = 0; i < s.cylinders.size(); ++i) {
    s.cylinders[i].line_drop = 0.0;
    s.cylinders[i].margin = laws_.cylinders[i].margin;
  }
  each([&s](HiddenLaw& law) { law.demand(s); });
  for (std::size_t p = 0; p < s.pumps.size(); ++p) {
    PumpState& pump = s.pumps[p];
    const Pump& drawn = machine_.pumps[p];
    pump.flow = 0.0;
    LargestDemand asked{laws_.standby[p]};
    for (const int i : drawn.feeds) {
      const CylinderState& c = s.cylinders[static_cast<std::size_t>(i)];
      pump.flow += c.flow;
      if (c.asked == 0 || drawn.type == PumpType::kConstantPressure) continue;
      const double chamber = c.asked > 0 ? c.pressure_a : c.pressure_b;
      asked.add(i, chamber + c.margin + c.line_drop);
    }
    pump.demand = asked.pressure;
    pump.leader = asked.leader;
    pump.pressure = std::min(pump.demand, drawn.max_pressure);
  }
  each([&s](HiddenLaw& law) { law.pump(s); });
}

void Plant::sense(SensorState& sensors) {
  sensors.q = state_.q;
  sensors.pressure_a.resize(state_.cylinders.size());
  sensors.pressure_b.resize(state_.cylinders.size());
  sensors.pump.resize(state_.pumps.size());
  for (std::size_t i = 0; i < state_.cylinders.size(); ++i) {
    sensors.pressure_a[i] = state_.cylinders[i].pressure_a;
    sensors.pressure_b[i] = state_.cylinders[i].pressure_b;
  }
  for (std::size_t p = 0; p < state_.pumps.size(); ++p) sensors.pump[p] = state_.pumps[p].pressure;
  each([this, &sensors](HiddenLaw& law) { law.sensors(state_, sensors); });
}

}  // namespace sparflow::simulator
