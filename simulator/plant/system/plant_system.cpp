#include "simulator/plant/system/plant_system.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/error.h"

namespace sparflow::plant {
namespace {

constexpr double kTankPressure = 0.2e5;  // [Pa] in return line and hoses of a machine at rest
constexpr double kSupplyHose = 0.5;      // share of a supply line that is hose
constexpr double kLeastVolume = 0.2;     // of the dead volume, kept where a stop yields

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

PlantSystem::PlantSystem(const Machine& machine, const PlantParameters& parameters, double payload)
    : booms_(flexible_booms(machine, parameters.flex_angle, parameters.flex_damping, payload)),
      parameters_(parameters),
      oil_(parameters.oil),
      bodies_(booms_.machine, parameters.pendulum, payload) {
  const Machine& m = booms_.machine;
  layout_ = {bodies_.size(), m.cylinder_count(), m.pump_count()};
  locked_.assign(m.joints.size(), true);
  for (const int h : booms_.hinges) locked_[index(h)] = false;
  for (int c = 0; c < m.cylinder_count(); ++c) {
    const Cylinder& drive = m.cylinders[index(c)];
    const CylinderParameters& p = parameters_.cylinders[index(c)];
    const Joint& joint = m.joints[index(drive.joint)];
    locked_[index(drive.joint)] = false;
    Constants k;
    k.pump = m.pump_of_cylinder(c);
    const double lo = cylinder_length(m, c, joint.position.lo);
    const double hi = cylinder_length(m, c, joint.position.hi);
    k.shortest = std::min(lo, hi);
    k.longest = std::max(lo, hi);
    if (drive.stroke &&
        drive.length_at_zero_stroke) {  // the stop is where stroke or range ends first
      k.shortest = std::max(k.shortest, *drive.length_at_zero_stroke);
      k.longest = std::min(k.longest, *drive.length_at_zero_stroke + *drive.stroke);
    }
    k.top_speed = std::max(joint.velocity.hi, -joint.velocity.lo) *
                  std::abs(linkage_rates(m, c, 0.5 * (joint.position.lo + joint.position.hi)).d1);
    if (drive.hydraulic()) {
      k.area_a = drive.area_piston();
      k.area_b = drive.area_rod();
      k.reference_speed = p.max_flow_extend / k.area_a;
      k.return_a = p.max_flow_retract * k.area_a / k.area_b;
      k.return_b = p.max_flow_extend * k.area_b / k.area_a;
      k.full_a = std::max(p.max_flow_extend, k.return_a);
      k.full_b = std::max(p.max_flow_retract, k.return_b);
      k.stiffness = k.area_a * parameters_.pumps[index(k.pump)].cut_off / p.end.stop_travel;
    }
    constants_.push_back(k);
  }
  for (int p = 0; p < layout_.pumps; ++p) {
    const PumpParameters& pump = parameters_.pumps[index(p)];
    const Chamber line = supply(p);
    const double capacity =
        line.volume(100e5) / oil_.at(100e5).modulus + line.hose / line.hose_modulus;
    pump_gains_.push_back(pump_gains(pump, capacity));
    // of the machine's pumps, not of one whose limit is switched off
    tank_full_flow_ += m.pumps[index(p)].max_flow;
  }
  tank_full_flow_ = std::max(tank_full_flow_, 1e-4);
  mass_.setZero(layout_.coordinates, layout_.coordinates);
  force_.setZero(layout_.coordinates);
}

void PlantSystem::set_payload(double payload) { bodies_.set_payload(payload); }

double PlantSystem::gap(int cylinder, double length) const {
  const Constants& k = constants_[index(cylinder)];
  return std::min(length - k.shortest, k.longest - length);
}

double PlantSystem::rope_margin(const double* state) const {
  if (!bodies_.hanging()) return 1.0;
  constexpr double kEnd = 0.15;  // cosine; RigidBodies refuses 0.087
  return (std::cos(state[layout_.coordinates - 1]) - kEnd) / (1.0 - kEnd);
}

Chamber PlantSystem::chamber_a(int c, double length) const {
  const CylinderParameters& p = parameters_.cylinders[index(c)];
  const Constants& k = constants_[index(c)];
  const double stroke =
      std::max(length - k.shortest, -(1.0 - kLeastVolume) * p.dead_volume / k.area_a);
  return {p.dead_volume + k.area_a * stroke, 0.0, p.hose_modulus};
}

Chamber PlantSystem::chamber_b(int c, double length) const {
  const CylinderParameters& p = parameters_.cylinders[index(c)];
  const Constants& k = constants_[index(c)];
  const double stroke =
      std::max(k.longest - length, -(1.0 - kLeastVolume) * p.dead_volume / k.area_b);
  return {p.dead_volume + k.area_b * stroke, 0.0, p.hose_modulus};
}

Chamber PlantSystem::hose(int c) const {
  const CylinderParameters& p = parameters_.cylinders[index(c)];
  return {0.0, p.hose_volume, p.hose_modulus};
}

Chamber PlantSystem::supply(int p) const {
  const double volume = parameters_.pumps[index(p)].line_volume;
  const double modulus =
      parameters_.cylinders.empty() ? 1e9 : parameters_.cylinders.front().hose_modulus;
  return {(1.0 - kSupplyHose) * volume, kSupplyHose * volume, modulus};
}

Chamber PlantSystem::tank() const { return {parameters_.tank.volume, 0.0, 1e9}; }

std::vector<double> PlantSystem::rest(const std::vector<double>& q) {
  std::vector<double> state(index(layout_.size()), 0.0);
  for (std::size_t k = 0; k < booms_.joint_of.size(); ++k) state[index(booms_.joint_of[k])] = q[k];
  const std::vector<double> still(index(layout_.coordinates), 0.0);
  for (int iteration = 0; iteration < 50;
       ++iteration) {  // bending: a contraction, angles are small
    bodies_.update(state.data(), still.data());
    double change = 0.0;
    for (std::size_t h = 0; h < booms_.hinges.size(); ++h) {
      const double bent = -bodies_.bias()[booms_.hinges[h]] / booms_.stiffness[h];
      change = std::max(change, std::abs(bent - state[index(booms_.hinges[h])]));
      state[index(booms_.hinges[h])] = bent;
    }
    if (change < 1e-12) break;
  }
  bodies_.update(state.data(), still.data());
  const Machine& m = booms_.machine;
  for (int c = 0; c < layout_.cylinders; ++c) {
    const Cylinder& drive = m.cylinders[index(c)];
    Constants& k = constants_[index(c)];
    const Taylor3 x = linkage_rates(m, c, state[index(drive.joint)]);
    const double rate = x.d1;
    // A machine that stands beyond the range that its file tells has its stop there.
    k.shortest = std::min(k.shortest, x.value);
    k.longest = std::max(k.longest, x.value);
    const double load = bodies_.bias()[drive.joint] / rate;
    if (!drive.hydraulic()) {
      state[index(layout_.cylinder(c, StateLayout::kPressureA))] = load;  // its integral, a force
      continue;
    }
    const double unloaded = parameters_.cylinders[index(c)].rest_pressure;
    double a = unloaded, b = unloaded;
    if (load + k.area_b * b > k.area_a * a) {
      a = (load + k.area_b * b) / k.area_a;
    } else {
      b = (k.area_a * a - load) / k.area_b;
    }
    state[index(layout_.cylinder(c, StateLayout::kPressureA))] = a;
    state[index(layout_.cylinder(c, StateLayout::kPressureB))] = b;
    state[index(layout_.cylinder(c, StateLayout::kHoseA))] = kTankPressure;
    state[index(layout_.cylinder(c, StateLayout::kHoseB))] = kTankPressure;
  }
  for (int p = 0; p < layout_.pumps; ++p) {
    const PumpParameters& pump = parameters_.pumps[index(p)];
    const bool constant = m.pumps[index(p)].type == PumpType::kConstantPressure;
    const double pressure = pump_set_pressure(0.0, constant, pump);
    const double share = pump.leakage * pressure / pump.max_flow;
    state[index(layout_.pump(p, StateLayout::kSupply))] = pressure;
    state[index(layout_.pump(p, StateLayout::kDisplacement))] = share;
    state[index(layout_.pump(p, StateLayout::kIntegral))] = share;
  }
  state[index(layout_.tank())] = kTankPressure;
  state[index(layout_.temperature())] = parameters_.tank.temperature;
  return state;
}

double PlantSystem::stored_energy(const double* state, const Instant& at) {
  const int n = layout_.coordinates;
  bodies_.update(state, state + n);
  double energy = bodies_.kinetic_energy(state + n) + bodies_.potential_energy(state);
  for (std::size_t h = 0; h < booms_.hinges.size(); ++h) {
    const double bent = state[booms_.hinges[h]];
    energy += 0.5 * booms_.stiffness[h] * bent * bent;
  }
  const auto add = [&](const Chamber& chamber, double pressure) {
    energy += chamber.energy(oil_.at(pressure), pressure);
  };
  for (int c = 0; c < layout_.cylinders; ++c) {
    const CylinderInstant& i = at.cylinders[index(c)];
    energy += i.stored;
    if (constants_[index(c)].area_a <= 0.0) continue;
    add(chamber_a(c, i.length), state[layout_.cylinder(c, StateLayout::kPressureA)]);
    add(chamber_b(c, i.length), state[layout_.cylinder(c, StateLayout::kPressureB)]);
    add(hose(c), state[layout_.cylinder(c, StateLayout::kHoseA)]);
    add(hose(c), state[layout_.cylinder(c, StateLayout::kHoseB)]);
  }
  for (int p = 0; p < layout_.pumps; ++p)
    add(supply(p), state[layout_.pump(p, StateLayout::kSupply)]);
  add(tank(), state[layout_.tank()]);
  return energy;
}

std::vector<double> PlantSystem::tolerances(double relative) const {
  std::vector<double> tolerance(index(layout_.size()), 0.0);
  // Scales: a position of a metre or radian, 0.1 of it in a second, 10 bar, a spool's full travel, presliding, 100 K.
  const int n = layout_.coordinates;
  for (int k = 0; k < n; ++k) {
    tolerance[index(k)] = 0.01 * relative;
    tolerance[index(n + k)] = 0.1 * relative;
  }
  for (int c = 0; c < layout_.cylinders; ++c) {
    const auto set = [&](StateLayout::Cyl part, double scale) {
      tolerance[index(layout_.cylinder(c, part))] = relative * scale;
    };
    const bool hydraulic = constants_[index(c)].area_a > 0.0;
    for (const auto part : {StateLayout::kPressureA, StateLayout::kPressureB, StateLayout::kHoseA,
                            StateLayout::kHoseB, StateLayout::kPilotA, StateLayout::kPilotB})
      set(part, hydraulic ? 10e5 : 100.0);
    set(StateLayout::kBristle, parameters_.cylinders[index(c)].friction.presliding);
    for (const auto part : {StateLayout::kPlay, StateLayout::kSpool}) set(part, 0.1);
    set(StateLayout::kSpoolRate, 3.0);
  }
  for (int p = 0; p < layout_.pumps; ++p) {
    for (const auto part : {StateLayout::kSupply, StateLayout::kLineEntry, StateLayout::kLineEnd})
      tolerance[index(layout_.pump(p, part))] = relative * 10e5;
    for (const auto part : {StateLayout::kDisplacement, StateLayout::kIntegral})
      tolerance[index(layout_.pump(p, part))] = relative * 0.1;
  }
  tolerance[index(layout_.tank())] = relative * 1e5;
  tolerance[index(layout_.temperature())] = relative * 10.0;
  return tolerance;
}

}  // namespace sparflow::plant
