/// Equations of motion of the plant against a second path, closed forms, and conservation of energy.
#include "simulator/plant/bodies/rigid_bodies.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "models/files/machine_file.h"
#include "models/machine/inertial_torque.h"
#include "models/machine/static_force.h"

namespace sparflow::plant {
namespace {

Machine bundled(const std::string& name) {
  return load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/" + name + ".yaml");
}

const std::vector<std::string>& machine_names() {
  static const std::vector<std::string> names = {
      "loader_crane",          "hmf_2020_k4", "excavator", "swing_crane",
      "swing_crane_two_pumps", "urdf_crane",  "emps"};
  return names;
}

/// A state inside the joints' ranges. @param phase varies it
Eigen::VectorXd some_positions(const Machine& machine, double phase) {
  Eigen::VectorXd q(machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Range r = machine.joints[static_cast<std::size_t>(k)].position;
    q[k] = r.lo + (r.hi - r.lo) * (0.5 + 0.45 * std::sin(phase + 1.7 * k));
  }
  return q;
}

Eigen::VectorXd some_rates(Eigen::Index n, double phase) {
  Eigen::VectorXd rate(n);
  for (Eigen::Index k = 0; k < n; ++k) rate[k] = std::cos(2.3 * phase + static_cast<double>(k));
  return rate;
}

// The second path is the recursion of models/machine, which knows no KDL and no Jacobians of points.
TEST(PlantBodies, MassMatrixAndBiasAgreeWithAnIndependentRecursionOnEveryMachine) {
  for (const std::string& name : machine_names()) {
    const Machine machine = bundled(name);
    const Eigen::Index n = machine.joint_count();
    for (int i = 0; i < 4; ++i) {
      const double payload = 300.0 * i;
      RigidBodies bodies(machine, {}, payload);
      ASSERT_EQ(bodies.size(), n);
      const Eigen::VectorXd q = some_positions(machine, i), qd = some_rates(n, i);
      bodies.update(q.data(), qd.data());
      const Eigen::VectorXd still = Eigen::VectorXd::Zero(n);
      const Eigen::VectorXd h = inertial_torque<double>(machine, q, qd, still, payload) +
                                static_torque<double>(machine, q, payload);
      // same arithmetic in another order
      EXPECT_LT((bodies.bias() - h).norm(), 1e-9 * (1.0 + h.norm())) << name;
      for (Eigen::Index k = 0; k < n; ++k) {
        const Eigen::VectorXd unit = Eigen::VectorXd::Unit(n, k);
        const Eigen::VectorXd column = inertial_torque<double>(machine, q, still, unit, payload);
        EXPECT_LT((bodies.mass().col(k) - column).norm(), 1e-9 * (1.0 + column.norm())) << name;
      }
    }
  }
}

/// Joint and pendulum state advanced by the classical Runge-Kutta method without any force but gravity.
struct Fall {
  RigidBodies& bodies;
  Eigen::VectorXd rate(const Eigen::VectorXd& state) const {
    const Eigen::Index n = bodies.size();
    bodies.update(state.data(), state.data() + n);
    Eigen::VectorXd r(2 * n);
    r.head(n) = state.tail(n);
    r.tail(n) = -bodies.mass().llt().solve(bodies.bias());
    return r;
  }
  void step(Eigen::VectorXd& s, double dt) const {
    const Eigen::VectorXd a = rate(s), b = rate(s + 0.5 * dt * a), c = rate(s + 0.5 * dt * b),
                          d = rate(s + dt * c);
    s += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  double energy(const Eigen::VectorXd& s) const {
    const Eigen::Index n = bodies.size();
    bodies.update(s.data(), s.data() + n);
    return bodies.kinetic_energy(s.data() + n) + bodies.potential_energy(s.data());
  }
};

TEST(PlantBodies, FallingFreelyKeepsItsEnergy) {
  for (const std::string& name : machine_names()) {
    const Machine machine = bundled(name);
    for (const double rope : {0.0, 1.5}) {
      RigidBodies bodies(machine, {rope, 0.0, 10.0}, 500.0);
      const Fall fall{bodies};
      const Eigen::Index n = bodies.size();
      Eigen::VectorXd state = Eigen::VectorXd::Zero(2 * n);
      state.head(machine.joint_count()) = some_positions(machine, 0.3);
      state.tail(n) = 0.2 * some_rates(n, 0.7);
      const double before = fall.energy(state);
      double largest = 0.0;  // of the kinetic energy
      for (int i = 0; i < 100; ++i) {
        fall.step(state, 0.001);
        bodies.update(state.data(), state.data() + n);
        largest = std::max(largest, bodies.kinetic_energy(state.data() + n));
      }
      // RK4's error per step is of order dt^5: far below rounding of the energies here
      EXPECT_NEAR(fall.energy(state), before, 1e-7 * (largest + std::abs(before))) << name << rope;
    }
  }
}

TEST(PlantBodies, APayloadOnARopeSwingsWithThePeriodOfAPendulum) {
  Machine machine = bundled("loader_crane");
  for (Link& link : machine.links) link.mass *= 1e6;  // the tip does not move
  for (Link& link : machine.links) link.inertia *= 1e6;
  const double l = 2.0;
  for (const int angle : {0, 1}) {
    RigidBodies bodies(machine, {l, 0.0, 10.0}, 400.0);
    Eigen::VectorXd state = Eigen::VectorXd::Zero(10);
    state.head(3) = some_positions(machine, 0.1);
    state[3 + angle] = 0.02;
    double t = 0.0, crossing = 0.0;
    const double dt = 1e-3;
    while (crossing == 0.0 && t < 10.0) {
      const double before = state[3 + angle];
      // The joints are held: only the pendulum's rows are free.
      const auto rate = [&](const Eigen::VectorXd& s) {
        bodies.update(s.data(), s.data() + 5);
        Eigen::VectorXd r = Eigen::VectorXd::Zero(10);
        r.segment(3, 2) = s.tail(2);
        r.tail(2) = -bodies.mass().bottomRightCorner(2, 2).llt().solve(bodies.bias().tail(2));
        return r;
      };
      const Eigen::VectorXd a = rate(state), b = rate(state + 0.5 * dt * a);
      state += dt * b;
      t += dt;
      if (before > 0.0 && state[3 + angle] <= 0.0)
        crossing = t - dt * state[3 + angle] / (state[3 + angle] - before);
    }
    const double period = 2.0 * std::numbers::pi * std::sqrt(l / 9.81);
    // (1 + phi^2 / 16): 2.5e-5 of the period at 0.02 rad
    EXPECT_NEAR(4.0 * crossing, period, 1e-4 * period);
  }
}

TEST(PlantBodies, AHangingPayloadAtRestLoadsTheJointsLikeAFixedOne) {
  const Machine machine = bundled("swing_crane");
  const int n = machine.joint_count();
  RigidBodies fixed(machine, {}, 700.0), hanging(machine, {1.2, 0.02, 10.0}, 700.0);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n + 2), still = Eigen::VectorXd::Zero(n + 2);
  y.head(n) = some_positions(machine, 0.9);
  fixed.update(y.data(), still.data());
  hanging.update(y.data(), still.data());
  EXPECT_LT((fixed.bias() - hanging.bias().head(n)).norm(), 1e-9 * fixed.bias().norm());
  EXPECT_LT(hanging.bias().tail(2).norm(), 1e-9 * fixed.bias().norm());
}

TEST(PlantBodies, ARopeThatIsNearlyHorizontalIsAnErrorAndNotAWrongNumber) {
  const Machine machine = bundled("loader_crane");
  RigidBodies bodies(machine, {1.0, 0.0, 10.0}, 100.0);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(5), yd = Eigen::VectorXd::Zero(5);
  y[4] = 1.55;
  EXPECT_THROW(bodies.update(y.data(), yd.data()), std::domain_error);
}

}  // namespace
}  // namespace sparflow::plant
