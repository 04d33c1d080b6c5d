// Estimated bounds at a given duration and of the duration itself: their inequality, closed forms, and feasible motions.
#include "optimizer/bounds/energy_bound_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "optimizer/bounds/energy_bound.h"
#include "optimizer/bounds/energy_bound_time_guide.h"
#include "optimizer/bounds/energy_bound_time_weights.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/energy_grid.h"
#include "problems/bundled.h"
#include "problems/motion_limits.h"
#include "problems/problem_file.h"
#include "tests/optimizer/synthetic_model.h"
#include "tests/parsed_json.h"

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
  options.evaluations = 40;
  return options;
}

TEST(TimedBound, NoAdmissibleSpeedExceedsTheMaximisedHamiltonian) {
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
      // Slopes are near the prices of moving alone, so that the best set of joints is not obvious.
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
        const double gain =
            p.dot(v) - chain.evaluate({q.data(), v.data()}, c.problem.payload).power;
        ASSERT_LE(gain, said * (1.0 + 1e-9) + 1e-6) << reach;
        if (said > 100.0) nearest = std::max(nearest, gain / said);
      }
    }
    EXPECT_GT(nearest, 0.9) << reach << ": random speeds come near the maximum";
  }
}

TEST(MaximisedHamiltonian, AgreesWithAFineScanOfPressures) {
  // Most top flows lie between two knots of the demand, where the flow stops growing with the pressure.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  MaximisedHamiltonian largest;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<TimedMove> moves(3);
    for (std::size_t i = 0; i < moves.size(); ++i) {
      TimedMove& m = moves[i];
      m.joint = static_cast<int>(i);
      m.pump = 0;
      m.area = 0.01;
      m.standby = 22e5;
      m.flow_step = 1e-4;
      m.top = m.flow_step * (2.0 + 7.9 * unit(random));
      m.slope = (60.0 + 60.0 * unit(random)) * 1e5;
      double pressure = (40.0 + 30.0 * unit(random)) * 1e5;
      const double rise = 3e5 * unit(random);
      for (double& p : m.demand) p = pressure += rise * unit(random);
    }
    const std::vector<double> pump = {1.2e-3};
    double best = 0.0;
    for (double pressure = 22e5; pressure < 120e5; pressure += 0.05e5) {
      std::vector<TimedMove> order = moves;
      std::sort(order.begin(), order.end(),
                [](const TimedMove& a, const TimedMove& b) { return a.slope > b.slope; });
      double left = pump[0], gain = 0.0, growth = 0.0;
      for (const TimedMove& m : order) {
        if (!(m.slope > pressure)) break;
        std::size_t knot = 0;
        const double flow = std::min(left, m.flow(pressure, &growth, &knot));
        gain += (m.slope - pressure) * flow;
        left -= flow;
      }
      best = std::max(best, gain);
    }
    const double said = largest.of(moves, pump);
    EXPECT_GE(said, best * (1.0 - 1e-9)) << trial;
    EXPECT_LE(said, 1.01 * best + 1.0) << trial;  // a scan in steps of 0.05 bar misses that much
  }
}

TEST(TimedBound, NoCornerOfABoxExceedsThePriceForAnyShares) {
  const TimedCase c("loader_crane_lift");
  constexpr int kJoints = 3;
  const Lattice lattice = bound_lattice(c.problem, std::vector<int>(kJoints, 6));
  const LatticeForces forces = lattice_forces(c.model.machine, lattice, c.problem.payload);
  TimedWeights weights(c.model, c.problem, c.model.machine, forces.range);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  TimeShares shares;
  shares.price = 2000.0;
  shares.share = Eigen::MatrixX2d::Ones(kJoints, 2);
  double least = shares.price;
  for (int trial = 0; trial < 40; ++trial) {
    shares.tilt =
        Eigen::MatrixXd::NullaryExpr(2 * kJoints, kJoints, [&] { return 3.0 * unit(random); });
    weights.set_shares(shares);
    VectorXd q(kJoints);
    for (int j = 0; j < kJoints; ++j) {
      const Range& r = c.problem.limits.position[static_cast<std::size_t>(j)];
      q[j] = r.lo + (r.hi - r.lo) * (0.5 + 0.5 * unit(random));
    }
    Eigen::MatrixX2d price;
    weights.at(q, price);
    double most = 0.0;  // reaches the price at one of the corners
    for (unsigned corner = 0; corner < 1u << kJoints; ++corner) {
      VectorXd p(kJoints);
      for (int j = 0; j < kJoints; ++j) {
        p[j] = (corner >> j & 1u) != 0 ? price(j, 0) : -price(j, 1);
      }
      most = std::max(most, weights.largest_gain(q, p));
    }
    EXPECT_LE(most, shares.price * (1.0 + kPriceTolerance + 1e-6)) << trial;
    least = std::min(least, most);
  }
  EXPECT_GT(least, 0.99 * shares.price);
}

TEST(TimedBound, RampGainAgreesWithSpeedsThatGrowFromRest) {
  const TimedCase c("loader_crane_lift");
  constexpr int kJoints = 3;
  const Lattice lattice = bound_lattice(c.problem, std::vector<int>(kJoints, 6));
  const LatticeForces forces = lattice_forces(c.model.machine, lattice, c.problem.payload);
  TimedWeights weights(c.model, c.problem, c.model.machine, forces.range);
  TimeShares shares;
  shares.price = 3000.0;
  shares.share = Eigen::MatrixX2d::Ones(kJoints, 2);
  std::vector<double> force(forces.length.size()), rate(forces.length.size());
  MaximisedHamiltonian largest;
  for (long node = 0; node < lattice.nodes; node += 7) {
    weights.set_shares(shares);
    forces.at(c.model.machine, lattice, node, force.data(), rate.data());
    const VectorXd q = lattice.posture(node);
    Eigen::MatrixX2d price(kJoints, 2);
    weights.prices(q.data(), force.data(), rate.data(), price);
    constexpr double kTime = 1e-4;  // so short that flows and the demands they add are negligible
    std::vector<TimedMove> moves;
    moves.reserve(2 * kJoints);
    for (int j = 0; j < kJoints; ++j) {
      for (const int direction : {0, 1}) {
        TimedMove m = weights.move_of(j, direction, force.data(), rate.data());
        m.slope = price(j, direction) / m.area;
        const Range& a = c.problem.limits.acceleration[static_cast<std::size_t>(j)];
        m.top = std::min(m.top, m.area * a.hi * kTime);
        moves.push_back(m);
      }
    }
    const double gain = largest.of(moves, weights.pump_flow()) / kTime;
    EXPECT_LE(gain, weights.ramp_gain() * (1.0 + 1e-6)) << node;
    EXPECT_GE(gain, 0.97 * weights.ramp_gain()) << node;
  }
}

TEST(TimedBound, LeastDurationOfOneSledIsDistanceOverSpeedAndARamp) {
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
  EXPECT_NEAR(time.value, exact, 0.01 * exact);  // ramp_gain is raised by 2 %
  const double energy = 80e5 * machine.cylinders[0].area_piston();
  for (const double duration : {1.02 * exact, 2.0 * exact}) {
    const TimedBound bound = energy_bound_at(model, problem, duration, quick_bound());
    ASSERT_TRUE(bound.valid);
    EXPECT_LE(bound.value, energy * (1.0 + 1e-9));
    EXPECT_GE(bound.value, 0.999 * energy);
  }
}

TEST(TimedBound, LeastDurationOfOnePinnedJointIsAngleOverSpeedAndARamp) {
  // The price of time is the same at every angle, so only the curvature of the cylinder's length over the angle matters.
  MotionProblem problem;
  problem.machine = parse_machine(
      "name: mast\njoints:\n"
      "  - {name: boom, type: revolute, parent: base, origin: {xyz: [0, 0, 2]}, axis: [0, -1, 0], "
      "position: [-0.8, 0.9], velocity: [-0.05, 0.05], acceleration: [-0.4, 0.4]}\n"
      "tip: {joint: boom, xyz: [2.5, 0, 0]}\nlinks:\n"
      "  - {name: boom, joint: boom, mass: 400, cog: [1.25, 0, 0], inertia: 200}\n"
      "cylinders:\n  - {name: boom, joint: boom, bore: 0.15, rod: 0.1, linkage: {type: pins, "
      "barrel: {frame: base, xyz: [0.2, 0, 0.8]}, rod: {frame: boom, xyz: [0.5, 0, -0.15]}}}\n"
      "pumps:\n  - {name: main, feeds: [boom], max_flow_lpm: 400, max_pressure_bar: 350, "
      "standby_bar: 20}\n",
      "mast", ".");
  problem.limits = limits_of(problem.machine);
  problem.start = VectorXd::Constant(1, -0.6);
  problem.goal = JointGoal{VectorXd::Constant(1, 0.7)};
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const TimedBound time = least_duration(model, problem, quick_bound());
  ASSERT_TRUE(time.valid) << time.message;
  const double exact = 1.3 / 0.05 + 0.05 / 0.4;
  EXPECT_LE(time.value, exact);
  EXPECT_GE(time.value, 0.99 * exact);
}

TEST(TimedBound, IsBelowEveryMotionFoundAndNotBelowTheUnlimitedBound) {
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

TEST(TimedBound, TheBoundOfEnergyAndIdleTimeIsBelowEveryMotionAndAboveThatOfEnergyAlone) {
  const TimedCase c("loader_crane_lift");
  EnergyGrid grid(c.model, c.problem, {12000, 4});
  const EnergyBound alone = energy_bound(c.model, c.problem, {15000, 4, 2e-4});
  for (const double idle : {500.0, 5e3}) {
    const TimedBound bound = cost_bound(c.model, c.problem, idle, quick_bound());
    ASSERT_TRUE(bound.valid) << bound.message;
    double least = std::numeric_limits<double>::infinity();
    for (const double price : {0.3 * idle, idle, 3.0 * idle, 1e5}) {
      const GridPath path = grid.cheapest_path(price);
      ASSERT_TRUE(path.found);
      for (const double slower : {1.0, 1.3, 1.8}) {
        const double duration = slower * path.duration_s;
        const double energy =
            exact_energy(c.model, timed_grid_path(c.model, c.problem, path, duration),
                         c.problem.payload)
                .total;
        least = std::min(least, energy + idle * duration);
      }
    }
    EXPECT_LE(bound.value, least) << idle;
    EXPECT_GT(bound.value, alone.lower_bound_J) << "time costs something";
    EXPECT_GT(bound.value, 0.8 * least) << "ramps and the grid's steps are not in the bound";
  }
}

TEST(TimedBound, IsNeverBelowTheBoundOfUnlimitedTime) {
  // The price of time is charged for every second. A search of forty steps lowers it as the duration grows (below a
  // milliwatt for an hour); a search of one step leaves it so high that an hour is charged with more than V.
  const TimedCase c("loader_crane_lift");
  TimedBoundOptions options = quick_bound();
  options.evaluations = 1;
  const EnergyBound any = energy_bound(c.model, c.problem, {options.nodes, options.most_joints});
  ASSERT_TRUE(any.valid) << any.message;
  std::vector<double> shares;
  options.progress = [&](double share, const std::string&) { shares.push_back(share); };
  const TimedBound hour = energy_bound_at(c.model, c.problem, 3600.0, options);
  ASSERT_TRUE(hour.valid) << hour.message;
  // The search, its fine grids and the bound of unlimited time are told in this order.
  EXPECT_GE(shares.size(), 6U);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_LT(shares.front(), 0.9);
  EXPECT_DOUBLE_EQ(shares.back(), 1.0);
  EXPECT_EQ(hour.value, any.lower_bound_J);
  EXPECT_EQ(hour.price_W, 0.0);
  EXPECT_EQ(hour.shares.cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(hour.lines, any.lines);
  EXPECT_EQ(hour.checked_scale, any.checked_scale);
}

/// Lift of the bundled crane in a given time, bounded with few nodes.
struct KnownLift {
  CraneModel model = load_model(bundled_file("models/loader_crane.json"));
  MotionProblem problem =
      load_problem(bundled_file("reaches/loader_crane_lift.yaml"), &model.machine);
  double duration = 22.0;  // [s]
  TimedBoundOptions options;
  int evaluations = 0;  // told by the last call of bound()

  KnownLift() {
    options.nodes = 6000;
    options.search_nodes = 1000;
    options.choice_nodes = 3000;
    options.evaluations = 30;
    options.any_duration = 0.0;
  }
  TimedBound bound(std::optional<double> energy) {
    evaluations = 0;
    options.known_energy = energy;
    options.progress = [this](double, const std::string&) { ++evaluations; };
    return energy_bound_at(model, problem, duration, options);
  }
};

TEST(TimedBound, SharesThatChangeWithThePostureAreSearchedUnlessTheMotionIsNearTheBound) {
  KnownLift lift;
  const TimedBound unknown = lift.bound(std::nullopt);
  ASSERT_TRUE(unknown.valid) << unknown.message;
  const int searched = lift.evaluations;
  const TimedBound constant = lift.bound(1.0);  // below any bound, so it is near enough
  ASSERT_TRUE(constant.valid) << constant.message;
  const int skipped = lift.evaluations;
  EXPECT_LT(skipped, searched / 2) << "the search is left out";
  EXPECT_GT(unknown.value, 1.001 * constant.value) << "the search raises the bound of this reach";

  // A motion in this time is not below the larger bound.
  EnergyGrid grid(lift.model, lift.problem, {12000, 4});
  const GridPath path = grid.path_for_duration(lift.duration);
  ASSERT_TRUE(path.found && path.duration_s <= lift.duration);
  EXPECT_LT(unknown.value,
            exact_energy(lift.model, timed_grid_path(lift.model, lift.problem, path, lift.duration),
                         lift.problem.payload)
                .total);

  // A known energy decides at the share near_enough above the bound of constant shares.
  EXPECT_EQ(lift.bound(1.0049 * constant.value).value, constant.value);
  EXPECT_EQ(lift.evaluations, skipped);
  EXPECT_EQ(lift.bound(1.0051 * constant.value).value, unknown.value);
  EXPECT_EQ(lift.evaluations, searched);
  lift.options.near_enough = 2e-3;
  EXPECT_EQ(lift.bound(1.0022 * constant.value).value, unknown.value);
  EXPECT_EQ(lift.evaluations, searched);
  // The bound of any duration counts where it is larger.
  lift.options.any_duration = 1.1 * unknown.value;
  EXPECT_EQ(lift.bound(1.1 * unknown.value).value, 1.1 * unknown.value);
  EXPECT_EQ(lift.evaluations, skipped);
}

TEST(TimedBound, TheKnownEnergyDecidesNothingWhereTimeCostsMuchOrNothing) {
  KnownLift lift;
  int searched = 0;
  for (const double duration : {10.0, 600.0}) {
    lift.duration = duration;
    const TimedBound far = lift.bound(1e9);
    const int evaluations = lift.evaluations;
    EXPECT_EQ(lift.bound(1.0).value, far.value) << duration;
    EXPECT_EQ(lift.evaluations, evaluations) << duration;
    if (duration < 100.0) {
      searched = evaluations;
    } else {
      EXPECT_LT(evaluations, searched / 2) << "no search where time costs next to nothing";
    }
  }
}

/// Sleds on one level rail, one upon the other: there are no loads, so a motion's energy depends on flows only. Ramps are
/// negligibly short.
struct Rail {
  MotionProblem problem;
  CraneModel model;

  explicit Rail(int sleds) {
    std::string joints, links, cylinders, feeds, parent = "base", last;
    for (int k = 0; k < sleds; ++k) {
      const std::string name = "sled" + std::to_string(k);
      joints += "  - {name: " + name + ", type: prismatic, parent: " + parent +
                ", axis: [1, 0, 0], position: [0, 2], velocity: [-0.2, 0.2], "
                "acceleration: [-1000, 1000]}\n";
      links +=
          "  - {name: " + name + ", joint: " + name + ", mass: 100, cog: [0, 0, 0], inertia: 0}\n";
      cylinders += "  - {name: " + name + ", joint: " + name +
                   ", bore: 0.1, rod: 0.05, linkage: {type: direct}}\n";
      feeds += (k == 0 ? "" : ", ") + name;
      parent = last = name;
    }
    problem.machine = parse_machine(
        "name: rail\njoints:\n" + joints + "tip: {joint: " + last + ", xyz: [0, 0, 1]}\nlinks:\n" +
            links + "cylinders:\n" + cylinders + "pumps:\n  - {name: main, feeds: [" + feeds +
            "], max_flow_lpm: 140, max_pressure_bar: 300, standby_bar: 20}\n",
        "rail", ".");
    problem.limits = limits_of(problem.machine);
    problem.start = VectorXd::Zero(sleds);
    model = CraneModel::untrained(problem.machine);
    const double area = problem.machine.cylinders[0].area_piston();
    for (int k = 0; k < sleds; ++k) {  // 40 or 55 bar, rising by half at full flow
      GpParameters p;
      p.mean_constant = (40.0 + 15.0 * k) * 1e5;
      p.signal_std = 10e5;
      p.length_flow = 0.1 * area;
      p.length_force = 1e5;
      p.flow = Eigen::ArrayXd::Constant(1, 0.2 * area);
      p.force = Eigen::ArrayXd::Zero(1);
      p.weight = Eigen::ArrayXd::Constant(1, 0.5 * p.mean_constant / (p.signal_std * p.signal_std));
      CylinderModel& c = model.cylinders[static_cast<std::size_t>(k)];
      c.extend = c.retract = GaussianProcess(p);
    }
  }
};

TEST(TimeGuide, GivesTheCostOfOneSledWithItsTime) {
  Rail rail(1);
  rail.problem.goal = JointGoal{VectorXd::Constant(1, 1.0)};
  const Lattice coarse = bound_lattice(rail.problem, {4});
  const LatticeForces forces = lattice_forces(rail.problem.machine, coarse, 0.0);
  TimedWeights weights(rail.model, rail.problem, rail.problem.machine, forces.range);
  TimeShares one;
  one.share = Eigen::MatrixX2d::Ones(1, 2);
  weights.set_shares(one);
  TimeGuide guide(rail.problem.machine, rail.problem, weights, {20});
  const double area = rail.problem.machine.cylinders[0].area_piston();
  for (const double price : {500.0, 5000.0, 50000.0}) {
    double best =
        std::numeric_limits<double>::infinity();  // over one metre, the best of 400 speeds
    for (int k = 1; k <= 400; ++k) {
      const double v = 0.2 * k / 400;
      const double pressure = rail.model.cylinders[0].extend.mean(area * v, 0.0);
      best = std::min(best, area * pressure + price / v);
    }
    EXPECT_NEAR(guide.solve(price), best, 0.01 * best) << price;
    const TimeShares found = guide.shares(one);
    EXPECT_NEAR(found.share(0, 0), 1.0, 0.01) << "the only joint has all of the price";
    EXPECT_EQ(found.share(0, 1), 0.0) << "it never retracts";
    EXPECT_LT(found.tilt.cwiseAbs().maxCoeff(), 0.02) << "the same everywhere";
  }
}

TEST(TimedBound, RisesAsTheDurationOfOneCylinderShrinks) {
  Rail rail(1);
  rail.problem.goal = JointGoal{VectorXd::Constant(1, 1.0)};
  const double area = rail.problem.machine.cylinders[0].area_piston();
  const GaussianProcess& process = rail.model.cylinders[0].extend;
  const double slow = area * process.mean(0.0, 0.0);
  for (const double duration : {5.1, 6.0, 8.0, 12.0, 40.0}) {
    // The least energy in this duration is that of a mixture of two speeds, sought over all pairs of a fine grid.
    constexpr int kSpeeds = 400;
    std::vector<double> cost(kSpeeds), pace(kSpeeds);
    for (int k = 0; k < kSpeeds; ++k) {
      const double v = 0.2 * (k + 1) / kSpeeds;
      cost[static_cast<std::size_t>(k)] = area * std::max(20e5, process.mean(area * v, 0.0));
      pace[static_cast<std::size_t>(k)] = 1.0 / v;
    }
    double exact = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < kSpeeds; ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        if (pace[a] > duration || a == b) continue;
        const double share = std::clamp((duration - pace[a]) / (pace[b] - pace[a]), 0.0, 1.0);
        exact = std::min(exact, share * cost[b] + (1.0 - share) * cost[a]);
      }
    }
    const TimedBound bound = energy_bound_at(rail.model, rail.problem, duration, quick_bound());
    ASSERT_TRUE(bound.valid) << bound.message;
    EXPECT_LE(bound.value, exact * (1.0 + 1e-3)) << duration;  // 400 speeds
    // The demand has ten linear pieces and the price is searched in steps: together 1.9 % at most.
    EXPECT_GE(bound.value, 0.975 * exact) << duration;
    if (duration < 7.0) {
      EXPECT_GT(bound.value, 1.1 * slow) << "a short duration costs energy here";
    }
  }
}

TEST(TimedBound, IsCloselyBelowDynamicProgrammingInTimeOfTwoCylinders) {
  Rail rail(2);
  constexpr int kWay = 60;  // number of steps of each sled's travel
  const double way[2] = {0.8, 0.5};
  rail.problem.goal = JointGoal{Eigen::Vector2d(way[0], way[1])};
  Chain chain(rail.model);
  for (const double duration : {5.5, 7.0, 9.0, 14.0}) {
    constexpr int kSteps = 12;
    const double dt = duration / kSteps;
    // Energy by the exact law of a time step in which the sleds move a and b steps, within the limits of flow.
    LimitRatios ratios(rail.problem);
    Eigen::MatrixXd stage(kWay + 1, kWay + 1);
    for (int a = 0; a <= kWay; ++a) {
      for (int b = 0; b <= kWay; ++b) {
        const Eigen::Vector2d q(0.1, 0.1), v(a * way[0] / kWay / dt, b * way[1] / kWay / dt);
        stage(a, b) = ratios.speed(q, v, nullptr) > 1.0 + 1e-9
                          ? std::numeric_limits<double>::infinity()
                          : chain.evaluate({q.data(), v.data()}, 0.0).power * dt;
      }
    }
    Eigen::MatrixXd best =
        Eigen::MatrixXd::Constant(kWay + 1, kWay + 1, std::numeric_limits<double>::infinity());
    best(0, 0) = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      Eigen::MatrixXd next = best;
      for (int x = 0; x <= kWay; ++x) {
        for (int y = 0; y <= kWay; ++y) {
          for (int a = 0; a <= x; ++a) {
            for (int b = 0; b <= y; ++b) {
              if (!std::isfinite(stage(a, b))) break;
              next(x, y) = std::min(next(x, y), best(x - a, y - b) + stage(a, b));
            }
          }
        }
      }
      best = next;
    }
    const double found = best(kWay, kWay);
    ASSERT_TRUE(std::isfinite(found)) << duration;
    const TimedBound bound = energy_bound_at(rail.model, rail.problem, duration, quick_bound());
    ASSERT_TRUE(bound.valid) << bound.message;
    EXPECT_LE(bound.value, found * (1.0 + 1e-9)) << duration;
    // Whole steps of travel cost some percent more than free ones; prices and shares are searched in steps.
    EXPECT_GE(bound.value, 0.96 * found) << duration;
  }
}

TEST(TimedBound, IsBelowTheBestKnownEnergyOfEveryBundledReach) {
  std::ifstream in(bundled_file("best_known.json"));
  std::stringstream text;
  text << in.rdbuf();
  const nlohmann::json known = test_support::parsed_json(text.str());
  TimedBoundOptions options;
  options.nodes = 6000;
  options.search_nodes = 800;
  options.evaluations = 20;
  int tried = 0;
  for (const auto& [file, entry] : known.items()) {
    if (!entry.contains("energy_J") || file.find("loader_crane") == std::string::npos) continue;
    const CraneModel model = load_model(bundled_file("models/loader_crane.json"));
    const MotionProblem problem = load_problem(bundled_file("reaches/" + file), &model.machine);
    const TimedBound bound =
        energy_bound_at(model, problem, entry.at("duration_s").get<double>(), options);
    ASSERT_TRUE(bound.valid) << file << ": " << bound.message;
    EXPECT_LE(bound.value, entry.at("energy_J").get<double>()) << file;
    EXPECT_LE(entry.at("lower_bound_J").get<double>(), entry.at("energy_J").get<double>()) << file;
    ++tried;
  }
  EXPECT_GE(tried, 15);
}

}  // namespace
}  // namespace sparflow
