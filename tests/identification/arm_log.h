#pragma once
/// A one-cylinder lift and logs of it, simulated by a law that the model can represent exactly, so that every error in a
/// test is one that the test has injected.
#include <cmath>
#include <string>
#include <vector>

#include "identification/log/log.h"
#include "models/chain/crane_model.h"
#include "models/files/machine_file.h"
#include "models/machine/static_force.h"
#include "models/math/units.h"

namespace sparflow::testing_support {

inline Machine arm_machine() {
  return parse_machine(R"(name: lift
joints:
  - {name: arm, type: revolute, parent: base, origin: {xyz: [0, 0, 1]}, axis: [0, -1, 0],
     position: [-0.2, 1.2], velocity: [-0.2, 0.2], acceleration: [-0.3, 0.3]}
tip: {joint: arm, xyz: [3, 0, 0]}
links:
  - {name: arm, joint: arm, mass: 400, cog: [1.5, 0, 0], inertia: 300}
cylinders:
  - name: arm
    joint: arm
    bore: 0.12
    rod: 0.07
    linkage: {type: pins, barrel: {frame: base, xyz: [0.4, 0, -0.4]}, rod: {frame: arm, xyz: [0.7, 0, -0.1]}}
pumps:
  - {name: main, feeds: [arm], max_flow_lpm: 90, max_pressure_bar: 250, standby_bar: 20}
valves:
  - {cylinder: arm, max_flow_lpm: {extend: 60, retract: 40}}
)",
                       "lift.yaml", "");
}

constexpr double kMargin = 15.0 * units::kBar;
constexpr double kStandby = 20.0 * units::kBar;
constexpr double kGainExtend = 60.0 * units::kLitrePerMinute;
constexpr double kGainRetract = 40.0 * units::kLitrePerMinute;

/// Working pressures of the simulated plant [Pa], linear in the force, so that the linear mean represents them.
inline double extend_pressure(const Machine& m, double force) {
  return force / m.cylinders[0].area_piston() + 4.0 * units::kBar;
}
inline double retract_pressure(double force) { return 60.0 * units::kBar - force * 50.0; }

inline GaussianProcess linear_process(double constant, double slope) {
  GpParameters p;
  p.length_flow = 1e-3;
  p.length_force = 1e5;
  p.signal_std = p.noise_std = 1e4;
  p.mean_constant = constant;
  p.mean_slope = slope;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
  p.data_count = 1;
  p.flow_max = 1.0;  // the training range covers everything
  p.force_min = -1e9;
  p.force_max = 1e9;
  return GaussianProcess(p);
}

/// @return the model with the plant's own laws
inline CraneModel arm_model() {
  CraneModel model = CraneModel::untrained(arm_machine());
  model.cylinders[0].extend =
      linear_process(4.0 * units::kBar, 1.0 / model.machine.cylinders[0].area_piston());
  model.cylinders[0].retract = linear_process(60.0 * units::kBar, -50.0);
  model.cylinders[0].margin = kMargin;
  model.cylinders[0].valve_gain_extend = kGainExtend;
  model.cylinders[0].valve_gain_retract = kGainRetract;
  model.pumps[0].standby = kStandby;
  return model;
}

inline void add_channel(Log& log, Role role, int index, const std::string& signal,
                        const Eigen::VectorXd& values) {
  Channel c;
  c.column = c.signal = signal;
  c.role = role;
  c.index = index;
  c.values = values;
  c.valid = values.array().isFinite();
  log.channels.push_back(c);
}

inline Channel& channel(Log& log, const std::string& signal) {
  for (Channel& c : log.channels) {
    if (c.signal == signal) return c;
  }
  throw std::logic_error("no channel " + signal);
}

/// Sixty seconds: ten strokes up and down, each at its own speed, with a rest before each.
/// @param noise [bar] of the pressures  @param seed of the noise  @param hertz of the sampling, a whole number
inline Log arm_log(double noise = 0.0, unsigned seed = 1, int hertz = 50) {
  const Machine m = arm_machine();
  const double step = 1.0 / hertz;
  const Eigen::Index n = 60 * hertz;
  Log log;
  log.path = log.file = "arm.csv";
  log.sha256 = std::string(64, '0');
  log.step = step;
  log.time = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  log.runs = {{0, n}};
  Eigen::VectorXd q(n), u = Eigen::VectorXd::Zero(n), a(n), b(n), pump(n), payload(n);
  StaticForce statics(m);
  const auto random = [&seed] {  // sum of uniforms: nearly normal, and equal on all platforms
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) {
      seed = seed * 1664525u + 1013904223u;
      sum += static_cast<double>(seed >> 8) / 16777216.0;
    }
    return sum;
  };
  // Rest, up, rest, down: smooth speed profiles in strokes of 6 s, each faster than the one before.
  const auto rate_at = [](double t) {
    const int stroke = static_cast<int>(t / 6.0);
    const double phase = t / 6.0 - stroke, local = phase < 0.5 ? 2.0 * phase : 2.0 * phase - 1.0;
    if (local < 0.2) return 0.0;
    return (phase < 0.5 ? 1.0 : -1.0) * (0.05 + 0.03 * stroke) *
           std::pow(std::sin(M_PI * (local - 0.2) / 0.8), 2);
  };
  double angle = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const int stroke = static_cast<int>(k / (6 * hertz));
    const double t = log.time[k], rate = rate_at(t);
    if (k > 0) {  // Simpson's rule over the last step
      angle += step / 6.0 * (rate_at(t - step) + 4.0 * rate_at(t - 0.5 * step) + rate);
    }
    q[k] = angle;
    payload[k] = 100.0 * (stroke % 3);
    statics.update(&angle, payload[k], 0);
    const double force = statics.force()[0], speed = statics.length(0).d1 * rate;
    const double side = speed > 0.0 ? m.cylinders[0].area_piston() : m.cylinders[0].area_rod();
    if (rate != 0.0) u[k] = speed * side / (speed > 0.0 ? kGainExtend : kGainRetract);
    const double working = speed > 0.0 ? extend_pressure(m, force) : retract_pressure(force);
    // the other chamber follows from the force balance
    a[k] = speed < 0.0
               ? (force + working * m.cylinders[0].area_rod()) / m.cylinders[0].area_piston()
               : working;
    b[k] = speed < 0.0
               ? working
               : (working * m.cylinders[0].area_piston() - force) / m.cylinders[0].area_rod();
    pump[k] = u[k] == 0.0 ? kStandby : std::max(kStandby, working + kMargin);
    a[k] += noise * units::kBar * random();
    b[k] += noise * units::kBar * random();
    pump[k] += noise * units::kBar * random();
  }
  add_channel(log, Role::kJointPosition, 0, "q_arm", q);
  add_channel(log, Role::kCommand, 0, "u_arm", u);
  add_channel(log, Role::kPressureA, 0, "pA_arm", a);
  add_channel(log, Role::kPressureB, 0, "pB_arm", b);
  add_channel(log, Role::kPumpPressure, 0, "p_main", pump);
  add_channel(log, Role::kPayload, -1, "payload", payload);
  return log;
}

/// The same with Coulomb friction [N] that the model lacks: the measured force is larger while extending.
inline Log arm_log_with_friction(double friction, unsigned seed = 1) {
  Log log = arm_log(0.8, seed);
  const double area = arm_machine().cylinders[0].area_piston();
  const Eigen::VectorXd u = channel(log, "u_arm").values;
  const Eigen::VectorXd side = (u.array() > 0.0).cast<double>() - (u.array() < 0.0).cast<double>();
  channel(log, "pA_arm").values += side * (friction / area);
  log.sha256 = std::string(64, static_cast<char>('0' + seed % 10));
  return log;
}

inline void remove_channel(Log& log, const std::string& signal) {
  std::erase_if(log.channels, [&](const Channel& c) { return c.signal == signal; });
}

}  // namespace sparflow::testing_support
