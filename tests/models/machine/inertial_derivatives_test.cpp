/// Derivatives of inertial torques in closed form beside dual numbers through the Newton-Euler recursion.
#include "models/machine/inertial_derivatives.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/machine/inertial_torque.h"
#include "tests/models/effects/effects_support.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using JetVector = Eigen::Matrix<Jet, Eigen::Dynamic, 1>;

std::vector<Jet> part_of(const std::vector<Jet>& x, int first, int count) {
  return {x.begin() + first, x.begin() + first + count};
}

/// Largest difference of values, gradients and Hessians, relative to the largest entry of each.
double difference(const std::vector<Jet>& x, const JetVector& y, int variables) {
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto compare = [&](double a, double b) {
      error = std::max(error, std::abs(a - b));
      size = std::max(size, std::abs(b));
    };
    const Jet& other = y[static_cast<Eigen::Index>(i)];
    compare(x[i].value, other.value);
    for (int k = 0; k < variables; ++k) {
      compare(x[i].gradient(k), other.gradient(k));
      for (int l = 0; l <= k; ++l) compare(x[i].hessian(k, l), other.hessian(k, l));
    }
  }
  return error / size;
}

JetVector by_recursion(const Machine& machine, const std::vector<Jet>& x, double payload) {
  const int n = machine.joint_count();
  JetVector q(n), qd(n), qdd(n);
  for (int j = 0; j < n; ++j) {
    q[j] = x[static_cast<std::size_t>(j)];
    qd[j] = x[static_cast<std::size_t>(n + j)];
    qdd[j] = x[static_cast<std::size_t>(2 * n + j)];
  }
  return inertial_torque<Jet>(machine, q, qd, qdd, payload);
}

/// Telescopes that slide with a stage, four-bars, masses of rods and inertias; variables in any order, some of them constant.
TEST(InertialDerivatives, AreThoseOfTheRecursion) {
  test_support::Random random(11);
  for (Machine machine : test_support::effect_machines()) {
    SCOPED_TRACE(machine.name);
    double inertia = 40.0;
    for (Link& link : machine.links) link.inertia = inertia += 25.0;
    machine.tip.payload_scale = 0.9;
    const int n = machine.joint_count();
    for (const int constant : {0, n, 2 * n}) {  // accelerations and rates that are no variables
      const VectorXd state = test_support::usable_state(machine, random);
      const int variables = 3 * n - constant;
      std::vector<Jet> x;
      for (int i = 0; i < 3 * n; ++i)
        x.push_back(i < variables ? Jet::variable(state[i], variables - 1 - i, variables)
                                  : Jet(state[i]));
      const std::vector<Jet> torque = inertial_torque_of_variables(
          machine, part_of(x, 0, n), part_of(x, n, n), part_of(x, 2 * n, n), 350.0);
      ASSERT_EQ(torque.size(), static_cast<std::size_t>(n));
      // the same arithmetic in another order, with third and fourth derivatives of linkages
      EXPECT_LT(difference(torque, by_recursion(machine, x, 350.0), variables), 1e-11);
    }
  }
}

TEST(InertialDerivatives, OtherFunctionsOfTheVariablesAreLeftToTheRecursion) {
  const Machine machine = test_support::loader_crane();
  const int n = machine.joint_count();
  test_support::Random random(12);
  const VectorXd state = test_support::usable_state(machine, random);
  std::vector<Jet> x;
  for (int i = 0; i < 3 * n; ++i) x.push_back(Jet::variable(state[i], i, 3 * n));
  const auto torque = [&] {
    return inertial_torque_of_variables(machine, part_of(x, 0, n), part_of(x, n, n),
                                        part_of(x, 2 * n, n), 350.0);
  };
  EXPECT_FALSE(torque().empty());
  const Jet usual = x[1];
  x[1] = sin(usual);
  EXPECT_TRUE(torque().empty());
  x[1] = x[0];  // two of one variable
  EXPECT_TRUE(torque().empty());
  x[1] = 2.0 * usual;
  EXPECT_TRUE(torque().empty());
}

}  // namespace
}  // namespace sparflow
