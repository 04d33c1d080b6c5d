// Bounds at a given time and of the time itself: the inequality behind them, closed forms, and motions that keep all limits.
#include "optimizer/energy_bound_time.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "models/machine_file.h"
#include "optimizer/energy_grid.h"
#include "optimizer/exact_energy.h"
#include "problems/bundled.h"
#include "problems/motion_limits.h"
#include "problems/problem_file.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

struct TimedCase {
  MotionProblem problem;
  CraneModel model;
  explicit TimedCase(const std::string& reach)
      : problem(load_problem(bundled_file("reaches/" + reach + ".yaml"))),
        model(test_support::synthetic_model(problem.machine)) {
    problem.obstacles.clear();
    problem.tip_line.reset();
  }
};

TimedBoundOptions quick_bound() {
  TimedBoundOptions options;
  options.nodes = 15000;
  options.search_nodes = 1500;
  options.evaluations = 25;
  return options;
}

TEST(TimedBound, NoAdmissibleSpeedGainsMoreThanItSays) {
  for (const char* reach : {"loader_crane_lift", "swing_crane_load", "excavator_dump"}) {
    const TimedCase c(reach);
    const int n = c.model.machine.joint_count();
    const Lattice coarse =
        bound_lattice(c.problem, std::vector<int>(static_cast<std::size_t>(n), 6));
    TimedWeights weights(c.model, c.problem, c.model.machine,
                         lattice_forces(c.model.machine, coarse, c.problem.payload).range);
    ASSERT_TRUE(weights.possible());
    MoveWeights plain(c.model, c.problem, c.model.machine,
                      lattice_forces(c.model.machine, coarse, c.problem.payload).range);
    TimeShares shares;
    shares.share = Eigen::MatrixX2d::Ones(n, 2);
    weights.set_shares(shares);
    LimitRatios ratios(c.problem);
    Chain chain(c.model);
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    double nearest = 0.0;
    for (int i = 0; i < 400; ++i) {
      VectorXd q(n), p(n);
      Eigen::MatrixX2d price;
      for (int j = 0; j < n; ++j) {
        const Range& r = c.problem.limits.position[static_cast<std::size_t>(j)];
        q[j] = r.lo + (r.hi - r.lo) * unit(random);
      }
      // slopes around the prices of moving alone, so that who should move is not obvious
      plain.at(q, price);
      for (int j = 0; j < n; ++j) {
        const int direction = unit(random) < 0.5 ? 0 : 1;
        p[j] = (direction == 0 ? 1.0 : -1.0) * price(j, direction) * (0.6 + 1.4 * unit(random));
      }
      const double said = weights.largest_gain(q, p);
      for (int k = 0; k < 60; ++k) {
        VectorXd v(n);
        for (int j = 0; j < n; ++j) {
          const Range& r = c.problem.limits.velocity[static_cast<std::size_t>(j)];
          v[j] = unit(random) < 0.4 ? 0.0 : (p[j] > 0.0 ? r.hi : r.lo) * (0.2 + 0.8 * unit(random));
        }
        const double ratio = ratios.speed(q, v, nullptr);
        if (ratio > 1.0) v /= ratio;
        const double gain = p.dot(v) - chain.evaluate(q.data(), v.data(), c.problem.payload).power;
        ASSERT_LE(gain, said * (1.0 + 1e-9) + 1e-6) << reach;
        if (said > 100.0) nearest = std::max(nearest, gain / said);
      }
    }
    EXPECT_GT(nearest, 0.9) << reach << ": the largest gain is nearly met";
  }
}

TEST(TimedBound, OneSledTakesDistanceOverSpeedAndARamp) {
  const Machine machine = parse_machine(
      "name: sled\njoints:\n"
      "  - {name: far, type: prismatic, parent: base, axis: [1, 0, 0], position: [0, 2], "
      "velocity: [-0.2, 0.2], acceleration: [-0.5, 0.5]}\n"
      "tip: {joint: far, xyz: [0, 0, 1]}\nlinks:\n"
      "  - {name: sled, joint: far, mass: 100, cog: [0, 0, 0], inertia: 0}\n"
      "cylinders:\n  - {name: far, joint: far, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
      "pumps:\n  - {name: main, feeds: [far], max_flow_lpm: 300, max_pressure_bar: 300, "
      "standby_bar: 20}\n",
      "sled", ".");
  MotionProblem problem;
  problem.machine = machine;
  problem.limits = limits_of(machine);
  problem.start = VectorXd::Zero(1);
  problem.goal = JointGoal{VectorXd::Constant(1, 1.0)};
  CraneModel model = CraneModel::untrained(machine);
  GpParameters p;
  p.mean_constant = 80e5;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
  model.cylinders[0].extend = model.cylinders[0].retract = GaussianProcess(p);
  const TimedBound time = least_duration(model, problem, quick_bound());
  ASSERT_TRUE(time.valid) << time.message;
  const double exact = 1.0 / 0.2 + 0.2 / 0.5;
  EXPECT_LE(time.value, exact);
  EXPECT_NEAR(time.value, exact, 0.01 * exact);  // 2 % of the ramp is kept back
  const double energy = 80e5 * machine.cylinders[0].area_piston();
  for (const double duration : {1.02 * exact, 2.0 * exact}) {
    const TimedBound bound = energy_bound_at(model, problem, duration, quick_bound());
    ASSERT_TRUE(bound.valid);
    EXPECT_LE(bound.value, energy * (1.0 + 1e-9));
    EXPECT_GE(bound.value, 0.999 * energy);
  }
}

TEST(TimedBound, IsBelowEveryMotionFoundAndAboveNothingLess) {
  for (const char* reach : {"loader_crane_lift", "loader_crane_lower"}) {
    const TimedCase c(reach);
    EnergyGrid grid(c.model, c.problem, {12000, 4});
    const GridPath fast = grid.cheapest_path(1e5);
    ASSERT_TRUE(fast.found);
    const TimedBound time = least_duration(c.model, c.problem, quick_bound());
    ASSERT_TRUE(time.valid) << time.message;
    EXPECT_LE(time.value, fast.duration_s) << reach;
    EXPECT_GE(time.value, 0.6 * fast.duration_s) << reach;
    const EnergyBound unlimited = energy_bound(c.model, c.problem, {15000, 4, 2e-4});
    for (const double share : {1.0, 1.3, 3.0}) {
      const double duration = share * fast.duration_s;
      const GridPath path = grid.path_for_duration(duration);
      const TimedBound bound = energy_bound_at(c.model, c.problem, duration, quick_bound());
      ASSERT_TRUE(bound.valid) << bound.message;
      EXPECT_GE(bound.value, 0.999 * unlimited.lower_bound_J);
      if (!path.found || path.duration_s > duration * (1.0 + 1e-9)) continue;
      const double energy =
          exact_energy(c.model, timed_grid_path(c.model, c.problem, path, duration),
                       c.problem.payload)
              .total;
      EXPECT_LE(bound.value, energy * (1.0 + 1e-3)) << reach << " at " << duration;
    }
  }
}

}  // namespace
}  // namespace sparflow
