// The whole optimisation on machines with synthetic models: the result is cheaper than the seeds and keeps its limits
// between knots, and infeasible problems are reported.
#include "optimizer/solve/optimize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "optimizer/solve/child_processes.h"
#include "problems/bundled.h"
#include "problems/motion_table.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/applied_effects.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;

struct Case {
  MotionProblem problem;
  CraneModel model;
  std::vector<SeedMotion> seeds;
};

/// Straight joint lines to the goal configuration nearest to the start and to one with the first joint at rest.
Case lift_case() {
  Case c;
  c.problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  c.model = test_support::synthetic_model(c.problem.machine);
  const Eigen::Vector3d goal = std::get<TipGoal>(c.problem.goal).tip;
  for (const bool still : {false, true}) {
    VectorXd end = c.problem.start;
    std::vector<bool> free(3, true);
    free[0] = !still;
    if (!solve_end_posture(c.problem.machine, c.problem.limits, goal, free, end)) continue;
    Eigen::MatrixXd path(2, 3);
    path.row(0) = c.problem.start.transpose();
    path.row(1) = end.transpose();
    const TimedMotion timed = time_parametrise(c.problem, path, 0.0);
    c.seeds.push_back({still ? "line, boom at rest" : "line", timed.motion, timed.shortest, true});
  }
  return c;
}

OptimizeOptions quick() {
  OptimizeOptions options;
  options.intervals = 60;
  options.processes = 1;
  return options;
}

TEST(Optimize, UsesLessExactEnergyThanSeedAndStraightLineAndKeepsAllLimits) {
  const Case c = lift_case();
  ASSERT_FALSE(c.seeds.empty());
  OptimizeOptions told = quick();
  std::vector<double> shares;
  told.progress = [&](double share, const std::string&) { shares.push_back(share); };
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, told);
  // One call a start, the share of which never falls and is not at its end long before the last one.
  EXPECT_EQ(shares.size(), r.starts.size());
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_LT(shares[shares.size() / 2], 0.85);
  EXPECT_LE(shares.back(), 1.0);
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  ASSERT_GT(r.straight_line_energy, 0.0);
  EXPECT_LT(r.energy.total, r.straight_line_energy);
  EXPECT_LT(r.energy.total, r.best_seed_energy);
  // Limits are checked at 16 samples per mesh interval, as the optimiser does, and at a density that it does not use.
  for (const int refine : {16, 37}) {
    const std::vector<LimitCheck> checks = check_limits(c.model, c.problem, r.motion, refine);
    EXPECT_LE(worst_excess(checks), 1e-5) << checks.front().what << " at " << checks.front().time;
  }
}

/// Energy by a second method: Simpson's rule on 40 parts of each interval, with end states moved slightly inside the interval.
double simpson_energy(const Case& c, const Trajectory& motion) {
  Chain chain(c.model);
  double energy = 0.0;
  const auto power = [&](Eigen::Index k, double dt) {
    const VectorXd q =
        (motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k)).transpose();
    const VectorXd qd = (motion.qd.row(k) + dt * motion.qdd.row(k)).transpose();
    const VectorXd qdd = motion.qdd.row(k).transpose();
    return chain.evaluate({q.data(), qd.data(), qdd.data()}, c.problem.payload).power;
  };
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double h = motion.t[k + 1] - motion.t[k];
    const int parts = 40;
    for (int i = 0; i < parts; ++i) {
      const double a = h * (i + 1e-6) / parts, b = h * (i + 1 - 1e-6) / parts;
      energy += (b - a) / 6.0 * (power(k, a) + 4.0 * power(k, 0.5 * (a + b)) + power(k, b));
    }
  }
  return energy;
}

TEST(Optimize, EnergyIsThatOfTheExactLawByASecondIntegration) {
  const Case c = lift_case();
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, quick());
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal);
  // The midpoint rule on 16 parts has the error (h/16)^2/24 times the curvature of the power.
  const double energy = simpson_energy(c, r.motion);
  EXPECT_NEAR(r.energy.total, energy, 2e-4 * energy);
}

TEST(Optimize, WithEffectsTheReportedEnergyIsTheExactChains) {
  Case c = lift_case();
  const Machine& machine = c.model.machine;
  const double without = exact_energy(c.model, c.seeds.front().motion, c.problem.payload).total;
  for (const char* key : {"coulomb_friction:boom", "coulomb_friction:jib", "return_back_pressure",
                          "flow_dependent_margin:main"}) {
    c.model.effects.push_back(test_support::applied(key, machine));
  }
  // With friction of 8 kN, a return pressure of 12 bar and a growing margin the same motion costs clearly more.
  EXPECT_GT(exact_energy(c.model, c.seeds.front().motion, c.problem.payload).total, 1.03 * without);
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, quick());
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  EXPECT_LT(r.energy.total, r.straight_line_energy);
  EXPECT_LT(r.energy.total, r.best_seed_energy);
  EXPECT_LE(worst_excess(check_limits(c.model, c.problem, r.motion, 37)), 1e-5);
  EXPECT_NEAR(r.energy.total, simpson_energy(c, r.motion), 2e-4 * r.energy.total);
  // With the effects in its law the optimum is better than a motion optimised without them.
  CraneModel bare = c.model;
  bare.effects.clear();
  const OptimizeResult blind = optimize(bare, c.problem, c.seeds, quick());
  ASSERT_EQ(blind.status, OptimizeStatus::kOptimal);
  // 0.2 %: both are local optima on a mesh of 60 intervals.
  EXPECT_LE(r.energy.total, 1.002 * exact_energy(c.model, blind.motion, c.problem.payload).total);
}

TEST(Optimize, WithInertiaAccelerationsAreInTheLaw) {
  Case c = lift_case();
  c.model.effects = {test_support::applied("inertia", c.model.machine)};
  c.seeds.resize(1);
  // The search is as small as possible, because only the law of the energy is tested.
  OptimizeOptions options = quick();
  options.search_intervals = 30;
  options.sequential_starts = 1;
  options.grid_starts = 0;
  options.searched_starts = 1;
  options.sequence_rounds = 0;
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  EXPECT_LT(r.energy.total, r.best_seed_energy);
  EXPECT_NEAR(r.energy.total, simpson_energy(c, r.motion), 2e-4 * r.energy.total);
}

TEST(Optimize, CreepingIsCheapByTheSmoothLawOnly) {
  // In a motion 200 times slower every cylinder creeps far below the smoothed activation's 20 mm/s, and the smooth energy
  // almost vanishes. The exact law, by which energies are reported, still contains the whole pressure.
  const Case c = lift_case();
  Trajectory creep = with_duration(c.seeds.front().motion, 3200.0);
  const double exact = exact_energy(c.model, creep, c.problem.payload).total;
  CraneKnotOptions options;
  options.smoothing = {20e-3, 1e5};
  CraneKnotModel knot(c.model, c.problem, options);
  double smooth = 0.0;
  for (Eigen::Index k = 0; k + 1 < creep.size(); ++k) {
    VectorXd z(6);
    z << creep.q.row(k).transpose(), creep.qd.row(k).transpose();
    smooth += 1e3 * knot.cost(z.data()) * (creep.t[k + 1] - creep.t[k]);
  }
  const double brisk = exact_energy(c.model, with_duration(creep, 16.0), c.problem.payload).total;
  EXPECT_LT(smooth, 0.2 * exact);
  EXPECT_GT(exact, 0.5 * brisk);  // a slower motion saves flow losses only
}

TEST(Optimize, SequentialMotionsAreTriedDownToTheirShortestTime) {
  // In the shortest duration of a sequential motion (travel / speed + speed / acceleration for each leg) plus the loss of
  // two intervals of the mesh for each leg, the optimum must not cost more than that motion.
  Case c = lift_case();
  c.seeds.resize(1);
  OptimizeOptions options = quick();
  options.intervals = 100;
  for (const double duration : {12.0, 13.0, 14.5}) {
    c.problem.duration = {duration, duration};
    const OptimizeResult r = optimize(c.model, c.problem, c.seeds, options);
    ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
    const bool tried = std::any_of(r.starts.begin(), r.starts.end(), [](const StartResult& s) {
      return s.seed.starts_with("sequential");
    });
    EXPECT_TRUE(tried) << duration << " s";
  }
}

TEST(Optimize, WhereTimeIsShortSequencesOfSlowerMotionsAreTried) {
  Case c = lift_case();
  c.seeds.resize(1);
  for (const double times_shortest : {1.3, 2.1}) {
    const double duration = times_shortest * c.seeds[0].shortest_duration;
    c.problem.duration = {duration, duration};
    const OptimizeResult r = optimize(c.model, c.problem, c.seeds, quick());
    ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
    const bool shortened = std::any_of(r.starts.begin(), r.starts.end(), [](const StartResult& s) {
      return s.seed.find("shortened") != std::string::npos;
    });
    EXPECT_EQ(shortened, times_shortest < 2.0) << duration << " s";
  }
}

TEST(Optimize, TooShortATimeIsNamedWithTheLimitAndAFeasibleDuration) {
  Case c = lift_case();
  c.problem.duration = {2.0, 2.0};
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, quick());
  EXPECT_EQ(r.status, OptimizeStatus::kInfeasible);
  EXPECT_THAT(r.message, HasSubstr("infeasible"));
  EXPECT_THAT(r.message, HasSubstr("The shortest motion found takes"));
  EXPECT_GT(r.shortest_duration, 2.0);
  // A duration of 2 % more is feasible, one of 2 % less is not.
  c.problem.duration = {1.02 * r.shortest_duration, 1.02 * r.shortest_duration};
  const OptimizeResult slower = optimize(c.model, c.problem, c.seeds, quick());
  EXPECT_EQ(slower.status, OptimizeStatus::kOptimal) << slower.message;
  EXPECT_LE(worst_excess(slower.checks), 1e-4);
  c.problem.duration = {0.98 * r.shortest_duration, 0.98 * r.shortest_duration};
  EXPECT_EQ(optimize(c.model, c.problem, c.seeds, quick()).status, OptimizeStatus::kInfeasible);
}

TEST(Optimize, AConvergedStartWhoseMotionViolatesALimitNamesIt) {
  Case c = lift_case();
  c.problem.payload =
      9e3;  // more than the pump's pressure can lift; the first solve has no row for that limit
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, quick());
  ASSERT_EQ(r.status, OptimizeStatus::kInfeasible) << r.message;
  EXPECT_THAT(r.message, HasSubstr("Worst: pressure of pump"));
  ASSERT_FALSE(r.starts.empty());
  int named = 0;
  for (const StartResult& s : r.starts) {
    EXPECT_NE(s.status, NlpStatus::kOptimal) << s.seed;
    if (s.message.find("violates a limit: pressure of pump") != std::string::npos) ++named;
  }
  EXPECT_GT(named, 0);
}

TEST(Optimize, AMotionOfNoConvergedSolveIsFeasibleAndNotOptimal) {
  Case c = lift_case();
  OptimizeOptions options = quick();
  options.phase_iterations = options.smooth_iterations = 2;  // so that no solve can converge
  options.sequential_starts = options.grid_starts = options.sequence_rounds = 0;
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_EQ(r.status, OptimizeStatus::kFeasible) << r.message;
  EXPECT_STREQ(to_string(r.status), "feasible");
  EXPECT_THAT(r.message, HasSubstr("no solve converged"));
  EXPECT_TRUE(std::isnan(r.mesh_error)) << "a guess has no mesh error";
  EXPECT_LE(worst_excess(r.checks), 1e-3);
  const OptimizeResult whole = optimize(c.model, c.problem, c.seeds, quick());
  EXPECT_EQ(whole.status, OptimizeStatus::kOptimal);
  EXPECT_TRUE(whole.starts[static_cast<std::size_t>(whole.best_start)].converged);
  EXPECT_LT(whole.energy.total, r.energy.total);
  EXPECT_GE(whole.motion.size(), quick().intervals) << "the mesh asked for, not that of the search";
}

TEST(Optimize, SeedsAreSolvedOnlyWhereTheyCanLeadToABetterMotion) {
  const Case c = lift_case();
  const auto solved = [&](const OptimizeResult& r) {
    return std::count_if(r.starts.begin(), r.starts.end(), [&](const StartResult& s) {
      return std::any_of(c.seeds.begin(), c.seeds.end(),
                         [&](const SeedMotion& seed) { return seed.name == s.seed; });
    });
  };
  const auto all = static_cast<std::ptrdiff_t>(c.seeds.size());
  OptimizeOptions options = quick();
  const OptimizeResult usual = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_GT(usual.best_seed_energy, options.seeds_within * usual.energy.total) << "the case bites";
  EXPECT_EQ(solved(usual), 0);
  options.seeds_within = 10.0;
  const OptimizeResult with_all = optimize(c.model, c.problem, c.seeds, options);
  EXPECT_EQ(solved(with_all), all);
  EXPECT_NEAR(usual.energy.total / with_all.energy.total, 1.0, 1e-4);
  // Where nothing else is there, or something else is minimised, they are what there is.
  options = quick();
  options.sequential_starts = options.grid_starts = 0;
  EXPECT_EQ(solved(optimize(c.model, c.problem, c.seeds, options)), all);
  Case gentle = lift_case();
  gentle.problem.objective.commands = 1e3;
  options = quick();
  options.sequence_rounds = 0;
  EXPECT_EQ(solved(optimize(gentle.model, gentle.problem, gentle.seeds, options)), all);
  // A seed that is nearly the optimum, as that of a warm start, is solved.
  const std::vector<SeedMotion> warm = {{c.seeds.front().name, usual.motion, 0.0, false}};
  EXPECT_EQ(solved(optimize(c.model, c.problem, warm, quick())), 1);
}

TEST(Optimize, BesideAWallPlanesComeNearerThanTheSmoothRowsAndKeepTheClearance) {
  Case c;
  c.problem = load_problem(bundled_file("reaches/loader_crane_over_wall.yaml"));
  c.model = test_support::synthetic_model(c.problem.machine);
  OptimizeOptions options = quick();
  options.sequential_starts = 2;
  options.sequence_rounds = 0;
  const OptimizeResult planes = optimize(c.model, c.problem, {}, options);
  options.plane_solves = 0;
  const OptimizeResult smooth = optimize(c.model, c.problem, {}, options);
  ASSERT_EQ(planes.status, OptimizeStatus::kOptimal) << planes.message;
  ASSERT_GT(smooth.energy.total, 0.0) << smooth.message;
  // On the bundled model they save 1.5 %.
  EXPECT_LT(planes.energy.total, 0.995 * smooth.energy.total);
  for (const int refine : {16, 37})
    EXPECT_LE(worst_excess(check_limits(c.model, c.problem, planes.motion, refine)), 1e-5);
}

TEST(Optimize, WithoutSeedsItStartsFromTheGrid) {
  const Case c = lift_case();
  const OptimizeResult with = optimize(c.model, c.problem, c.seeds, quick());
  const OptimizeResult without = optimize(c.model, c.problem, {}, quick());
  ASSERT_EQ(without.status, OptimizeStatus::kOptimal) << without.message;
  // The seeds differ, the grid and its sequences are the same, and so is the valley they lead to.
  EXPECT_NEAR(without.energy.total / with.energy.total, 1.0, 2e-3);
  MotionProblem nowhere = c.problem;
  nowhere.goal = TipGoal{{30.0, 0.0, 3.0}};
  const OptimizeResult none = optimize(c.model, nowhere, {}, quick());
  EXPECT_EQ(none.status, OptimizeStatus::kInfeasible);
  EXPECT_THAT(none.message, HasSubstr("no posture"));
}

TEST(Optimize, ALongWindowOfDurationsIsUsedToItsEnd) {
  Case c = lift_case();
  c.seeds.resize(1);
  OptimizeOptions options = quick();
  options.sequential_starts = 1;
  options.grid_starts = options.smooth_starts = options.sequence_rounds = 0;
  const double longest = 9.0 * c.seeds[0].shortest_duration;
  c.problem.duration = {1.0, longest};
  c.problem.idle_power = 0.0;
  const OptimizeResult r = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_GE(r.best_start, 0) << r.message;
  // Slower is cheaper without idle power; six times the shortest seed was once the end.
  EXPECT_GT(r.duration, 0.98 * longest);
}

TEST(Optimize, IdlePowerShortensAFreeMotion) {
  Case c = lift_case();
  c.problem.duration = {0.0, std::numeric_limits<double>::infinity()};
  OptimizeOptions options = quick();
  options.sequential_starts = 2;
  c.seeds.resize(1);
  c.problem.idle_power = 200.0;
  // Of the two searches from different durations none sets the share back, and both are seen in it.
  std::vector<double> shares;
  options.progress = [&](double share, const std::string&) { shares.push_back(share); };
  const OptimizeResult patient = optimize(c.model, c.problem, c.seeds, options);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  ASSERT_GT(shares.size(), 10U);
  EXPECT_LT(shares[shares.size() / 2], 0.8);
  EXPECT_LE(shares.back(), 1.0);
  options.progress = {};
  c.problem.idle_power = 20e3;
  const OptimizeResult hurried = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_EQ(patient.status, OptimizeStatus::kOptimal) << patient.message;
  ASSERT_EQ(hurried.status, OptimizeStatus::kOptimal) << hurried.message;
  EXPECT_LT(hurried.duration, patient.duration);
  // Each duration is the better one at its own idle power, up to the search's 2 % of the duration.
  EXPECT_LE(hurried.energy.total + 20e3 * hurried.duration,
            1.02 * (patient.energy.total + 20e3 * patient.duration));
}

TEST(Optimize, AModelWithoutAPressureIsRefusedByName) {
  Case c = lift_case();
  c.model.cylinders[1].retract = GaussianProcess();
  try {
    optimize(c.model, c.problem, c.seeds, quick());
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("jib retract"));
  }
}

TEST(Optimize, ChildProcessesGiveWhatThisProcessGives) {
  const Case c = lift_case();
  OptimizeOptions options = quick();
  const OptimizeResult here = optimize(c.model, c.problem, c.seeds, options);
  options.processes = 2;
  const OptimizeResult there = optimize(c.model, c.problem, c.seeds, options);
  ASSERT_EQ(here.starts.size(), there.starts.size());
  for (std::size_t i = 0; i < here.starts.size(); ++i) {
    EXPECT_EQ(here.starts[i].energy_exact, there.starts[i].energy_exact) << here.starts[i].seed;
    EXPECT_EQ(here.starts[i].iterations, there.starts[i].iterations);
  }
}

TEST(SequentialModes, NeverMoveTwoCylindersAndReachTheGoal) {
  const Case c = lift_case();
  const VectorXd times = VectorXd::LinSpaced(81, 0.0, 16.0);
  std::vector<VectorXd> ends;
  for (const SeedMotion& s : c.seeds)
    ends.emplace_back(s.motion.q.row(s.motion.size() - 1).transpose());
  const std::vector<ModeCandidate> candidates =
      sequential_candidates(c.model, c.problem, times, ends, 50);
  ASSERT_GE(candidates.size(), 2u);
  for (const ModeCandidate& m : candidates) {
    for (Eigen::Index k = 0; k < m.modes.rows(); ++k) {
      EXPECT_LE((m.modes.row(k).array() != CylinderMode::kRest).count(), 1) << m.name;
    }
    const VectorXd end = m.guess.q.row(m.guess.size() - 1).transpose();
    EXPECT_LT((tip_position<double>(c.problem.machine, end) - std::get<TipGoal>(c.problem.goal).tip)
                  .norm(),
              1e-6);
    EXPECT_LE(exact_energy(c.model, m.guess, c.problem.payload).share_moving[2], 0.0);
  }
  EXPECT_LE(candidates.front().energy, candidates.back().energy);
}

TEST(Modes, CreepIsPutToRestAndMovesKeepTheirSign) {
  Case c = lift_case();
  Trajectory m = with_duration(c.seeds.front().motion, 16.0);
  m.qd.col(0) *= 1e-3;  // the boom now creeps by a thousandth of its way
  m.qdd.col(0) *= 1e-3;
  m.q.col(0) = c.problem.start[0] + 1e-3 * (m.q.col(0).array() - c.problem.start[0]);
  const ModeTable modes = modes_of(c.model, c.problem, m);
  EXPECT_TRUE((modes.col(0).array() == CylinderMode::kRest).all());
  TranscriptionBounds bounds;
  const Eigen::Index n = modes.rows();
  bounds.qd_lower = Eigen::MatrixXd::Constant(n + 1, 3, -1.0);
  bounds.qd_upper = Eigen::MatrixXd::Constant(n + 1, 3, 1.0);
  bounds.qdd_lower = Eigen::MatrixXd::Constant(n, 3, -1.0);
  bounds.qdd_upper = Eigen::MatrixXd::Constant(n, 3, 1.0);
  apply_modes(c.model, modes, bounds);
  EXPECT_TRUE((bounds.qd_lower.col(0).array() == 0.0).all());
  EXPECT_TRUE((bounds.qd_upper.col(0).array() == 0.0).all());
  const double way = m.q(n, 1) - m.q(0, 1);
  const auto& held = way > 0.0 ? bounds.qd_lower : bounds.qd_upper;
  EXPECT_TRUE((held.col(1).array() == 0.0).any());
}

TEST(ExactEnergy, OneHorizontalCylinderByHand) {
  // p = 50 bar at any flow, margin 10 bar, no load: E = 60 bar * A * travel, of which 10 bar are throttled.
  const Machine machine = parse_machine(
      "name: slide\njoints:\n  - {name: x, type: prismatic, parent: base, axis: [1, 0, 0], "
      "position: [0, 2], velocity: [-1, 1], "
      "acceleration: [-1, 1]}\ntip: {joint: x, xyz: [0, 0, 0]}\nlinks:\n  - {name: sled, joint: x, "
      "mass: 100, cog: [0, 0, 0], inertia: 0}\n"
      "cylinders:\n  - {name: x, joint: x, bore: 0.1, rod: 0.05, linkage: {type: direct}}\n"
      "pumps:\n  - {name: main, feeds: [x], max_flow_lpm: 600, max_pressure_bar: 300, standby_bar: "
      "20}\nvalves: []\n",
      "slide", ".");
  CraneModel model = CraneModel::untrained(machine);
  GpParameters p;
  p.mean_constant = 50e5;
  p.flow = p.force = p.weight = Eigen::ArrayXd::Zero(1);
  model.cylinders[0].extend = model.cylinders[0].retract = GaussianProcess(p);
  model.cylinders[0].margin = 10e5;
  Trajectory m;
  m.t = (VectorXd(3) << 0.0, 1.0, 2.0).finished();
  m.q = (Eigen::MatrixXd(3, 1) << 0.0, 0.25, 0.5).finished();
  m.qd = (Eigen::MatrixXd(3, 1) << 0.0, 0.5, 0.0).finished();
  m.qdd = (Eigen::MatrixXd(3, 1) << 0.5, -0.5, -0.5).finished();
  const MotionEnergy e = exact_energy(model, m, 0.0);
  const double volume = machine.cylinders[0].area_piston() * 0.5;
  EXPECT_NEAR(e.total, 60e5 * volume,
              1e-9 * e.total);  // the midpoint rule is exact for linear power
  EXPECT_NEAR(e.throttling[0], 10e5 * volume, 1e-9 * e.total);
  EXPECT_NEAR(e.useful[0] + e.throttling[0], e.total, 1e-9 * e.total);
  EXPECT_NEAR(e.share_moving[1], 1.0, 1e-12);
}

TEST(MotionTable, RoundTripAndBrokenFiles) {
  const Case c = lift_case();
  const Trajectory m = with_duration(c.seeds.front().motion, 16.0);
  const std::string path = ::testing::TempDir() + "motion.csv";
  write_file_atomically(path, motion_csv(c.model, m, c.problem.payload));
  const Trajectory back = load_motion(path, c.problem.machine);
  EXPECT_LT((back.q - m.q).cwiseAbs().maxCoeff(), 1e-10);  // twelve digits
  EXPECT_LT((back.qd - m.qd).cwiseAbs().maxCoeff(), 1e-10);
  const auto message = [&](const std::string& text) {
    write_file_atomically(path, text);
    try {
      load_motion(path, c.problem.machine);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(message("t_s\n"), HasSubstr("a header and at least two rows"));
  EXPECT_THAT(message("t_s,q_bom_rad\n0,1\n1,1\n"),
              HasSubstr("column is missing; did you mean \"q_bom_rad\"?"));
  std::string good = motion_csv(c.model, m, 0.0);
  const std::size_t second = good.find('\n', good.find('\n') + 1) + 1;
  std::string wrong = good;
  wrong.replace(second, 3, "abc");
  EXPECT_THAT(message(wrong), HasSubstr(":3: t_s: got \"abc"));
  wrong = good.substr(0, second) + good.substr(good.find('\n') + 1);
  EXPECT_THAT(message(wrong), HasSubstr("time must increase"));
}

TEST(ChildProcesses, ResultsExceptionsAndCrashesComeBack) {
  const auto work = [](int i) -> std::string {
    if (i == 1) throw std::runtime_error("no luck");
    if (i == 2) ::_exit(3);
    return std::string(static_cast<std::size_t>(i) * 100000 + 1,
                       'x');  // larger than a pipe's buffer
  };
  int calls = 0;
  const std::vector<ChildResult> r =
      run_in_children(4, 2, work, [&](int, int, const ChildResult&) { ++calls; });
  EXPECT_TRUE(r[0].ok);
  EXPECT_EQ(r[0].bytes, "x");
  EXPECT_EQ(r[1].error, "no luck");
  EXPECT_FALSE(r[2].ok);
  EXPECT_EQ(r[2].error, "the solve ended without a result");
  EXPECT_EQ(r[3].bytes.size(), 300001u);
  EXPECT_EQ(calls, 4);
}

}  // namespace
}  // namespace sparflow
