// The estimated bound lies below closed forms and random motions; its inequality and its goal search are sampled.
#include "optimizer/bounds/energy_bound.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "models/effects/effective_machine.h"
#include "models/files/machine_file.h"
#include "models/machine/linkage.h"
#include "optimizer/bounds/energy_bound_goal.h"
#include "optimizer/bounds/energy_bound_potential.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/energy_grid.h"
#include "optimizer/grid/energy_grid_timing.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "tests/optimizer/applied_effects.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct BoundCase {
  MotionProblem problem;
  CraneModel model;
  explicit BoundCase(const std::string& reach)
      : problem(load_problem(bundled_file("reaches/" + reach + ".yaml"))),
        model(test_support::synthetic_model(problem.machine)) {
    problem.obstacles.clear();
    problem.tip_line.reset();
  }

  EnergyPotential potential(MoveWeights& weights, int cells) const {
    const Lattice grid = lattice(cells);
    return EnergyPotential(model.machine, problem, weights, grid,
                           lattice_forces(model.machine, grid, problem.payload));
  }
  Lattice lattice(int cells) const {
    std::vector<VectorXd> lines;
    for (Eigen::Index j = 0; j < problem.start.size(); ++j) {
      lines.push_back(axis_lines(problem.limits.position[static_cast<std::size_t>(j)],
                                 {problem.start[j]}, cells));
    }
    return Lattice(lines);
  }
  MoveWeights weights() const {
    return MoveWeights(model, problem, model.machine,
                       lattice_forces(model.machine, lattice(8), problem.payload).range);
  }
  VectorXd random_posture(std::mt19937_64& random) const {
    std::uniform_real_distribution<double> share(0.0, 1.0);
    VectorXd q(problem.start.size());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
      q[j] = r.lo + (r.hi - r.lo) * share(random);
    }
    return q;
  }
};

TEST(EnergyBound, IsPressureTimesVolumeAtConstantPressure) {
  BoundCase c("hmf_reach");
  std::mt19937_64 random(3);
  for (int i = 0; i < 5; ++i) {
    const VectorXd end = c.random_posture(random);
    c.problem.goal = JointGoal{end};
    const EnergyBound bound = energy_bound(c.model, c.problem, {4000, 4, 2e-4});
    ASSERT_TRUE(bound.valid) << bound.message;
    double exact = 0.0;
    for (int k = 0; k < 2; ++k) {
      const double dx = cylinder_length(c.problem.machine, k, end[k]) -
                        cylinder_length(c.problem.machine, k, c.problem.start[k]);
      const Cylinder& cylinder = c.problem.machine.cylinders[static_cast<std::size_t>(k)];
      exact += c.model.pumps[0].standby * std::abs(dx) *
               (dx > 0.0 ? cylinder.area_piston() : cylinder.area_rod());
    }
    EXPECT_LE(bound.lower_bound_J, exact * (1.0 + 1e-9));
    // Only the rounding of single precision and the different areas of both directions make it loose.
    EXPECT_NEAR(bound.lower_bound_J, exact, 2e-5 * exact);
  }
}

/// Two sleds on one rail with constant demands: in the optimum the cheaper one moves as far as it can.
TEST(EnergyBound, IsExactWhenTheDemandsAreConstant) {
  const Machine machine = parse_machine(
      "name: rails\njoints:\n"
      "  - {name: far, type: prismatic, parent: base, axis: [1, 0, 0], position: [0, 2], "
      "velocity: [-1, 1], acceleration: [-1, 1]}\n"
      "  - {name: near, type: prismatic, parent: far, axis: [1, 0, 0], position: [0, 0.5], "
      "velocity: [-1, 1], acceleration: [-1, 1]}\n"
      "tip: {joint: near, xyz: [0, 0, 1]}\nlinks:\n"
      "  - {name: sled, joint: far, mass: 100, cog: [0, 0, 0], inertia: 0}\n"
      "cylinders:\n  - {name: far, joint: far, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
      "  - {name: near, joint: near, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
      "pumps:\n  - {name: main, feeds: [far, near], max_flow_lpm: 300, max_pressure_bar: 300, "
      "standby_bar: 20}\n",
      "rails", ".");
  MotionProblem problem;
  problem.machine = machine;
  problem.limits = limits_of(machine);
  problem.start = Eigen::Vector2d(0.0, 0.0);
  problem.goal = TipGoal{{1.0, 0.0, 1.0}};
  CraneModel model = CraneModel::untrained(machine);
  const double pressure[2] = {100e5, 10e5};  // the second is below standby
  for (std::size_t i = 0; i < 2; ++i) {
    GpParameters p;
    p.mean_constant = pressure[i];
    p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
    model.cylinders[i].extend = model.cylinders[i].retract = GaussianProcess(p);
  }
  const double area = machine.cylinders[0].area_piston();
  const double exact = area * (0.5 * 20e5 + 0.5 * 100e5);
  const EnergyBound bound = energy_bound(model, problem, {500, 4, 1e-4});
  ASSERT_TRUE(bound.valid) << bound.message;
  EXPECT_LE(bound.lower_bound_J, exact * (1.0 + 1e-9));
  // the goal may be missed by 1e-5 m, and the search over it stops at 1e-4
  EXPECT_NEAR(bound.lower_bound_J, exact, 3e-4 * exact);
  EXPECT_NEAR(bound.end[1], 0.5, 3e-3);
}

TEST(EnergyBound, NoRandomMotionCostsLess) {
  for (const char* reach :
       {"loader_crane_lift", "hmf_reach", "swing_crane_load", "excavator_dump"}) {
    const BoundCase c(reach);
    MoveWeights weights = c.weights();
    const int n = c.model.machine.joint_count();
    const EnergyPotential potential = c.potential(weights, n <= 3 ? 24 : 10);
    std::mt19937_64 random(11);
    std::uniform_int_distribution<int> legs(1, 4);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    double tightest = 1e9;
    for (int trial = 0; trial < 60; ++trial) {
      MatrixXd corners(legs(random) + 1, n);
      corners.row(0) = c.problem.start.transpose();
      for (Eigen::Index k = 1; k < corners.rows(); ++k) {
        corners.row(k) = c.random_posture(random).transpose();
        for (Eigen::Index j = 0; j < n;
             ++j) {  // mostly few joints move: such motions come near the bound
          if (unit(random) < 0.6) corners(k, j) = corners(k - 1, j);
        }
      }
      GridPath path;
      path.found = true;
      path.corners = corners;
      path.leg_durations = shortest_leg_durations(c.model, c.problem, corners);
      const Trajectory motion = timed_grid_path(
          c.model, c.problem, path, path.leg_durations.sum() * (1.0 + 5.0 * unit(random)));
      const double energy = exact_energy(c.model, motion, c.problem.payload, 32).total;
      const double bound = potential.value(corners.bottomRows(1).transpose());
      // 1e-3 is the error of the midpoint rule of the exact energy on whole ramps.
      EXPECT_LE(bound, energy * (1.0 + 1e-3) + 1.0) << reach << ", trial " << trial;
      if (bound > 0.0) tightest = std::min(tightest, energy / bound);
    }
    EXPECT_LT(tightest, 1.25) << reach << ": the bound is not trivial";
  }
}

TEST(EnergyBound, CornersOfABoxHaveTheValuesOfTheirPostures) {
  const BoundCase c("excavator_dump");
  MoveWeights weights = c.weights();
  const EnergyPotential potential = c.potential(weights, 9);
  const auto& lines = potential.lattice().lines;
  const auto n = static_cast<Eigen::Index>(lines.size());
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<double> values;
  for (int i = 0; i < 200; ++i) {
    VectorXd lo(n), hi(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const VectorXd& l = lines[static_cast<std::size_t>(j)];
      const auto cell = static_cast<Eigen::Index>(unit(random) * static_cast<double>(l.size() - 1));
      const double a = unit(random), b = unit(random), width = l[cell + 1] - l[cell];
      lo[j] = l[cell] + (i % 3 == 0 ? 0.0 : std::min(a, b)) * width;  // also whole cells
      hi[j] = l[cell] + (i % 3 == 0 ? 1.0 : std::max(a, b)) * width;
    }
    potential.corner_values(lo, hi, values);
    ASSERT_EQ(values.size(), std::size_t{1} << n);
    for (std::size_t k = 0; k < values.size(); ++k) {
      VectorXd corner = lo;
      for (Eigen::Index j = 0; j < n; ++j) {
        if (k >> j & 1u) corner[j] = hi[j];
      }
      EXPECT_NEAR(values[k], potential.value(corner), 1e-9 * potential.value(corner) + 1e-6);
    }
  }
}

TEST(EnergyBound, SlopesStayBelowThePricesAtRandomPostures) {
  for (const char* reach : {"loader_crane_lift", "hmf_reach", "excavator_dump"}) {
    const BoundCase c(reach);
    MoveWeights weights = c.weights();
    const int n = c.model.machine.joint_count();
    const EnergyPotential potential = c.potential(weights, n <= 3 ? 30 : 12);
    std::mt19937_64 random(5);
    Eigen::MatrixX2d price;
    for (int i = 0; i < 4000; ++i) {
      const VectorXd q = c.random_posture(random);
      const VectorXd slope = potential.gradient(q);
      weights.at(q, price);
      for (Eigen::Index j = 0; j < n; ++j) {
        const double most = slope[j] > 0.0 ? price(j, 0) : price(j, 1);
        ASSERT_LE(std::abs(slope[j]), most * (1.0 + 1e-3) + 1e-6)
            << reach << ", joint " << j << " at " << q.transpose();
      }
      // The gradient agrees with differences of the value.
      VectorXd shifted = q;
      shifted[i % n] += 1e-7;
      const double difference = (potential.value(shifted) - potential.value(q)) / 1e-7;
      const double scale = std::max(price(i % n, 0), price(i % n, 1));
      EXPECT_NEAR(slope[i % n], difference, 0.02 * scale + 1.0);  // a kink may lie between
    }
  }
}

TEST(EnergyBound, PricesAreTheLeastOfSingleMoves) {
  const BoundCase c("loader_crane_lift");
  MoveWeights weights = c.weights();
  Chain chain(c.model);
  std::mt19937_64 random(8);
  Eigen::MatrixX2d price;
  for (int i = 0; i < 60; ++i) {
    const VectorXd q = c.random_posture(random);
    weights.at(q, price);
    for (int j = 0; j < 3; ++j) {
      for (const int direction : {0, 1}) {
        double least = 1e30;
        for (double share = 0.002; share <= 1.0; share *= 1.05) {
          const Range& v = c.problem.limits.velocity[static_cast<std::size_t>(j)];
          VectorXd qd = VectorXd::Zero(3);
          qd[j] = share * (direction == 0 ? v.hi : v.lo);
          const double power =
              chain.evaluate({q.data(), qd.data()}, c.problem.payload).power / std::abs(qd[j]);
          least = std::min(least, power);
        }
        EXPECT_LE(price(j, direction), least * (1.0 + 1e-9));
        // 1 % covers the allowance of the table and the sampling of speeds.
        EXPECT_GE(price(j, direction), least * 0.99);
      }
    }
  }
}

TEST(EnergyBound, IsWithinThreePercentOfTheGridsPathOnTheBundledReaches) {
  for (const char* reach :
       {"loader_crane_lift", "loader_crane_unfold", "loader_crane_lower", "hmf_reach"}) {
    const BoundCase c(reach);
    EnergyGrid grid(c.model, c.problem);
    const GridPath path = grid.cheapest_path(0.0);
    const EnergyBound bound = energy_bound(c.model, c.problem, {100000, 4, 2e-4});
    ASSERT_TRUE(bound.valid && path.found) << reach;
    EXPECT_LE(bound.lower_bound_J, path.slow_energy_J) << reach;
    EXPECT_GE(bound.lower_bound_J, 0.97 * path.slow_energy_J) << reach;
    EXPECT_GE(bound.checked_scale, 0.99) << reach;
  }
}

TEST(EnergyBound, LeastOnTheGoalIsBelowEveryPostureThere) {
  const BoundCase c("loader_crane_lift");
  MoveWeights weights = c.weights();
  const EnergyPotential potential = c.potential(weights, 20);
  const LeastOnGoal least = least_on_goal(c.problem, c.model.machine, potential, {1e-4});
  ASSERT_TRUE(least.reachable);
  std::mt19937_64 random(21);
  double sampled = 1e30;
  for (int i = 0; i < 3000; ++i) {
    VectorXd q = c.random_posture(random);
    if (!solve_end_posture(c.model.machine, c.problem.limits, std::get<TipGoal>(c.problem.goal).tip,
                           {true, true, true}, q)) {
      continue;
    }
    sampled = std::min(sampled, potential.value(q));
  }
  EXPECT_LE(least.lower, sampled * (1.0 + 1e-6));
  EXPECT_GE(least.lower,
            sampled * (1.0 - 5e-3));  // samples are some millimetres apart on the goal's curve
}

TEST(EnergyBound, ACappedSearchOnTheGoalSaysSoAndKeepsWhatWasShown) {
  const BoundCase c("loader_crane_lift");
  MoveWeights weights = c.weights();
  const EnergyPotential potential = c.potential(weights, 20);
  const LeastOnGoal whole = least_on_goal(c.problem, c.model.machine, potential, {1e-4});
  ASSERT_FALSE(whole.capped);
  double before = 0.0;
  for (const long cuts : {1L, 20L, 100L}) {
    const LeastOnGoal least =
        least_on_goal(c.problem, c.model.machine, potential, {1e-4, 2e-3, cuts});
    EXPECT_TRUE(least.capped) << cuts;
    EXPECT_TRUE(least.reachable);
    EXPECT_GE(least.lower, before) << "what fewer cuts show stays shown";
    EXPECT_LE(least.lower, whole.lower);
    before = least.lower;
  }
  EXPECT_GT(before, 0.5 * whole.lower);
  EnergyBoundOptions few;
  few.nodes = 20000;
  few.most_goal_cuts = 3;
  const EnergyBound bound = energy_bound(c.model, c.problem, few);
  EXPECT_TRUE(bound.valid && bound.capped);
  EXPECT_GT(bound.lower_bound_J, 0.0);
  EXPECT_THAT(bound.message, ::testing::HasSubstr("ended at 3 boxes"));
}

TEST(EnergyBound, SaysWhenThereIsNone) {
  BoundCase c("loader_crane_lift");
  EXPECT_THAT(energy_bound(c.model, c.problem, {1000, 2, 1e-3}).message,
              ::testing::HasSubstr("too many nodes"));
  BoundCase effect("loader_crane_lift");
  effect.model.effects = {test_support::applied("coulomb_friction:boom", effect.model.machine)};
  const EnergyBound none = energy_bound(effect.model, effect.problem);
  EXPECT_FALSE(none.valid);
  EXPECT_THAT(none.message, ::testing::HasSubstr("coulomb_friction:boom"));
  c.problem.goal = TipGoal{{30.0, 0.0, 3.0}};
  EXPECT_FALSE(energy_bound(c.model, c.problem, {1000, 4, 1e-3}).valid);
}

}  // namespace
}  // namespace sparflow
