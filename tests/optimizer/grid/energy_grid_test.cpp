// Grid paths against closed forms, the exact law and the limits.
#include "optimizer/grid/energy_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "models/files/model_file.h"
#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/grid/driven_grid_path.h"
#include "optimizer/grid/simplify_path.h"
#include "optimizer/phases/sequential_modes.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct GridCase {
  MotionProblem problem;
  CraneModel model;
  explicit GridCase(const std::string& reach)
      : problem(load_problem(bundled_file("reaches/" + reach + ".yaml"))),
        model(test_support::synthetic_model(problem.machine)) {}
};

Trajectory straight_line(const MotionProblem& problem, const CraneModel& model,
                         const VectorXd& end) {
  GridPath line;
  line.found = true;
  line.corners.resize(2, end.size());
  line.corners << problem.start.transpose(), end.transpose();
  line.leg_durations = VectorXd::Constant(1, 1.0);
  return timed_grid_path(model, problem, line, 60.0);
}

TEST(EnergyGrid, EndsAtTheGoalWithinAllLimitsAtItsShortestDurationAndAnyLonger) {
  for (const char* reach : {"loader_crane_lift", "loader_crane_unfold", "swing_crane_load"}) {
    GridCase c(reach);
    c.problem.tip_line.reset();
    EnergyGrid grid(c.model, c.problem, {12000, 4});
    for (const double price : {0.0, 3e3, 1e5}) {
      const GridPath path = grid.cheapest_path(price);
      ASSERT_TRUE(path.found) << reach << ": " << path.message;
      EXPECT_NEAR(path.leg_durations.sum(), path.duration_s, 1e-9);
      ASSERT_EQ(path.modes.rows(), path.corners.rows() - 1);
      for (const double slower : {1.0, 1.7}) {
        const Trajectory motion =
            timed_grid_path(c.model, c.problem, path, slower * path.duration_s);
        for (const LimitCheck& check : check_limits(c.model, c.problem, motion, 23)) {
          // The grid checks pump pressure along whole moves only, and no clearance during ramps.
          if (check.what.starts_with("pressure")) continue;
          const double slack = check.what.starts_with("clearance") ? 0.02 : 1e-4;
          EXPECT_LE(check.excess, slack) << reach << ", price " << price << ": " << check.what;
        }
      }
    }
  }
}

TEST(EnergyGrid, ConstantPressureCostsPressureTimesVolumeOnEveryPath) {
  GridCase c("hmf_reach");
  ASSERT_EQ(c.problem.machine.pumps[0].type, PumpType::kConstantPressure);
  const VectorXd start = c.problem.start;
  VectorXd end = start;
  end[0] += 0.3;
  end[1] += 0.5;
  c.problem.goal = JointGoal{end};
  c.problem.obstacles.clear();
  double volume = 0.0;
  for (int i = 0; i < 2; ++i) {
    const double dx = cylinder_length(c.problem.machine, i, end[i]) -
                      cylinder_length(c.problem.machine, i, start[i]);
    const Cylinder& cylinder = c.problem.machine.cylinders[static_cast<std::size_t>(i)];
    volume += std::abs(dx) * (dx > 0.0 ? cylinder.area_piston() : cylinder.area_rod());
  }
  const double expected = c.model.pumps[0].standby * volume;
  EnergyGrid grid(c.model, c.problem, {2500, 4});
  for (const double price : {0.0, 1e4}) {
    const GridPath path = grid.cheapest_path(price);
    ASSERT_TRUE(path.found) << path.message;
    EXPECT_NEAR(path.slow_energy_J, expected, 1e-5 * expected);  // single precision of the moves
    // the exact law by midpoints over ramps, 4 parts an interval
    EXPECT_NEAR(path.energy_J, expected, 2e-3 * expected);
  }
}

TEST(EnergyGrid, IsCheaperThanTheStraightLineAndCheaperInLongerDurations) {
  const GridCase c("loader_crane_lift");
  EnergyGrid grid(c.model, c.problem);
  const GridPath slow = grid.cheapest_path(0.0);
  ASSERT_TRUE(slow.found);
  const Trajectory line = straight_line(c.problem, c.model, slow.corners.bottomRows(1).transpose());
  const double straight = exact_energy(c.model, line, c.problem.payload).total;
  const double timed =
      exact_energy(c.model, timed_grid_path(c.model, c.problem, slow, 60.0), c.problem.payload)
          .total;
  EXPECT_LT(timed, straight);
  // At unlimited time each leg has its own best speed, in 60 s all share one: one or two bar of fifty.
  EXPECT_NEAR(timed, slow.slow_energy_J, 0.03 * timed);
  const GridPath fast = grid.cheapest_path(1e6);
  ASSERT_TRUE(fast.found);
  EXPECT_LT(fast.duration_s, slow.duration_s);
  double last = 1e12;
  for (const double share : {1.05, 1.4, 2.0}) {
    const double duration = share * fast.duration_s;
    const GridPath path = grid.path_for_duration(duration);
    ASSERT_TRUE(path.found);
    ASSERT_LE(path.duration_s, duration * (1.0 + 1e-9));
    const double energy = exact_energy(c.model, timed_grid_path(c.model, c.problem, path, duration),
                                       c.problem.payload)
                              .total;
    EXPECT_LT(
        energy,
        last *
            1.002);  // the same path, slower, may cost a little more: P falls, then rises, with Q
    last = energy;
  }
}

TEST(EnergyGrid, CandidateHoldsItsModesAndItsCornersOnTheMesh) {
  const GridCase c("loader_crane_unfold");
  EnergyGrid grid(c.model, c.problem, {12000, 4});
  const GridPath path = grid.cheapest_path(1e3);
  ASSERT_TRUE(path.found);
  const double duration = 1.2 * path.duration_s;
  const ModeCandidate candidate = grid_path_candidate(c.model, c.problem, path, duration, 80);
  ASSERT_EQ(candidate.modes.rows(), candidate.guess.size() - 1);
  EXPECT_NEAR(candidate.guess.t[candidate.guess.size() - 1], duration, 1e-9);
  for (Eigen::Index k = 0; k < candidate.modes.rows(); ++k) {
    for (int i = 0; i < 3; ++i) {
      const double middle = 0.5 * (candidate.guess.qd(k, i) + candidate.guess.qd(k + 1, i));
      if (candidate.modes(k, i) == CylinderMode::kRest) {
        EXPECT_EQ(middle, 0.0);
        continue;
      }
      const double rate = linkage_rates(c.problem.machine, i, candidate.guess.q(k, i)).d1;
      EXPECT_EQ(rate * middle > 0.0, candidate.modes(k, i) == CylinderMode::kExtend);
    }
  }
  for (Eigen::Index corner = 0; corner < path.corners.rows(); ++corner) {
    const MatrixXd off = candidate.guess.q.rowwise() - path.corners.row(corner);
    EXPECT_LT(off.cwiseAbs().rowwise().maxCoeff().minCoeff(), 1e-9);
  }
}

TEST(EnergyGrid, GoesRoundAnObstacle) {
  GridCase c("loader_crane_over_wall");
  EnergyGrid grid(c.model, c.problem, {12000, 4});
  const GridPath path = grid.cheapest_path(0.0);
  ASSERT_TRUE(path.found) << path.message;
  ClearanceModel clearance(c.problem);
  EXPECT_TRUE(clearance.path_clear(path.corners));
  c.problem.obstacles.clear();
  EnergyGrid open(c.model, c.problem, {12000, 4});
  EXPECT_LE(open.cheapest_path(0.0).slow_energy_J, path.slow_energy_J * 1.001);
}

/// A wall across the slewing crane's reach with a square window of 0.7 m, through which the jib must pass.
MotionProblem through_a_window() {
  MotionProblem p = load_problem(bundled_file("reaches/swing_crane_far.yaml"));
  p.start = Eigen::Vector4d(-0.0046, 0.7045, -1.7787, 0.3155);
  p.goal = TipGoal{{6.2847, -1.1619, 4.14}};
  p.payload = 100.0;
  p.clearance = 0.1;
  const auto part = [&](const std::string& name, double y, double z, double width, double height) {
    Box box;
    box.center = {4.4341, y, z};
    box.size = {0.2, width, height};
    p.obstacles.push_back({name, box});
  };
  part("left", -3.1698, 3.8688, 4.0, 16.0);
  part("right", 1.5302, 3.8688, 4.0, 16.0);
  part("below", -0.8198, 1.5188, 0.72, 4.0);
  part("above", -0.8198, 6.2188, 0.72, 4.0);
  return p;
}

TEST(EnergyGrid, PathsThroughANarrowWindowAreClear) {
  // The exact check refuses lines between neighbouring corners here; this once ended in a row before the first corner.
  const MotionProblem problem = through_a_window();
  const CraneModel model = load_model(bundled_file("models/swing_crane.json"));
  EnergyGrid grid(model, problem, {15000, 4});
  const std::vector<GridPath> paths = grid.paths_for_duration(24.0, 3);
  ASSERT_FALSE(paths.empty());
  ClearanceModel clearance(problem);
  for (const GridPath& path : paths) {
    ASSERT_TRUE(path.found) << path.message;
    EXPECT_GE(path.corners.rows(), 2);
    EXPECT_TRUE(path.corners.allFinite());
    EXPECT_NEAR((path.corners.row(0).transpose() - problem.start).norm(), 0.0, 1e-12);
    EXPECT_TRUE(clearance.path_clear(path.corners));
  }
}

TEST(SimplifyPath, KeepsAndCountsALineOfThePathThatIsRefused) {
  GridCase c("loader_crane_lift");
  MatrixXd path(4, 3);
  path << 0.10, -1.6, 0.8, 0.20, -1.6, 0.8, 0.30, -1.6, 0.8, 0.40, -1.6, 0.8;
  std::vector<Range> forces(static_cast<std::size_t>(c.model.machine.cylinder_count()),
                            Range{-3e5, 3e5});
  MovePricer pricer(c.model, c.problem, c.problem.machine, forces);
  LegSearch search;
  search.leg_penalty = 10.0;
  search.part = VectorXd::Constant(3, 0.05);
  for (const Eigen::Index refused : {0, 1, 2}) {
    // Every line that passes the middle of one line of the path is refused, so that no other can replace it.
    const VectorXd middle = 0.5 * (path.row(refused) + path.row(refused + 1)).transpose();
    search.clear = [&](const VectorXd& a, const VectorXd& b) {
      const double way = (b - a).squaredNorm();
      if (way == 0.0) return true;
      const double share = std::clamp((middle - a).dot(b - a) / way, 0.0, 1.0);
      return (a + share * (b - a) - middle).norm() > 0.049;
    };
    const Legs legs = simplify_path(pricer, path, search);
    EXPECT_EQ(legs.refused, 1) << refused;
    EXPECT_TRUE(legs.corners.allFinite());
    EXPECT_EQ(legs.corners.row(0), path.row(0));
    EXPECT_EQ(legs.corners.bottomRows(1), path.bottomRows(1));
  }
}

TEST(EnergyGrid, SaysWhyThereIsNoPath) {
  GridCase c("loader_crane_lift");
  EXPECT_THAT(EnergyGrid(c.model, c.problem, {1000, 2}).cheapest_path(0.0).message,
              ::testing::HasSubstr("too many nodes"));
  c.problem.goal = TipGoal{{30.0, 0.0, 3.0}};
  const GridPath none = EnergyGrid(c.model, c.problem, {1000, 4}).path_for_duration(20.0);
  EXPECT_FALSE(none.found);
  EXPECT_THAT(none.message, ::testing::HasSubstr("no posture"));
}

TEST(EnergyGrid, FindsAGoalConfigurationAlongAJointsLimit) {
  // The goal is beside the column and far below it: the telescope reaches its limit long before the booms point down.
  GridCase c("loader_crane_fold");
  c.problem.obstacles.clear();
  c.problem.start = Eigen::Vector3d(0.537784, -1.03959, 2.14803);
  c.problem.goal = TipGoal{{0.342203630982588, 0.0, -5.8447191165577994}};
  VectorXd end = c.problem.start;
  ASSERT_TRUE(solve_end_posture(c.problem.machine, c.problem.limits,
                                std::get<TipGoal>(c.problem.goal).tip, {true, true, true}, end));
  for (Eigen::Index j = 0; j < 3; ++j) {
    const Range& r = c.problem.limits.position[static_cast<std::size_t>(j)];
    EXPECT_GE(end[j], r.lo);
    EXPECT_LE(end[j], r.hi);
  }
  const GridPath path = EnergyGrid(c.model, c.problem, {4000, 4}).cheapest_path(0.0);
  EXPECT_TRUE(path.found) << path.message;
}

TEST(EnergyGrid, DrivenPathCostsMoreThanAtUnlimitedTimeOrSaysWhyThereIsNone) {
  GridCase c("loader_crane_lift");
  const EnergyGridOptions small{12000, 4};
  const DrivenGridPath fast = driven_grid_path(c.model, c.problem, 10.0, small),
                       slow = driven_grid_path(c.model, c.problem, 60.0, small);
  ASSERT_GT(slow.energy, 0.0) << slow.message;
  EXPECT_GT(slow.energy, slow.slow_energy) << "a finite duration has flow losses";
  EXPECT_LT(slow.energy, 1.05 * slow.slow_energy);
  EXPECT_EQ(fast.slow_energy, slow.slow_energy) << "it does not depend on the duration";
  if (fast.energy > 0.0) {
    EXPECT_GT(fast.energy, slow.energy);
  }
  const DrivenGridPath never = driven_grid_path(c.model, c.problem, 1.0, small);
  EXPECT_EQ(never.energy, 0.0);
  EXPECT_THAT(never.message, ::testing::HasSubstr("this fast"));
  c.problem.limits.pressure_std = 1e3;  // a limit that the grid does not know
  const DrivenGridPath unsure = driven_grid_path(c.model, c.problem, 60.0, small);
  EXPECT_EQ(unsure.energy, 0.0);
  EXPECT_THAT(unsure.message, ::testing::HasSubstr("standard deviation of the pressure"));
  c.problem.waypoints.push_back({6.0, 0.0, 3.0});
  const DrivenGridPath none = driven_grid_path(c.model, c.problem, 60.0, small);
  EXPECT_EQ(none.slow_energy, 0.0);
  EXPECT_THAT(none.message, ::testing::HasSubstr("waypoints"));
}

TEST(DemandTable, MatchesThePressureModelAndItsLeastIsBelowItOnAFineGrid) {
  const GaussianProcess process = test_support::synthetic_process(0.02, true, 2e-3, 3e5, 5);
  const DemandTable table(process, 7e5, 2e-3, {-2e5, 2.5e5});
  EXPECT_LT(table.allowance(), 0.5e5);  // half a bar, of pressures of some hundred
  for (double force = -2e5; force <= 2.5e5; force += 1.37e3) {
    double least = 1e12;
    for (double flow = 1e-6; flow <= 2e-3; flow += 1.3e-5) {
      const double exact = process.mean(flow, force) + 7e5;
      EXPECT_NEAR(table.demand(flow, force), exact, 0.2e5);  // interpolation; data scatter by 1 bar
      least = std::min(least, exact);
    }
    EXPECT_LE(table.least(force), least);
    EXPECT_GE(table.least(force), least - 0.1e5);  // the allowance makes it at most 0.1 bar too low
  }
}

}  // namespace
}  // namespace sparflow
