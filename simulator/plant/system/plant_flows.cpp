/// Right-hand side of PlantSystem: flows, forces and rates of one instant.
#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/plant/system/plant_system.h"

namespace sparflow::plant {
namespace {

constexpr double kAsking =
    0.02;  // [-] opening at which a section's load-sensing port is fully open
constexpr double kNeutralDrain =
    0.05;  // [-] of the return edge that stays open in neutral, for counterbalance valves
constexpr double kReturnReserve =
    1.03;  // of a limited return edge over its supply edge, else the two would lock
constexpr double kCracking = 0.3e5;        // [Pa] of anti-cavitation valves
constexpr double kRefillDrop = 2e5;        // [Pa] over them at the port's full flow
constexpr double kReliefRange = 10e5;      // [Pa] from closed to the pump's full flow
constexpr double kPortReliefRange = 20e5;  // [Pa] from closed to the port's full flow
constexpr double kDriveIntegral =
    0.2;  // [s] reset time of the speed control of a drive without hydraulics

std::size_t place(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void PlantSystem::evaluate(const double* state, const std::vector<double>& command, Instant& at) {
  const int n = layout_.coordinates;
  const Machine& m = booms_.machine;
  at.cylinders.resize(place(layout_.cylinders));
  at.pumps.resize(place(layout_.pumps));
  bodies_.update(state, state + n);
  for (int c = 0; c < layout_.cylinders; ++c) {
    CylinderInstant& i = at.cylinders[place(c)];
    i = CylinderInstant{};
    const int j = m.cylinders[place(c)].joint;
    const Taylor3 x = linkage_rates(m, c, state[j]);
    i.length = x.value;
    i.rate = x.d1;
    i.speed = x.d1 * state[n + j];
  }
  const double viscosity =
      oil_.relative_viscosity(std::clamp(state[layout_.temperature()], -30.0, 150.0));
  evaluate_sections(state, at);
  for (int c = 0; c < layout_.cylinders; ++c) {
    if (constants_[place(c)].area_a > 0.0) evaluate_hydraulics(state, c, viscosity, at);
    evaluate_force(state, c, viscosity, command[place(c)], at.cylinders[place(c)]);
  }
  evaluate_supplies(state, at);
  at.swing_loss = 0.0;
  for (std::size_t h = 0; h < booms_.hinges.size(); ++h) {
    const double rate = state[n + booms_.hinges[h]];
    at.swing_loss += booms_.damping[h] * rate * rate;
  }
  if (bodies_.hanging()) {
    for (int k = bodies_.joints(); k < n; ++k)
      at.swing_loss += bodies_.swing_damping() * state[n + k] * state[n + k];
  }
}

/// Openings of the supply edges and what the sections ask of their pump.
void PlantSystem::evaluate_sections(const double* state, Instant& at) {
  for (PumpInstant& pump : at.pumps) pump = PumpInstant{};
  for (int c = 0; c < layout_.cylinders; ++c) {
    const Constants& k = constants_[place(c)];
    if (k.area_a <= 0.0) continue;
    const SpoolParameters& p = parameters_.cylinders[place(c)].spool;
    CylinderInstant& i = at.cylinders[place(c)];
    const double spool = state[layout_.cylinder(c, StateLayout::kSpool)];
    i.opening_a = spool_opening(spool, p.dead_band_extend);
    i.opening_b = spool_opening(-spool, p.dead_band_retract);
    const double a = state[layout_.cylinder(c, StateLayout::kHoseA)];
    const double b = state[layout_.cylinder(c, StateLayout::kHoseB)];
    i.asked = std::max(ramp(i.opening_a / kAsking) * a, ramp(i.opening_b / kAsking) * b);
    PumpInstant& pump = at.pumps[place(k.pump)];
    pump.highest = std::max(pump.highest, i.asked);
  }
}

void PlantSystem::evaluate_hydraulics(const double* state, int c, double viscosity, Instant& at) {
  const Constants& k = constants_[place(c)];
  const CylinderParameters& p = parameters_.cylinders[place(c)];
  CylinderInstant& i = at.cylinders[place(c)];
  const auto value = [&](StateLayout::Cyl part) { return state[layout_.cylinder(c, part)]; };
  const double pa = value(StateLayout::kPressureA), pb = value(StateLayout::kPressureB);
  const double ha = value(StateLayout::kHoseA), hb = value(StateLayout::kHoseB);
  const double ps = state[layout_.pump(k.pump, StateLayout::kSupply)], pt = state[layout_.tank()];
  const bool sharing = parameters_.pumps[place(k.pump)].flow_sharing > 0.5;
  const double shared = ps - at.pumps[place(k.pump)].highest;
  i.in_a = meter_in(i.opening_a, ps - ha, sharing ? shared : ps - ha,
                    {p.max_flow_extend, p.compensator});
  i.in_b = meter_in(i.opening_b, ps - hb, sharing ? shared : ps - hb,
                    {p.max_flow_retract, p.compensator});
  // A counterbalance valve closes only where the spool lets its hose and its pilot's down to tank in neutral.
  const double spool = value(StateLayout::kSpool);
  const double drain = p.counterbalance.sides > 0.5 ? kNeutralDrain : 0.0;
  const double drain_a = drain * (1.0 - ramp(spool / std::max(p.spool.dead_band_extend, 0.01)));
  const double drain_b = drain * (1.0 - ramp(-spool / std::max(p.spool.dead_band_retract, 0.01)));
  const CounterbalanceParameters& v = p.counterbalance;
  const auto out = [&p](bool held, double opening, double drop, double full) {
    return held ? throttle(opening, drop, full, p.return_drop)
                : limited_throttle(opening, drop, kReturnReserve * full, p.return_drop);
  };
  i.out_a = out(holds_bore(v), i.opening_b + drain_a, ha - pt, k.return_a);
  i.out_b = out(holds_rod(v), i.opening_a + drain_b, hb - pt, k.return_b);
  const double open_a = counterbalance_opening(pa, value(StateLayout::kPilotA), ha, v);
  const double open_b = counterbalance_opening(pb, value(StateLayout::kPilotB), hb, v);
  i.port_a = port_flow(ha - pa, {holds_bore(v), open_a, k.full_a, p.line_drop}, v);
  i.port_b = port_flow(hb - pb, {holds_rod(v), open_b, k.full_b, p.line_drop}, v);
  i.leak = p.leakage / viscosity * (pa - pb);
  const double suck_a = pt - pa - kCracking, suck_b = pt - pb - kCracking;
  if (suck_a > 0.0) i.refill_a = throttle(1.0, suck_a, k.full_a, kRefillDrop);
  if (suck_b > 0.0) i.refill_b = throttle(1.0, suck_b, k.full_b, kRefillDrop);
  i.relief_a = k.full_a * std::max(pa - p.port_relief, 0.0) / kPortReliefRange;
  i.relief_b = k.full_b * std::max(pb - p.port_relief, 0.0) / kPortReliefRange;
  PumpInstant& pump = at.pumps[place(k.pump)];
  pump.taken += i.in_a + i.in_b;
  const double ws = oil_.at(ps).flow_work, wt = oil_.at(pt).flow_work;
  const double wa = oil_.at(pa).flow_work, wb = oil_.at(pb).flow_work;
  const double wha = oil_.at(ha).flow_work, whb = oil_.at(hb).flow_work;
  const auto loss = [&i](Loss at_place) -> double& {
    return i.loss[static_cast<std::size_t>(at_place)];
  };
  loss(Loss::kMeterIn) = i.in_a * (ws - wha) + i.in_b * (ws - whb);
  loss(Loss::kMeterOut) = i.out_a * (wha - wt) + i.out_b * (whb - wt);
  // Out of a chamber the valve throttles alone, into it hose and check valve (components/counterbalance.h).
  const auto port = [](bool held, double flow) {
    return held && flow < 0.0 ? Loss::kCounterbalance : Loss::kLine;
  };
  loss(port(holds_bore(v), i.port_a)) += i.port_a * (wha - wa);
  loss(port(holds_rod(v), i.port_b)) += i.port_b * (whb - wb);
  loss(Loss::kLeakage) = i.leak * (wa - wb);
  loss(Loss::kAntiCavitation) = i.refill_a * (wt - wa) + i.refill_b * (wt - wb);
  loss(Loss::kPortRelief) = i.relief_a * (wa - wt) + i.relief_b * (wb - wt);
}

void PlantSystem::evaluate_force(const double* state, int c, double viscosity, double command,
                                 CylinderInstant& i) const {
  const Constants& k = constants_[place(c)];
  const CylinderParameters& p = parameters_.cylinders[place(c)];
  const double pa = state[layout_.cylinder(c, StateLayout::kPressureA)];
  if (k.area_a > 0.0) {
    i.force = pa * k.area_a - state[layout_.cylinder(c, StateLayout::kPressureB)] * k.area_b;
  } else {  // speed control: the state in place of a pressure is its integral
    i.force = pa + p.drive_gain * (command * k.top_speed - i.speed);
    i.drive_power = i.force * i.speed;
  }
  const double bristle = state[layout_.cylinder(c, StateLayout::kBristle)];
  const Friction f = friction(i.speed, bristle, viscosity, p.friction);
  const EndStop in =
      end_stop({i.length - k.shortest, -i.speed, k.area_a, k.reference_speed, k.stiffness}, p.end);
  const EndStop out =
      end_stop({k.longest - i.length, i.speed, k.area_a, k.reference_speed, k.stiffness}, p.end);
  i.force += in.force - out.force - f.force;
  i.bristle_rate = f.bristle_rate;
  i.loss[static_cast<std::size_t>(Loss::kFriction)] = f.loss;
  i.loss[static_cast<std::size_t>(Loss::kEndStop)] = in.loss + out.loss;
  i.stored = in.stored + out.stored + bristle_energy(bristle, p.friction);
}

void PlantSystem::evaluate_supplies(const double* state, Instant& at) {
  const double pt = state[layout_.tank()];
  at.tank_flow = throttle(1.0, pt, tank_full_flow_, parameters_.tank.drop);
  const double wt = oil_.at(pt).flow_work;
  at.tank_loss = at.tank_flow * wt;
  at.heat = at.tank_loss;
  for (int p = 0; p < layout_.pumps; ++p) {
    const PumpParameters& q = parameters_.pumps[place(p)];
    PumpInstant& i = at.pumps[place(p)];
    const double pressure = state[layout_.pump(p, StateLayout::kSupply)];
    i.flow = std::clamp(state[layout_.pump(p, StateLayout::kDisplacement)], 0.0, 1.0) * q.max_flow;
    i.leak = q.leakage * std::max(pressure, 0.0);
    const double above = pressure - q.cut_off - q.relief_above;
    if (above > 0.0) i.relief = q.max_flow * above / kReliefRange;
    const double w = oil_.at(pressure).flow_work;
    at.heat += i.leak * w + i.relief * (w - wt);
  }
  for (const CylinderInstant& i : at.cylinders)
    for (const double loss : i.loss) at.heat += loss;
}

void PlantSystem::hydraulic_rates(const double* state, const std::vector<double>& command,
                                  const Instant& at, double* rate) const {
  double into_tank_line = -at.tank_flow;
  for (int c = 0; c < layout_.cylinders; ++c) {
    const Constants& k = constants_[place(c)];
    const CylinderParameters& p = parameters_.cylinders[place(c)];
    const CylinderInstant& i = at.cylinders[place(c)];
    const auto value = [&](StateLayout::Cyl part) { return state[layout_.cylinder(c, part)]; };
    const auto set = [&](StateLayout::Cyl part, double r) { rate[layout_.cylinder(c, part)] = r; };
    for (int part = 0; part < StateLayout::kPerCylinder; ++part)
      rate[layout_.cylinder(c, static_cast<StateLayout::Cyl>(part))] = 0.0;
    set(StateLayout::kBristle, i.bristle_rate);
    if (k.area_a <= 0.0) {
      set(StateLayout::kPressureA,
          p.drive_gain / kDriveIntegral * (command[place(c)] * k.top_speed - i.speed));
      continue;
    }
    const double pa = value(StateLayout::kPressureA), pb = value(StateLayout::kPressureB);
    const double ha = value(StateLayout::kHoseA), hb = value(StateLayout::kHoseB);
    const Chamber h = hose(c);
    set(StateLayout::kPressureA,
        chamber_a(c, i.length)
            .pressure_rate(oil_.at(pa), pa, i.port_a - i.leak + i.refill_a - i.relief_a,
                           k.area_a * i.speed));
    set(StateLayout::kPressureB,
        chamber_b(c, i.length)
            .pressure_rate(oil_.at(pb), pb, i.port_b + i.leak + i.refill_b - i.relief_b,
                           -k.area_b * i.speed));
    set(StateLayout::kHoseA, h.pressure_rate(oil_.at(ha), ha, i.in_a - i.out_a - i.port_a, 0.0));
    set(StateLayout::kHoseB, h.pressure_rate(oil_.at(hb), hb, i.in_b - i.out_b - i.port_b, 0.0));
    const SpoolRates s =
        spool_rates(std::clamp(command[place(c)], -1.0, 1.0), value(StateLayout::kPlay),
                    value(StateLayout::kSpool), value(StateLayout::kSpoolRate), p.spool);
    set(StateLayout::kPlay, s.play);
    set(StateLayout::kSpool, s.position);
    set(StateLayout::kSpoolRate, s.velocity);
    set(StateLayout::kPilotA, (hb - value(StateLayout::kPilotA)) / p.counterbalance.lag);
    set(StateLayout::kPilotB, (ha - value(StateLayout::kPilotB)) / p.counterbalance.lag);
    into_tank_line += i.out_a + i.out_b + i.relief_a + i.relief_b - i.refill_a - i.refill_b;
  }
  for (int p = 0; p < layout_.pumps; ++p) {
    const PumpParameters& q = parameters_.pumps[place(p)];
    const PumpInstant& i = at.pumps[place(p)];
    const auto value = [&](StateLayout::Pmp part) { return state[layout_.pump(p, part)]; };
    const double pressure = value(StateLayout::kSupply);
    rate[layout_.pump(p, StateLayout::kSupply)] = supply(p).pressure_rate(
        oil_.at(pressure), pressure, i.flow - i.taken - i.leak - i.relief, 0.0);
    const bool constant = booms_.machine.pumps[place(p)].type == PumpType::kConstantPressure;
    const double set = pump_set_pressure(value(StateLayout::kLineEnd), constant, q);
    const PumpRates r = pump_rates({set - pressure, pressure, value(StateLayout::kDisplacement),
                                    value(StateLayout::kIntegral)},
                                   pump_gains_[place(p)], q);
    rate[layout_.pump(p, StateLayout::kDisplacement)] = r.displacement;
    rate[layout_.pump(p, StateLayout::kIntegral)] = r.integral;
    const double lag = 0.5 * q.line_delay;
    rate[layout_.pump(p, StateLayout::kLineEntry)] =
        (i.highest - value(StateLayout::kLineEntry)) / lag;
    rate[layout_.pump(p, StateLayout::kLineEnd)] =
        (value(StateLayout::kLineEntry) - value(StateLayout::kLineEnd)) / lag;
    into_tank_line += i.relief;
  }
  const double pt = state[layout_.tank()];
  rate[layout_.tank()] = tank().pressure_rate(oil_.at(pt), pt, into_tank_line, 0.0);
  const TankParameters& t = parameters_.tank;
  rate[layout_.temperature()] =
      (at.heat - t.cooling * (state[layout_.temperature()] - t.ambient)) / t.heat_capacity;
}

void PlantSystem::motion_rates(const double* state, const Instant& at, double* rate) {
  const int n = layout_.coordinates;
  mass_ = bodies_.mass();
  force_ = -bodies_.bias();
  for (int c = 0; c < layout_.cylinders; ++c) {
    const CylinderInstant& i = at.cylinders[place(c)];
    force_[booms_.machine.cylinders[place(c)].joint] += i.rate * i.force;
  }
  for (std::size_t h = 0; h < booms_.hinges.size(); ++h) {
    const int k = booms_.hinges[h];
    force_[k] -= booms_.stiffness[h] * state[k] + booms_.damping[h] * state[n + k];
  }
  for (int k = bodies_.joints(); k < n; ++k) force_[k] -= bodies_.swing_damping() * state[n + k];
  for (int k = 0; k < bodies_.joints(); ++k) {  // a joint that nothing moves stays where it is
    if (!locked_[place(k)]) continue;
    mass_.row(k).setZero();
    mass_.col(k).setZero();
    mass_(k, k) = 1.0;
    force_[k] = 0.0;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(mass_);
  factor.solveInPlace(force_);
  for (int k = 0; k < n; ++k) {
    rate[k] = state[n + k];
    rate[n + k] = force_[k];
  }
}

void PlantSystem::rates(const double* state, const std::vector<double>& command, const Instant& at,
                        double* rate) {
  hydraulic_rates(state, command, at, rate);
  motion_rates(state, at, rate);
}

}  // namespace sparflow::plant
