// Limits and energies of motions with closed forms, which a wrong sign, a check at the knots alone or a mode that is not
// kept would change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "models/files/machine_file.h"
#include "models/files/model_file.h"
#include "models/math/units.h"
#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

/// A sled on a level rail, its tip 1 m above; the valve gives 300 l/min out and 100 l/min in.
struct Slide {
  MotionProblem problem;
  CraneModel model;

  Slide() {
    const Machine machine = parse_machine(
        "name: slide\njoints:\n  - {name: x, type: prismatic, parent: base, axis: [1, 0, 0], "
        "position: [0, 2], velocity: [-1, 1], acceleration: [-1, 1]}\n"
        "tip: {joint: x, xyz: [0, 0, 1]}\nlinks:\n  - {name: sled, joint: x, mass: 100, cog: [0, "
        "0, "
        "0], inertia: 0}\ncylinders:\n  - {name: x, joint: x, bore: 0.1, rod: 0.05, linkage: "
        "{type: "
        "direct}}\npumps:\n  - {name: main, feeds: [x], max_flow_lpm: 600, max_pressure_bar: 300, "
        "standby_bar: 20}\nvalves:\n  - {cylinder: x, max_flow_lpm: {extend: 300, retract: 100}}\n",
        "slide", ".");
    model = CraneModel::untrained(machine);
    GpParameters p;
    p.mean_constant = 50e5;
    p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
    p.flow_min = 0.0;
    p.flow_max = 1.0;
    p.force_min = -1e6;
    p.force_max = 1e6;
    model.cylinders[0].extend = model.cylinders[0].retract = GaussianProcess(p);
    problem.machine = machine;
    problem.limits = limits_of(machine);
  }

  /// Rest to rest over `way` from `start` in two intervals of one second.
  Trajectory hop(double start, double way) {
    Trajectory m;
    m.t = (VectorXd(3) << 0.0, 1.0, 2.0).finished();
    m.q = (Eigen::MatrixXd(3, 1) << start, start + 0.5 * way, start + way).finished();
    m.qd = (Eigen::MatrixXd(3, 1) << 0.0, way, 0.0).finished();
    m.qdd = (Eigen::MatrixXd(3, 1) << way, -way, -way).finished();
    problem.start = VectorXd::Constant(1, start);
    problem.goal = JointGoal{VectorXd::Constant(1, start + way)};
    return m;
  }

  LimitCheck check(const Trajectory& m, const std::string& what, int refine = 16) const {
    for (const LimitCheck& c : check_limits(model, problem, m, refine)) {
      if (c.what == what) return c;
    }
    ADD_FAILURE() << "no limit called " << what;
    return {};
  }
};

TEST(Limits, AreCheckedBetweenTheKnots) {
  // The sled is at 1.9 m at both knots and half-way at 1.9 + 0.25 m, beyond its limit of 2 m between the knots only.
  Slide s;
  Trajectory m = s.hop(1.9, 0.0);
  m.t = (VectorXd(2) << 0.0, 1.0).finished();
  m.q = Eigen::MatrixXd::Constant(2, 1, 1.9);
  m.qd = (Eigen::MatrixXd(2, 1) << 1.0, -1.0).finished();
  m.qdd = Eigen::MatrixXd::Constant(2, 1, -2.0);
  const LimitCheck c = s.check(m, "position of joint x");
  EXPECT_NEAR(c.value, 2.15, 1e-12);  // the maximum lies on one of the sixteen samples
  EXPECT_NEAR(c.time, 0.5, 1e-12);
  EXPECT_NEAR(c.excess, 0.15 / 2.0, 1e-12);
  EXPECT_LT(s.check(m, "position of joint x", 1).excess, 0.0);
}

/// Sampled at 0, 1.5 and 2 s, the hop of two seconds accelerates evenly until 1.5 s: to 0.375 of its way in place of 0.875.
TEST(Limits, AMotionSampledAtOtherInstantsThanItsOwnJumps) {
  Slide s;
  Trajectory hop = s.hop(0.5, 0.4);
  for (const LimitCheck& c : check_jumps(s.problem, hop)) EXPECT_NEAR(c.value, 0.0, 1e-12);
  const std::vector<LimitCheck> jumps =
      check_jumps(s.problem, resampled(hop, Eigen::Vector3d(0.0, 1.5, 2.0)));
  ASSERT_EQ(jumps.size(), 2U);
  EXPECT_EQ(jumps[0].what, "jump of joint x");
  EXPECT_NEAR(jumps[0].value, 0.5 * 0.4, 1e-12);
  EXPECT_NEAR(jumps[0].time, 1.5, 1e-12);
  EXPECT_NEAR(jumps[0].excess, 0.2 / 2.0, 1e-12);
  hop.qd(2, 0) += 0.1;
  const std::vector<LimitCheck> faster = check_jumps(s.problem, hop);
  EXPECT_EQ(faster[0].what, "jump of the speed of joint x");
  EXPECT_NEAR(faster[0].value, 0.1, 1e-12);
}

TEST(Limits, EachDirectionHasItsOwnValveLimit) {
  Slide s;
  const double piston = s.problem.machine.cylinders[0].area_piston();
  const double rod = s.problem.machine.cylinders[0].area_rod();
  const LimitCheck out = s.check(s.hop(0.5, 0.5), "flow through valve x");
  EXPECT_NEAR(out.limit, 300.0, 1e-9);
  EXPECT_NEAR(out.value, 0.5 * piston / units::kLitrePerMinute, 1e-6);
  EXPECT_LT(out.excess, 0.0);
  const LimitCheck in = s.check(s.hop(1.5, -0.5), "flow through valve x");
  EXPECT_NEAR(in.limit, 100.0, 1e-9);
  EXPECT_NEAR(in.value, 0.5 * rod / units::kLitrePerMinute, 1e-6);  // 177 l/min
  EXPECT_GT(in.excess, 0.7);
}

TEST(Limits, StartAndGoalAreChecked) {
  Slide s;
  const Trajectory m = s.hop(0.5, 0.5);
  EXPECT_LE(s.check(m, "distance from the goal posture").excess, 0.0);
  EXPECT_LE(s.check(m, "distance from the start posture").excess, 0.0);
  s.problem.start[0] = 0.4;
  EXPECT_NEAR(s.check(m, "distance from the start posture").excess, 0.1, 1e-6);
  s.problem.goal = JointGoal{VectorXd::Constant(1, 1.2)};
  EXPECT_NEAR(s.check(m, "distance from the goal posture").excess, 0.2, 1e-5);
  s.problem.goal = TipGoal{{1.0, 0.0, 1.0}};
  EXPECT_LE(s.check(m, "distance of the tip from its goal").excess, 0.0);
  s.problem.goal = TipGoal{{1.3, 0.0, 1.0}};
  EXPECT_NEAR(s.check(m, "distance of the tip from its goal").excess, 0.3, 1e-4);
}

TEST(Limits, ObstaclesAndPressureAreChecked) {
  Slide s;
  const Trajectory m = s.hop(0.5, 0.5);
  s.problem.limits.pump_max_pressure[0] = 40e5;  // the pump needs 50 bar
  EXPECT_NEAR(s.check(m, "pressure of pump main").excess, 0.25, 1e-9);
  s.problem.obstacles.push_back({"post", Sphere{{1.0, 0.0, 1.0}, 0.2}});
  EXPECT_GT(s.check(m, "clearance beyond the required distance").excess, 0.1);
  s.problem.obstacles[0].shape = Sphere{{10.0, 0.0, 1.0}, 0.2};
  EXPECT_LT(s.check(m, "clearance beyond the required distance").excess, 0.0);
}

TEST(ExactEnergy, SharesOfPumpsUsefulWorkAndDataAddUp) {
  Slide s;
  const Trajectory m = s.hop(0.5, 0.5);
  const MotionEnergy e = exact_energy(s.model, m, 0.0);
  EXPECT_NEAR(e.pump[0], e.total, 1e-9 * e.total);
  EXPECT_NEAR(e.useful[0], e.total,
              1e-9 * e.total);  // one cylinder without margin has no throttling loss
  EXPECT_EQ(e.moving_share_outside_data, 0.0);
  GpParameters p = s.model.cylinders[0].extend.parameters();
  // The data end at half the highest speed, which a triangular profile exceeds in its middle half.
  p.flow_max = 0.25 * s.problem.machine.cylinders[0].area_piston();
  s.model.cylinders[0].extend = GaussianProcess(p);
  EXPECT_NEAR(exact_energy(s.model, m, 0.0).moving_share_outside_data, 0.5, 1e-12);
}

TEST(ExactEnergy, ACreepingCylinderStandsButIsPaidFor) {
  // 1 mm in two seconds is 0.5 mm/s on average: 0.24 l/min of the valve's 300, and its least flow is 1.5 l/min.
  Slide s;
  const Trajectory m = s.hop(0.5, 1e-3);
  const MotionEnergy creeping = exact_energy(s.model, s.problem, m);
  EXPECT_EQ(creeping.share_moving[0], 1.0);
  EXPECT_EQ(creeping.share_moving[1], 0.0);
  EXPECT_NEAR(creeping.creep[0], 1e-3, 1e-9);
  EXPECT_EQ(creeping.total, exact_energy(s.model, m, 0.0).total)
      << "a least flow never makes a motion cheaper";
  s.problem.limits.valve_least_fraction = 0.0;
  const MotionEnergy moving = exact_energy(s.model, s.problem, m);
  EXPECT_EQ(moving.share_moving[1], 1.0);
  EXPECT_EQ(moving.creep[0], 0.0);
}

/// The bundled lift with a synthetic model and straight lines to two goal configurations.
struct Lift {
  MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  CraneModel model = test_support::synthetic_model(problem.machine);
  std::vector<SeedMotion> seeds;
  OptimizeOptions options;

  Lift() {
    options.intervals = 40;
    options.processes = 1;
    const Eigen::Vector3d goal = std::get<TipGoal>(problem.goal).tip;
    for (const bool still : {false, true}) {
      VectorXd end = problem.start;
      if (!solve_end_posture(problem.machine, problem.limits, goal, {!still, true, true}, end))
        continue;
      Eigen::MatrixXd path(2, 3);
      path << problem.start.transpose(), end.transpose();
      const TimedMotion timed = time_parametrise(problem, path, 0.0);
      seeds.push_back({still ? "still" : "line", timed.motion, timed.shortest, true});
    }
  }
};

TEST(ExactEnergy, PotentialEnergyIsThatOfTheLift) {
  const Lift c;
  ASSERT_EQ(c.seeds.size(), 2u);
  for (const SeedMotion& s : c.seeds) {
    const double empty = exact_energy(c.model, s.motion, 0.0).potential_difference;
    const double loaded = exact_energy(c.model, s.motion, 1000.0).potential_difference;
    const auto height = [&](Eigen::Index k) {
      const VectorXd q = s.motion.q.row(k).transpose();
      return tip_position<double>(c.problem.machine, q).z();
    };
    EXPECT_NEAR(loaded - empty, 1000.0 * 9.81 * (height(s.motion.size() - 1) - height(0)), 1e-3);
  }
}

TEST(ExactEnergy, IsNeverBelowWhatMachineAndLoadGain) {
  const Lift c;
  const CraneModel learned = load_model(bundled_file("models/loader_crane.json"));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int lifts = 0;
  for (int i = 0; i < 60; ++i) {
    const auto posture = [&] {
      VectorXd q = c.problem.start;
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Range& r = c.problem.limits.position[static_cast<std::size_t>(j)];
        q[j] = r.lo + unit(random) * (r.hi - r.lo);
      }
      return q;
    };
    Eigen::MatrixXd line(2, 3);
    line << posture().transpose(), posture().transpose();
    const TimedMotion timed = time_parametrise(c.problem, line, 0.0);
    if (timed.motion.size() < 2) continue;
    const double payload = 1000.0 * unit(random);
    const Trajectory motion =
        with_duration(timed.motion, (1.0 + 3.0 * unit(random)) * timed.shortest);
    for (const CraneModel* model : {&c.model, &learned}) {
      const MotionEnergy e = exact_energy(*model, motion, payload);
      if (e.potential_difference > 0.0) ++lifts;
      EXPECT_GE(e.total, e.potential_difference) << "motion " << i << ", " << payload << " kg";
    }
  }
  EXPECT_GE(lifts, 20);
}

TEST(Optimize, BaselinesAreTheCheapestOfTheirKind) {
  Lift c;
  c.options.sequential_starts = 0;
  c.options.smooth_iterations = 5;  // the baselines do not depend on the solve
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, c.options);
  double cheapest = INFINITY, nearest = 0.0;
  for (const SeedMotion& s : c.seeds) {
    const Trajectory timed = with_duration(s.motion, r.duration);
    if (worst_excess(check_limits(c.model, c.problem, timed)) > 1e-3) continue;
    const double energy = exact_energy(c.model, timed, c.problem.payload).total;
    if (&s == &c.seeds.front()) nearest = energy;
    cheapest = std::min(cheapest, energy);
  }
  EXPECT_GT(std::abs(nearest - cheapest), 0.01 * cheapest) << "the two lines must differ in energy";
  EXPECT_EQ(r.straight_line_energy, cheapest);
  EXPECT_EQ(r.best_seed_energy, cheapest);
  EXPECT_EQ(r.nearest_line_energy, nearest);
}

TEST(Optimize, FixedModesAreKeptBySolver) {
  // Without overlaps the solver may shift and stretch the legs of a sequential motion, but never move two cylinders at
  // once.
  Lift c;
  c.options.overlap = 0.0;
  const VectorXd times = VectorXd::LinSpaced(41, 0.0, 16.0);
  std::vector<VectorXd> ends;
  for (const SeedMotion& s : c.seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  const std::vector<ModeCandidate> candidates =
      sequential_candidates(c.model, c.problem, times, ends, 3);
  ASSERT_FALSE(candidates.empty());
  for (const ModeCandidate& candidate : candidates) {
    const StartResult r = optimize_with_modes(c.model, c.problem, candidate, c.options);
    ASSERT_TRUE(r.usable(c.options.limit_tolerance)) << candidate.name << ": " << r.message;
    EXPECT_TRUE(r.modes_held) << candidate.name;
    EXPECT_LT(r.energy_exact, candidate.energy * (1.0 + 1e-9));
    const MotionEnergy e = exact_energy(c.model, r.motion, c.problem.payload);
    EXPECT_LE(e.share_moving[2] + e.share_moving[3], 1e-9) << candidate.name;
  }
}

TEST(Optimize, AnInterruptedSearchSaysSoAndKeepsWhatItHas) {
  Lift c;
  int asked = 0;
  c.options.interrupted = [&] { return ++asked > 3; };
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, c.options);
  EXPECT_EQ(r.status, OptimizeStatus::kInterrupted);
  ASSERT_GT(r.motion.size(), 1);
  EXPECT_LE(worst_excess(r.checks), 1e-5);
}

TEST(Optimize, TheFeasibleDurationNamedIsThatOfTheShortestSeed) {
  Lift c;
  c.problem.duration = {2.0, 2.0};
  c.options.sequential_starts = 0;
  c.options.free_phases = false;  // else the shortest motion is sought and named
  c.seeds[0].shortest_duration = 11.25;
  c.seeds[1].shortest_duration = 14.75;
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, c.options);
  EXPECT_EQ(r.status, OptimizeStatus::kInfeasible);
  EXPECT_THAT(r.message, HasSubstr("keeps all limits in 11.2 s"));
  // The message names a limit of the start with the smallest violation, and a flow rather than what follows from it.
  double nearest = INFINITY;
  for (const StartResult& start : r.starts)
    if (start.motion.size() > 1) nearest = std::min(nearest, start.excess);
  EXPECT_EQ(worst_excess(r.checks), nearest);
  EXPECT_THAT(r.message, HasSubstr("Worst: flow"));
}

}  // namespace
}  // namespace sparflow
