#pragma once
/// Helpers for tests of effects: instants with consistent mechanics, as numbers or as Jets, and small logs.
#include "models/effects/instant.h"
#include "models/effects/registry.h"
#include "models/machine/static_force.h"
#include "models/math/error.h"
#include "tests/models/test_machines.h"

namespace sparflow::test_support {

/// Joint states in one vector: q, then qd, then qdd.
inline Eigen::VectorXd stacked(const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                               const Eigen::VectorXd& qdd) {
  Eigen::VectorXd x(3 * q.size());
  x << q, qd, qdd;
  return x;
}

/// The mechanics of one instant: lengths, rates, speeds, static torques and forces.
inline Instant<double> instant_at(const Machine& machine, const Eigen::VectorXd& x,
                                  double payload) {
  Instant<double> s = make_instant(machine);
  const Eigen::Index n = machine.joint_count();
  StaticForce statics(machine);
  statics.update(x.data(), payload, 0);
  s.payload = payload;
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto k = static_cast<std::size_t>(j);
    s.q[k] = x[j];
    s.qd[k] = x[n + j];
    s.qdd[k] = x[2 * n + j];
    s.static_torque[k] = statics.torque()[j];
  }
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const Taylor3& length = statics.length(static_cast<int>(i));
    s.length[i] = length.value;
    s.rate[i] = length.d1;
    s.speed[i] = length.d1 * s.qd[static_cast<std::size_t>(machine.cylinders[i].joint)];
    s.static_force[i] = s.force[i] = statics.force()[static_cast<Eigen::Index>(i)];
    s.side[i] = s.speed[i] > 0.0 ? 1 : s.speed[i] < 0.0 ? -1 : 0;
  }
  return s;
}

/// The same with derivatives with respect to the stacked joint states.
inline Instant<Jet> jets_at(const Machine& machine, const Eigen::VectorXd& x, double payload) {
  Instant<Jet> s = make_instant<Jet>(machine);
  const int n = machine.joint_count(), count = 3 * n;
  StaticForce statics(machine);
  statics.update(x.data(), payload, 2);
  s.payload = payload;
  for (int j = 0; j < n; ++j) {
    const auto k = static_cast<std::size_t>(j);
    s.q[k] = Jet::variable(x[j], j, count);
    s.qd[k] = Jet::variable(x[n + j], n + j, count);
    s.qdd[k] = Jet::variable(x[2 * n + j], 2 * n + j, count);
  }
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const auto c = static_cast<int>(i);
    const auto j = static_cast<std::size_t>(machine.cylinders[i].joint);
    const Taylor3& length = statics.length(c);
    s.length[i] = s.q[j].chain(length.value, length.d1, length.d2);
    s.rate[i] = s.q[j].chain(length.d1, length.d2, length.d3);
    s.speed[i] = s.rate[i] * s.qd[j];
    Jet force(statics.force()[c]);
    for (int a = 0; a < n; ++a) {
      const Jet da = s.q[static_cast<std::size_t>(a)] - Jet(x[a]);
      force += da * Jet(statics.force_jacobian()(c, a));
      for (int b = 0; b < n; ++b) {
        const Jet db = s.q[static_cast<std::size_t>(b)] - Jet(x[b]);
        force += da * db * Jet(0.5 * statics.force_hessian(c)(a, b));
      }
    }
    s.static_force[i] = s.force[i] = force;
    s.static_torque[j] = force * s.rate[i];
    s.side[i] = s.speed[i].value > 0.0 ? 1 : s.speed[i].value < 0.0 ? -1 : 0;
  }
  return s;
}

/// States away from dead centres, because near dx/dq = 0 forces and their derivatives grow without bound.
inline Eigen::VectorXd usable_state(const Machine& machine, Random& random) {
  const Eigen::Index n = machine.joint_count();
  Eigen::VectorXd q(n), qd(n), qdd(n);
  bool usable = false;
  while (!usable) {
    q = random_configuration(machine, random);
    usable = true;
    for (int c = 0; c < machine.cylinder_count(); ++c) {
      const int joint = machine.cylinders[static_cast<std::size_t>(c)].joint;
      usable = usable && std::abs(linkage_rates(machine, c, q[joint]).d1) > 0.15;
    }
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    qd[j] = (random.integer(0, 1) == 0 ? -1.0 : 1.0) * random.uniform(0.05, 0.2);
    qdd[j] = random.uniform(-0.5, 0.5);
  }
  return stacked(q, qd, qdd);
}

/// A log of one run from joint coordinates q_j(t) with exact derivatives; forces measured = static.
/// @param motion returns the stacked joint states at time t
template <class Motion>
MachineSeries log_of(const Machine& machine, const Motion& motion, double seconds, double step,
                     double payload) {
  MachineSeries log;
  const auto n = static_cast<Eigen::Index>(std::lround(seconds / step)) + 1;
  const Eigen::Index joints = machine.joint_count();
  log.machine = std::make_shared<const Machine>(machine);
  log.step = step;
  log.time = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  log.runs = {{0, n}};
  log.q.resize(n, joints);
  log.qd.resize(n, joints);
  log.qdd.resize(n, joints);
  log.payload.setConstant(n, payload);
  log.cylinders.resize(machine.cylinders.size());
  for (CylinderSeries& c : log.cylinders) {
    for (auto* v : {&c.length, &c.rate, &c.speed, &c.static_force, &c.force, &c.flow,
                    &c.return_flow, &c.acceleration, &c.pressure_a, &c.pressure_b}) {
      v->setZero(n);
    }
    c.direction.setZero(n);
  }
  log.pumps.resize(machine.pumps.size());
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::VectorXd x = motion(log.time[k]);
    log.q.row(k) = x.head(joints);
    log.qd.row(k) = x.segment(joints, joints);
    log.qdd.row(k) = x.tail(joints);
    const Instant<double> s = instant_at(machine, x, payload);
    for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
      CylinderSeries& c = log.cylinders[i];
      c.length[k] = s.length[i];
      c.rate[k] = s.rate[i];
      c.speed[k] = s.speed[i];
      c.static_force[k] = c.force[k] = s.static_force[i];
      c.direction[k] = s.side[i];
    }
  }
  return log;
}

inline std::vector<Machine> effect_machines() {
  return {loader_crane(), knuckle_crane(), swing_crane(), random_machine(4, 402),
          random_machine(5, 501)};
}

/// An effect of the catalogue.
inline const Effect& effect(const std::string& id) {
  const Effect* found = find_effect(id);
  SPARFLOW_CHECK(found != nullptr, id);
  return *found;
}

/// Every joint oscillates with its own period, so that poses, speeds and accelerations vary independently.
inline Eigen::VectorXd swinging(const Machine& machine, double t) {
  const Eigen::Index n = machine.joint_count();
  Eigen::VectorXd q(n), qd(n), qdd(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Range& r = machine.joints[static_cast<std::size_t>(j)].position;
    const double a = 0.3 * (r.hi - r.lo), w = 0.5 + 0.13 * static_cast<double>(j);
    q[j] = 0.5 * (r.lo + r.hi) + a * std::sin(w * t + 0.4 + static_cast<double>(j));
    qd[j] = a * w * std::cos(w * t + 0.4 + static_cast<double>(j));
    qdd[j] = -a * w * w * std::sin(w * t + 0.4 + static_cast<double>(j));
  }
  return stacked(q, qd, qdd);
}

inline MachineSeries swinging_log(const Machine& machine, double payload = 300.0) {
  return log_of(
      machine, [&](double t) { return swinging(machine, t); }, 8.0, 0.05, payload);
}

}  // namespace sparflow::test_support
