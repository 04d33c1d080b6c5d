#pragma once
/// A small log for tests of effects: two direct cylinders on one load-sensing pump, without noise, constructed so that
/// every regime occurs.
#include <cmath>
#include <limits>
#include <vector>

#include "models/effects/instant.h"
#include "models/effects/registry.h"
#include "models/math/linear_algebra.h"
#include "tests/models/test_machines.h"

namespace sparflow::test_support {

inline Machine two_direct_cylinders() {
  Machine m;
  m.name = "pair";
  for (const char* name : {"lift", "push"}) {
    const int joint = m.joint_count();
    m.joints.push_back(make_joint(name, JointType::kPrismatic, {0, 0, 0}, {1, 0, 0}, {0.0, 2.0}));
    m.links.push_back(make_link(name, joint, 100.0, {0.5, 0, 0}));
    m.cylinders.push_back(make_cylinder(name, joint, 0.1, 0.06, DirectLinkage{}));
  }
  m.tip.joint = 1;
  Pump pump;
  pump.name = "main";
  pump.feeds = {0, 1};
  pump.max_flow = 2e-3;
  pump.max_pressure = 300e5;
  pump.standby = 20e5;
  m.pumps.push_back(pump);
  m.valves.push_back({0, 1.2e-3, 0.8e-3});
  m.valves.push_back({1, 1.0e-3, 0.7e-3});
  return m;
}

/// 40 s at 50 Hz of overlapping ramps and steps. Speeds follow the commands by the valves' full flow.
inline MachineSeries two_cylinder_series(const Machine& m) {
  MachineSeries s;
  constexpr Eigen::Index n = 2000;
  s.machine = std::make_shared<const Machine>(m);
  s.step = 0.02;
  s.time = Eigen::VectorXd::LinSpaced(n, 0.0, s.step * static_cast<double>(n - 1));
  s.runs = {{0, 1200}, {1200, n}};
  s.q = s.qd = s.qdd = Eigen::MatrixXd::Zero(n, 2);
  s.payload = Eigen::VectorXd::Constant(n, 500.0);
  s.oil = 25.0 + 40.0 * s.time.array() / s.time[n - 1];
  s.cylinders.resize(2);
  s.pumps.resize(1);
  for (std::size_t i = 0; i < 2; ++i) {
    CylinderSeries& c = s.cylinders[i];
    const double a = m.cylinders[i].area_piston(), b = m.cylinders[i].area_rod();
    for (Eigen::VectorXd* v :
         {&c.length, &c.rate, &c.speed, &c.acceleration, &c.static_force, &c.force, &c.command,
          &c.pressure_a, &c.pressure_b, &c.flow, &c.return_flow}) {
      v->setZero(n);
    }
    c.rate.setOnes();
    c.direction.setZero(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double t = s.time[k];
      // clipped triangles of different periods with pauses, and some steps
      double u = 1.3 * std::asin(std::sin(t * (i == 0 ? 0.9 : 1.37) + static_cast<double>(i))) /
                 (0.5 * std::numbers::pi);
      u = std::clamp(u, -1.0, 1.0);
      if (std::fmod(t, 7.0) > 6.0) u = 0.0;
      if (std::fmod(t + 2.0 * static_cast<double>(i), 11.0) > 9.0) u = i == 0 ? 0.6 : -0.5;
      c.command[k] = u;
      c.direction[k] = u > 0.0 ? 1 : u < 0.0 ? -1 : 0;
      const Valve& valve = *m.valve_of_cylinder(static_cast<int>(i));
      c.speed[k] = u > 0.0 ? u * valve.max_flow_extend / a : u * valve.max_flow_retract / b;
      c.flow[k] = std::abs(c.speed[k]) * (u > 0.0 ? a : b);
      c.return_flow[k] = std::abs(c.speed[k]) * (u > 0.0 ? b : a);
      c.length[k] = 1.0 + 0.3 * std::sin(0.3 * t);
      c.static_force[k] = c.force[k] = 40e3 * std::sin(0.41 * t + static_cast<double>(i));
      c.pressure_a[k] = 60e5 + 30e5 * std::sin(0.7 * t);
      c.pressure_b[k] = 40e5 + 20e5 * std::cos(0.9 * t);
    }
    s.q.col(static_cast<Eigen::Index>(i)) = c.length;
  }
  PumpSeries& pump = s.pumps[0];
  pump.demand = Eigen::VectorXd::Constant(n, 20e5);
  pump.leader = Eigen::VectorXi::Constant(n, -1);
  for (int i = 0; i < 2; ++i) {
    const CylinderSeries& c = s.cylinders[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < n; ++k) {
      if (c.direction[k] == 0) continue;
      const double asked = (c.direction[k] > 0 ? c.pressure_a : c.pressure_b)[k] + 15e5;
      if (asked > pump.demand[k]) {
        pump.demand[k] = asked;
        pump.leader[k] = i;
      }
    }
  }
  pump.pressure = pump.demand;
  return s;
}

/// Ordinary least squares with columns scaled to one.
inline Eigen::VectorXd scaled_least_squares(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  const Eigen::VectorXd size = x.colwise().norm();
  const Eigen::MatrixXd scaled = x * size.cwiseInverse().asDiagonal();
  return sparflow::least_squares(scaled, y).cwiseQuotient(size);
}

inline const Effect& effect_named(const std::string& id) {
  const Effect* effect = find_effect(id);
  if (effect == nullptr) throw std::runtime_error("no effect " + id);
  return *effect;
}

/// One instant in SI, two cylinders of `two_direct_cylinders`: lift extends against 50 kN, push retracts with
/// an overrunning load of 10 kN.
template <class T>
Instant<T> two_cylinder_instant(const Machine& m) {
  Instant<T> s = make_instant<T>(m);
  s.payload = 500.0;
  s.oil = 25.0;
  s.side = {1, -1};
  s.speed = {T(0.1), T(-0.08)};
  s.force = {T(50e3), T(10e3)};
  s.static_force = s.force;
  for (std::size_t i = 0; i < 2; ++i) {
    const double a = m.cylinders[i].area_piston(), b = m.cylinders[i].area_rod();
    s.flow[i] = s.speed[i] * (s.side[i] > 0 ? a : -b);
    s.return_flow[i] = s.speed[i] * (s.side[i] > 0 ? b : -a);
  }
  s.pressure = {T(70e5), T(40e5)};
  s.pump_flow = {s.flow[0] + s.flow[1]};
  s.pump_pressure = {T(85e5)};
  s.leader = {0};
  return s;
}

}  // namespace sparflow::test_support
