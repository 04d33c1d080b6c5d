/// The simulator's forces against models/machine/static_force, which shares no code with them, and against energy.
#include "simulator/hidden_effects/body_forces.h"

#include <random>

#include "models/machine/static_force.h"
#include "tests/simulator/hidden_log_support.h"

namespace sparflow::simulator {
namespace {

class BodyForcesOf : public ::testing::TestWithParam<const char*> {};

TEST_P(BodyForcesOf, GravityAgreesWithVirtualWork) {
  const Machine machine = machine_named(GetParam());
  BodyForces bodies(machine);
  StaticForce statics(machine);
  JointLoads loads;
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<double> q;
    for (const Joint& j : machine.joints)
      q.push_back(std::uniform_real_distribution(j.position.lo, j.position.hi)(random));
    statics.update(q.data(), 640.0, 0);
    bodies.gravity(q.data(), 640.0, loads);
    for (std::size_t k = 0; k < q.size(); ++k) {
      const double exact = statics.torque()[static_cast<Eigen::Index>(k)];
      // Numeric differentiation with step 1e-4: truncation of 2e-9 of the largest load, 1e5 N m.
      EXPECT_NEAR(loads.gravity[k], exact, 1e-3 + 1e-8 * std::abs(exact)) << machine.joints[k].name;
    }
  }
}

TEST_P(BodyForcesOf, WorkOfAllLoadsIsTheChangeOfEnergy) {
  const Machine machine = machine_named(GetParam());
  BodyForces bodies(machine);
  const std::size_t n = machine.joints.size();
  std::vector<double> q(n), qd(n), qdd(n);
  // A smooth motion about mid-range at working speed.
  const auto at = [&](double t) {
    for (std::size_t k = 0; k < n; ++k) {
      const Joint& j = machine.joints[k];
      const double mid = 0.5 * (j.position.lo + j.position.hi);
      const double w = 0.7 + 0.2 * static_cast<double>(k), a = 0.8 * j.velocity.hi / w;
      q[k] = mid + a * std::sin(w * t);
      qd[k] = a * w * std::cos(w * t);
      qdd[k] = -a * w * w * std::sin(w * t);
    }
  };
  JointLoads loads;
  const auto power = [&](double t) {
    at(t);
    bodies.dynamic(q.data(), qd.data(), qdd.data(), 640.0, loads);
    double p = 0.0;
    for (std::size_t k = 0; k < n; ++k) p += (loads.gravity[k] + loads.inertia[k]) * qd[k];
    return p;
  };
  const auto energy = [&](double t) {
    at(t);
    return bodies.kinetic_energy(q.data(), qd.data(), 640.0) +
           bodies.potential_energy(q.data(), 640.0);
  };
  constexpr int kSteps = 400;
  constexpr double kEnd = 3.0, h = kEnd / kSteps;
  double work = 0.0, turnover = 0.0;
  for (int i = 0; i < kSteps; ++i) {  // Simpson
    const double t = i * h;
    const double piece = h / 6.0 * (power(t) + 4.0 * power(t + 0.5 * h) + power(t + h));
    work += piece;
    turnover += std::abs(piece);
  }
  // Simpson's rule at 7.5 ms errs by less than 1e-8 of the work; differences in dynamic() by 1e-6.
  EXPECT_NEAR(work, energy(kEnd) - energy(0.0), 1e-5 * turnover + 1e-6);
  EXPECT_GT(turnover, 1e-3);
}

TEST_P(BodyForcesOf, InertiaIsQuadraticInSpeed) {
  const Machine machine = machine_named(GetParam());
  BodyForces bodies(machine);
  const std::size_t n = machine.joints.size();
  std::vector<double> q(n), qd(n), zero(n, 0.0), twice(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Joint& j = machine.joints[k];
    q[k] = 0.4 * j.position.lo + 0.6 * j.position.hi;
    qd[k] = j.velocity.hi;
    twice[k] = 2.0 * qd[k];
  }
  JointLoads slow, fast;
  bodies.dynamic(q.data(), qd.data(), zero.data(), 640.0, slow);
  bodies.dynamic(q.data(), twice.data(), zero.data(), 640.0, fast);
  for (std::size_t k = 0; k < n; ++k)
    // Differences over 1 ms: relative error 1e-6 of forces up to 1e4 N.
    EXPECT_NEAR(fast.inertia[k], 4.0 * slow.inertia[k], 0.1 + 1e-4 * std::abs(fast.inertia[k]));
}

INSTANTIATE_TEST_SUITE_P(Machines, BodyForcesOf,
                         ::testing::Values("loader_crane", "hmf_2020_k4", "swing_crane_two_pumps",
                                           "excavator", "emps"),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace sparflow::simulator
