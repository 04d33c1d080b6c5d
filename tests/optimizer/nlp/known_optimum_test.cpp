// Optima in closed form on machines of one and two cylinders, each determined by one limit; a limit that is shifted,
// forgotten or kept at the knots only would change them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/files/machine_file.h"
#include "models/machine/kinematics.h"
#include "models/math/units.h"
#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

GaussianProcess constant_pressure(double pressure) {
  GpParameters p;
  p.mean_constant = pressure;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
  p.flow_max = 1.0;
  p.force_min = -1e6;
  p.force_max = 1e6;
  return GaussianProcess(p);
}

/// Two sleds on one level rail, the second on the first; the tip is on the second. The first works at 100 bar and the
/// second, which has half a metre only, at 50 bar at any flow. In the optimum the second moves alone as far as it can.
struct Rails {
  MotionProblem problem;
  CraneModel model;
  double area = 0.0;  // of either piston [m^2]

  Rails() {
    const Machine machine = parse_machine(
        "name: rails\njoints:\n"
        "  - {name: far, type: prismatic, parent: base, axis: [1, 0, 0], position: [0, 2], "
        "velocity: [-1, 1], acceleration: [-1, 1]}\n"
        "  - {name: near, type: prismatic, parent: far, axis: [1, 0, 0], position: [0, 0.5], "
        "velocity: [-1, 1], acceleration: [-1, 1]}\n"
        "tip: {joint: near, xyz: [0, 0, 1]}\nlinks:\n"
        "  - {name: sled, joint: far, mass: 100, cog: [0, 0, 0], inertia: 0}\n"
        "  - {name: top, joint: near, mass: 100, cog: [0, 0, 0], inertia: 0}\n"
        "cylinders:\n  - {name: far, joint: far, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
        "  - {name: near, joint: near, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
        "pumps:\n  - {name: main, feeds: [far, near], max_flow_lpm: 300, max_pressure_bar: 300, "
        "standby_bar: 20}\nvalves:\n"
        "  - {cylinder: far, max_flow_lpm: {extend: 300, retract: 300}}\n"
        "  - {cylinder: near, max_flow_lpm: {extend: 300, retract: 300}}\n",
        "rails", ".");
    area = machine.cylinders[0].area_piston();
    model = CraneModel::untrained(machine);
    model.cylinders[0].extend = model.cylinders[0].retract = constant_pressure(100e5);
    model.cylinders[1].extend = model.cylinders[1].retract = constant_pressure(50e5);
    problem.name = "rails";
    problem.machine = machine;
    problem.limits = limits_of(machine);
    problem.start = VectorXd::Zero(2);
    problem.goal = TipGoal{{1.0, 0.0, 1.0}};
    problem.duration = {8.0, 8.0};
  }

  SeedMotion line_to(double far, double near) const {
    Eigen::MatrixXd path(2, 2);
    path << problem.start.transpose(), far, near;
    const TimedMotion timed = time_parametrise(problem, path, 0.0);
    return {"line", timed.motion, timed.shortest, true};
  }

  static OptimizeOptions options() {
    OptimizeOptions o;
    o.intervals = 40;
    o.processes = 1;
    return o;
  }

  double least_energy() const { return area * (0.5 * 50e5 + 0.5 * 100e5); }
};

TEST(KnownOptimum, TheCheaperCylinderMovesToItsLimitAndNotBeyond) {
  Rails r;
  OptimizeOptions options = Rails::options();
  options.tightenings = 0;  // tightening must not hide bounds other than the joints' own
  const OptimizeResult found = optimize(r.model, r.problem, {r.line_to(0.8, 0.2)}, options);
  ASSERT_EQ(found.status, OptimizeStatus::kOptimal) << found.message;
  // 1e-3 covers the smoothed maximum (0.3 bar) and the acceleration term, which prefers even speeds.
  EXPECT_NEAR(found.energy.total, r.least_energy(), 1e-3 * r.least_energy());
  const double near = found.motion.q(found.motion.size() - 1, 1);
  EXPECT_NEAR(near, 0.5, 1e-3);
  EXPECT_LE(near, 0.5 + 1e-6);
}

TEST(KnownOptimum, TheSolveWithFixedModesIsSmoothedByItsOwnWidthOnly) {
  // Log-sum-exp of n demands lies between their maximum and the maximum + beta log(n + 1), so the energy of the solve lies
  // above the exact one by at most beta log(n + 1) times the volume pumped, and not below it.
  Rails r;
  r.model.cylinders[1].extend = r.model.cylinders[1].retract = constant_pressure(99.5e5);
  r.problem.limits.pump_max_flow.assign(1, 0.0);
  r.problem.goal = JointGoal{VectorXd::Constant(2, 0.5)};
  OptimizeOptions options = Rails::options();
  // First the near sled moves, then both, then the far one; each travel is smooth and within its limits.
  ModeCandidate candidate;
  candidate.name = "overlapping";
  candidate.modes.setConstant(options.intervals, 2, CylinderMode::kRest);
  Trajectory& guess = candidate.guess;
  const Eigen::Index knots = options.intervals + 1;
  guess.t = VectorXd::LinSpaced(knots, 0.0, 2.4);
  guess.q.setZero(knots, 2);
  guess.qd.setZero(knots, 2);
  guess.qdd.setZero(knots, 2);
  constexpr int kFirst[2] = {10, 0}, kLong = 30;  // [intervals]
  const double way = 0.5, time = guess.t[kLong];
  for (int j = 0; j < 2; ++j) {
    for (int k = 0; k < options.intervals; ++k) {
      if (k >= kFirst[j] && k < kFirst[j] + kLong) candidate.modes(k, j) = CylinderMode::kExtend;
    }
    for (Eigen::Index k = 0; k < knots; ++k) {
      const double s = std::clamp((guess.t[k] - guess.t[kFirst[j]]) / time, 0.0, 1.0);
      guess.q(k, j) = way * s * s * s * (10.0 + s * (-15.0 + s * 6.0));
      guess.qd(k, j) = way / time * 30.0 * s * s * (1.0 - s) * (1.0 - s);
      guess.qdd(k, j) = way / (time * time) * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
    }
  }
  const double volume = r.area * 2.0 * way;
  const auto above_exact = [&](double beta) {
    options.pressure_in_modes = beta;
    options.free_phases = false;  // the duration of the overlap is fixed
    const StartResult found = optimize_with_modes(r.model, r.problem, candidate, options);
    EXPECT_TRUE(found.usable(options.limit_tolerance)) << found.message;
    EXPECT_TRUE(found.modes_held) << "the guess was kept";
    return found.energy_smooth - found.energy_exact;
  };
  // 2e-4 of 78 kJ covers speeds too small to count as moving, near starts and stops.
  const double rounding = 2e-4 * 100e5 * volume;
  const double finish = OptimizeOptions().pressure_in_modes;
  const auto bound = [&](double beta) { return beta * std::log(3.0) * volume; };
  for (const double beta : {finish, 10.0 * finish}) {
    SCOPED_TRACE(beta);
    const double above = above_exact(beta);
    EXPECT_GE(above, -rounding);
    EXPECT_LE(above, bound(beta) + rounding);
    // The wider smoothing shows that this bound can be violated.
    if (beta > finish) {
      EXPECT_GT(above, 2.0 * bound(finish));
    }
  }
}

TEST(KnownOptimum, SequentialGuessesKeepEveryLimitOfSpeed) {
  // Two legs of 0.5 m at v = 0.12 m/s and 1 m/s^2 take 2 (0.5 / v + v) = 8.573 s, whatever sets v.
  constexpr double kSpeed = 0.12, kShortest = 2.0 * (0.5 / kSpeed + kSpeed);
  for (const bool outwards : {true, false}) {
    for (const std::string what : {"pump", "valve", "joint"}) {
      SCOPED_TRACE(what + (outwards ? " outwards" : " back"));
      Rails r;
      const Cylinder& cylinder = r.problem.machine.cylinders[0];
      const double flow = kSpeed * (outwards ? cylinder.area_piston() : cylinder.area_rod());
      if (what == "pump") r.problem.limits.pump_max_flow[0] = flow;
      if (what == "valve") {
        r.problem.limits.valve_fraction = flow / (300.0 * units::kLitrePerMinute);
      }
      if (what == "joint") r.problem.limits.velocity.assign(2, {-kSpeed, kSpeed});
      const VectorXd out = VectorXd::Constant(2, 0.5), in = VectorXd::Zero(2);
      r.problem.start = outwards ? in : out;
      r.problem.goal = JointGoal{outwards ? out : in};
      const auto guesses = [&](double duration) {
        const VectorXd times = VectorXd::LinSpaced(101, 0.0, duration);
        return sequential_candidates(r.model, r.problem, times, {}, 10);
      };
      EXPECT_TRUE(guesses(0.99 * kShortest).empty());
      // 5 %: each leg loses two intervals by starting and stopping at knots.
      const std::vector<ModeCandidate> found = guesses(1.05 * kShortest);
      ASSERT_EQ(found.size(), 2u) << "either order";
      for (const ModeCandidate& c : found) {
        const std::vector<LimitCheck> checks = check_limits(r.model, r.problem, c.guess);
        // 0.5 %: the trapezoid, sampled at the knots, is scaled to cover the travel exactly.
        EXPECT_LE(worst_excess(checks), 5e-3) << c.name << ": " << checks.front().what;
        const MotionEnergy e = exact_energy(r.model, c.guess, 0.0);
        EXPECT_NEAR(e.total, flow / kSpeed * (0.5 * 50e5 + 0.5 * 100e5), 1e-9 * e.total);
      }
    }
  }
}

/// A bundled reach of the loader crane with a synthetic model, started from the straight joint line to a goal
/// configuration with the boom free or at rest.
struct Reach {
  MotionProblem problem;
  CraneModel model;
  OptimizeOptions options;

  explicit Reach(const std::string& name)
      : problem(load_problem(bundled_file("reaches/" + name))),
        model(test_support::synthetic_model(problem.machine)) {
    options.intervals = 12;  // coarse, so that limits are violated between knots
    options.processes = 1;
  }

  SeedMotion line(bool boom_moves) const {
    VectorXd end = problem.start;
    const Eigen::Vector3d goal = std::get<TipGoal>(problem.goal).tip;
    EXPECT_TRUE(
        solve_end_posture(problem.machine, problem.limits, goal, {boom_moves, true, true}, end));
    Eigen::MatrixXd path(2, 3);
    path << problem.start.transpose(), end.transpose();
    const TimedMotion timed = time_parametrise(problem, path, 0.0);
    return {"line", timed.motion, timed.shortest, true};
  }
};

TEST(KnownOptimum, AStartKeepsItsCheapestMotion) {
  // The modes of the seed (boom at rest, one joint after the other) are the best here; the motion of the smooth law that
  // follows costs some percent more and must not replace it.
  Reach r("loader_crane_lift.yaml");
  const StartResult found = optimize_from(r.model, r.problem, r.line(false), 16.0, r.options);
  double cheapest = INFINITY, last = 0.0;
  for (const StageRecord& s : found.stages) {
    if (s.energy_exact == 0.0 || s.excess > r.options.limit_tolerance) continue;
    cheapest = std::min(cheapest, s.energy_exact);
    last = s.energy_exact;
  }
  ASSERT_GT(last, 1.001 * cheapest) << "the last motion must differ from the best";
  EXPECT_EQ(found.energy_exact, cheapest);
  EXPECT_EQ(exact_energy(r.model, found.motion, r.problem.payload).total, cheapest);
}

struct Drawn {
  StartResult without, with;  ///< without and with bound tightening
};

/// Solves with and without bound tightening, and expects limit `what` to be violated without.
Drawn expect_drawn_in(Reach& r, const SeedMotion& seed, double duration, const std::string& what) {
  Drawn d;
  r.options.tightenings = 0;
  d.without = optimize_from(r.model, r.problem, seed, duration, r.options);
  r.options.tightenings = 5;
  d.with = optimize_from(r.model, r.problem, seed, duration, r.options);
  const double tolerance = r.options.limit_tolerance;
  const auto broken = [&](const StageRecord& s) {
    return s.what == "modes" && s.excess > 3.0 * tolerance;
  };
  EXPECT_TRUE(std::any_of(d.without.stages.begin(), d.without.stages.end(), broken))
      << what << ": the limit must be violated between the knots for this test";
  EXPECT_TRUE(d.with.usable(tolerance)) << d.with.message;
  const std::vector<LimitCheck> checks = check_limits(r.model, r.problem, d.with.motion, 37);
  EXPECT_LE(worst_excess(checks), tolerance) << checks.front().what;
  EXPECT_TRUE(std::any_of(d.with.stages.begin(), d.with.stages.end(), [&](const StageRecord& s) {
    return s.what.starts_with("modes, limits tightened") && s.energy_exact > 0.0 &&
           s.excess <= tolerance;
  })) << what;
  if (d.without.usable(tolerance)) {
    EXPECT_LT(d.with.energy_exact, 0.999 * d.without.energy_exact) << what;
  }
  return d;
}

TEST(KnownOptimum, PumpFlowIsTightened) {
  Reach r("loader_crane_lift.yaml");
  const SeedMotion seed = r.line(true);
  expect_drawn_in(r, seed, 1.1 * seed.shortest_duration, "flow of pump");
}

TEST(KnownOptimum, ValveFlowIsTightened) {
  Reach r("loader_crane_lift.yaml");
  r.problem.limits.pump_max_flow.assign(1, 0.0);
  r.problem.limits.valve_fraction = 0.5;
  const SeedMotion seed = r.line(true);
  expect_drawn_in(r, seed, 1.1 * seed.shortest_duration, "flow through valve");
}

TEST(KnownOptimum, PumpPressureIsTightened) {
  Reach r("loader_crane_lift.yaml");
  const SeedMotion seed = r.line(true);
  const StartResult free = optimize_from(r.model, r.problem, seed, 16.0, r.options);
  double most = 0.0;  // [Pa]
  for (const LimitCheck& c : check_limits(r.model, r.problem, free.motion)) {
    if (c.what == "pressure of pump main") most = c.value * units::kBar;
  }
  ASSERT_GT(most, 50e5);
  // Its rows are added after a violation; then they are tightened.
  r.problem.limits.pump_max_pressure[0] = 0.97 * most;
  expect_drawn_in(r, seed, 16.0, "pressure of pump");
}

TEST(KnownOptimum, TheTipsDistanceFromItsLineIsTightened) {
  Reach r("loader_crane_line.yaml");
  expect_drawn_in(r, r.line(false), 16.0, "distance of the tip from its line");
}

TEST(KnownOptimum, ClearanceRowsThatAreLeftOutAreFarOnes) {
  // Two balls are beside the tip's path, early and late. The rows chosen for the seed must give the same least clearance
  // as all rows in every posture in which it is small.
  Reach r("loader_crane_lift.yaml");
  const SeedMotion seed = r.line(false);
  const Eigen::Index knots = seed.motion.size();
  for (const Eigen::Index k : {knots / 5, knots - knots / 5}) {
    const VectorXd q = seed.motion.q.row(k);
    const Eigen::Vector3d tip = tip_position<double>(r.problem.machine, q);
    r.problem.obstacles.push_back({"ball", Sphere{tip - Eigen::Vector3d{0.0, 0.0, 0.7}, 0.3}});
  }
  CraneKnotOptions some;
  some.near_postures = seed.motion.q;
  CraneKnotModel chosen(r.model, r.problem, some), all(r.model, r.problem, {});
  ASSERT_LT(chosen.path_count(), all.path_count()) << "some rows must be left out";
  const auto least = [](CraneKnotModel& model, const VectorXd& q) {
    VectorXd z = VectorXd::Zero(model.size()), g(model.path_count());
    z.head(q.size()) = q;
    model.path(z.data(), g.data());
    double low = INFINITY;
    for (int row = 0; row < model.path_count(); ++row) {
      if (model.path_name(row).starts_with("clearance")) low = std::min(low, g[row]);
    }
    return low;
  };
  constexpr double kSmall = 0.4;  // [m] below the half metre from which on rows are left out
  int small = 0;
  for (Eigen::Index k = 0; k < knots; ++k) {
    const double low = least(all, seed.motion.q.row(k));
    if (low > kSmall) continue;
    ++small;
    EXPECT_EQ(least(chosen, seed.motion.q.row(k)), low) << k;
  }
  EXPECT_GT(small, 2);
}

TEST(KnownOptimum, ThePumpsLimitIsTheProblems) {
  // The row itself is checked, because bound tightening would also keep a limit that is set too wide.
  Reach r("loader_crane_lift.yaml");
  const double limit = 0.4 * r.problem.machine.pumps[0].max_flow;
  r.problem.limits.pump_max_flow[0] = limit;
  CraneKnotModel knot(r.model, r.problem, {});
  VectorXd lower(knot.path_count()), upper(knot.path_count());
  knot.path_bounds(lower.data(), upper.data());
  int found = 0;
  for (int row = 0; row < knot.path_count(); ++row) {
    if (knot.path_name(row) != "flow of pump main") continue;
    ++found;
    EXPECT_NEAR(upper[row], 1e3 * limit, 1e-9 * 1e3 * limit) << "[l/s]";
  }
  EXPECT_EQ(found, 1);
}

TEST(KnownOptimum, ThrottlingIsThatOfTheCheaperCylinder) {
  // Both sleds move at once and the pump works at 100 bar for the first: the second one's valve throttles 50 bar.
  const Rails r;
  const MotionEnergy e = exact_energy(r.model, r.line_to(0.5, 0.5).motion, 0.0);
  const double volume = 0.5 * r.area;
  // 1e-3: at the first and last instants a cylinder is too slow to count as moving.
  EXPECT_NEAR(e.throttling[0], 0.0, 1e-3 * e.total);
  EXPECT_NEAR(e.throttling[1], 50e5 * volume, 1e-3 * e.total);
  EXPECT_NEAR(e.useful[0], 100e5 * volume, 1e-3 * e.total);
  EXPECT_NEAR(e.useful[1], 50e5 * volume, 1e-3 * e.total);
}

TEST(KnownOptimum, ClearanceIsTightened) {
  Reach r("loader_crane_lift.yaml");
  const SeedMotion seed = r.line(false);
  // The obstacle is beside the seed's tip path; the optimum without it passes 0.2 m deep through it.
  r.problem.obstacles = {{"ball", Sphere{{6.9, 0.0, -0.3}, 0.5}}};
  expect_drawn_in(r, seed, 16.0, "clearance");
}

}  // namespace
}  // namespace sparflow
