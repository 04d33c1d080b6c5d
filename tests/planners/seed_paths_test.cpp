#include "planners/seed_paths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "models/machine/kinematics.h"
#include "planners/tip_goal.h"
#include "problems/clearance.h"
#include "tests/problems/arms.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::HasSubstr;

VectorXd vec(std::initializer_list<double> values) {
  VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.data());
  return v;
}

/// A reach of the loader crane: from low and far to high and near.
MotionProblem crane_reach() {
  return arms::problem(arms::loader_crane(), vec({0.2, -1.6, 0.8}), TipGoal{{5.5, 0, 4.5}});
}

void expect_good_path(const MotionProblem& problem, const SeedPath& seed) {
  ASSERT_GE(seed.path.rows(), 2);
  ASSERT_EQ(seed.path.cols(), problem.machine.joint_count());
  EXPECT_EQ(seed.path.row(0).transpose(), problem.start);
  const VectorXd end = seed.path.bottomRows(1).transpose();
  if (const auto* goal = std::get_if<TipGoal>(&problem.goal)) {
    EXPECT_LT((tip_position<double>(problem.machine, end) - goal->tip).norm(), kTipTolerance);
  } else {
    EXPECT_EQ(end, std::get<JointGoal>(problem.goal).q);
  }
  EXPECT_NEAR(seed.length, path_length(seed.path, speed_scale(problem)), 1e-9);
  // Every leg is checked at 500 points by the exact distance; the motion check may miss at most 1 mm.
  ClearanceModel clearance(problem);
  for (Eigen::Index k = 0; k + 1 < seed.path.rows(); ++k) {
    for (int i = 0; i <= 500; ++i) {
      const VectorXd q = seed.path.row(k) + (seed.path.row(k + 1) - seed.path.row(k)) * (i / 500.0);
      EXPECT_GT(clearance.nearest(q.data()).distance, -1e-3);
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Range& range = problem.limits.position[static_cast<std::size_t>(j)];
        EXPECT_GE(q[j], range.lo - 1e-12);
        EXPECT_LE(q[j], range.hi + 1e-12);
      }
    }
  }
}

TEST(SeedPaths, FreeSpaceGivesStraightLinesToSeveralPosturesAndOnesWithAJointAtRest) {
  const MotionProblem problem = crane_reach();
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound) << result.message;
  EXPECT_GE(result.paths.size(), 4u);
  EXPECT_LE(result.paths.size(), 8u);
  EXPECT_GT(result.end_postures, 50);
  int straight = 0;
  bool held = false;
  for (const SeedPath& seed : result.paths) {
    expect_good_path(problem, seed);
    straight += seed.planner == "straight line";
    const VectorXd moved = seed.path.bottomRows(1).transpose() - problem.start;
    held = held || moved.cwiseAbs().minCoeff() == 0.0;
  }
  EXPECT_GE(straight, 3);
  EXPECT_TRUE(held);
  for (std::size_t a = 0; a < result.paths.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const MatrixXd ends_differ =
          result.paths[a].path.bottomRows(1) - result.paths[b].path.bottomRows(1);
      EXPECT_GT(ends_differ.norm(), 1e-3);
    }
  }
}

TEST(SeedPaths, ShortestStraightLineIsTheNearestPostureOnTheGoalCurve) {
  // The crane's goal region is a curve; it is scanned by the extension and compared with the samples.
  const MotionProblem problem = crane_reach();
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound);
  const VectorXd scale = speed_scale(problem);
  const Vector3d target = std::get<TipGoal>(problem.goal).tip;
  double least = 1e9;
  for (int i = 0; i <= 60000; ++i) {
    const double extension = 6.0 * i / 60000;
    const double inner = 3.4, outer = 3.0 + extension;
    const Vector3d d = target - Vector3d(0, 0, 2);
    const double c = (d.squaredNorm() - inner * inner - outer * outer) / (2 * inner * outer);
    if (std::abs(c) > 1.0) continue;
    const double jib = -std::acos(c);
    const double boom =
        std::atan2(d.z(), d.x()) - std::atan2(outer * std::sin(jib), inner + outer * std::cos(jib));
    if (boom < -0.2 || boom > 1.35 || jib < -2.3) continue;
    least =
        std::min(least, (vec({boom, jib, extension}) - problem.start).cwiseQuotient(scale).norm());
  }
  double found = 1e9;
  for (const SeedPath& seed : result.paths) found = std::min(found, seed.length);
  // The scan's step of 0.1 mm is of second order at a smooth minimum.
  EXPECT_NEAR(found, least, 1e-4 * least);
}

TEST(SeedPaths, GoesRoundAWallThatBlocksTheStraightLine) {
  MotionProblem problem =
      arms::problem(arms::loader_crane(), vec({0.0, -0.3, 1.0}), JointGoal{vec({1.2, -1.6, 0.5})});
  problem.obstacles = {arms::box("beam", {5.2, 0, 3.0}, {0.6, 2, 0.6})};
  problem.clearance = 0.15;
  ClearanceModel clearance(problem);
  const VectorXd goal = std::get<JointGoal>(problem.goal).q;
  ASSERT_FALSE(clearance.motion_clear(problem.start.data(), goal.data()));
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound) << result.message;
  EXPECT_FALSE(result.out_of_time);
  for (const SeedPath& seed : result.paths) {
    expect_good_path(problem, seed);
    EXPECT_GE(seed.path.rows(), 3);
  }
}

TEST(SeedPaths, FindsBothPathsAroundAPillarForASlewingCrane) {
  // A pillar is in front: the crane can retract or rise over it while it slews.
  MotionProblem problem =
      arms::problem(arms::slewing_crane(), vec({-0.8, 0.1, -0.6, 1.5}), TipGoal{{5.0, 5.0, 2.0}});
  problem.obstacles = {arms::box("pillar", {6.0, 0, 2.0}, {0.8, 0.8, 6.0})};
  problem.clearance = 0.2;
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound) << result.message;
  EXPECT_GE(result.paths.size(), 3u);
  std::set<std::string> planners;
  for (const SeedPath& seed : result.paths) {
    expect_good_path(problem, seed);
    planners.insert(seed.planner);
  }
  EXPECT_TRUE(planners.count("RRT-Connect"));
  EXPECT_FALSE(planners.count("BIT*")) << "OMPL 1.5.2 crashes where it publishes a solution";
}

TEST(SeedPaths, SameSeedSamePathsOtherSeedOtherPaths) {
  MotionProblem problem = crane_reach();
  problem.obstacles = {arms::box("beam", {5.6, 0, 2.6}, {0.5, 2, 0.5})};
  SeedOptions options;
  options.seconds = 60.0;  // so that iterations end the search
  const SeedResult a = find_seed_paths(problem, options);
  const SeedResult b = find_seed_paths(problem, options);
  ASSERT_EQ(a.status, SeedStatus::kFound) << a.message;
  ASSERT_EQ(a.paths.size(), b.paths.size());
  for (std::size_t i = 0; i < a.paths.size(); ++i) {
    EXPECT_EQ(a.paths[i].planner, b.paths[i].planner);
    EXPECT_EQ(a.paths[i].path, b.paths[i].path);
  }
  options.random_seed = 2;
  const SeedResult c = find_seed_paths(problem, options);
  bool differs = a.paths.size() != c.paths.size();
  for (std::size_t i = 0; !differs && i < a.paths.size(); ++i) {
    differs =
        a.paths[i].path.rows() != c.paths[i].path.rows() || a.paths[i].path != c.paths[i].path;
  }
  EXPECT_TRUE(differs);
}

TEST(SeedPaths, NonRedundantArmHasBothElbows) {
  const MotionProblem problem =
      arms::problem(arms::two_link(), vec({0.1, 0.5}), TipGoal{{2.0, 0, 1.5}});
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound) << result.message;
  EXPECT_EQ(result.end_postures, 2);
  ASSERT_EQ(result.paths.size(), 2u);
  const double elbow_a = result.paths[0].path(result.paths[0].path.rows() - 1, 1);
  const double elbow_b = result.paths[1].path(result.paths[1].path.rows() - 1, 1);
  EXPECT_NEAR(elbow_a, -elbow_b, 1e-9);
}

TEST(SeedPaths, NamesAnUnreachableGoalWithTheNearestPoint) {
  MotionProblem problem = crane_reach();
  problem.goal = TipGoal{{20, 0, 2}};
  const SeedResult result = find_seed_paths(problem);
  EXPECT_EQ(result.status, SeedStatus::kGoalUnreachable);
  // The arm is stretched out at the height of the boom pin: 3.4 + 3 + 6 m.
  EXPECT_NEAR(result.miss, 20 - 12.4, 1e-4);
  EXPECT_NEAR(result.nearest_tip.x(), 12.4, 1e-4);
  EXPECT_THAT(result.message, HasSubstr("out of reach"));
  EXPECT_THAT(result.message, HasSubstr("7.600 m away"));
  EXPECT_TRUE(result.paths.empty());

  problem.goal = TipGoal{{6, 1, 2}};  // outside the crane's plane, where y = 0 is nearest
  const SeedResult sideways = find_seed_paths(problem);
  EXPECT_EQ(sideways.status, SeedStatus::kGoalUnreachable);
  EXPECT_NEAR(sideways.miss, 1.0, 1e-6);
}

TEST(SeedPaths, NamesCollisionsAndLimits) {
  MotionProblem problem = crane_reach();
  problem.obstacles = {arms::sphere("tank", {2.0, 0, 2.4}, 0.5)};
  const SeedResult start = find_seed_paths(problem);
  EXPECT_EQ(start.status, SeedStatus::kStartInCollision);
  EXPECT_THAT(start.message, HasSubstr("boom"));
  EXPECT_THAT(start.message, HasSubstr("tank"));
  EXPECT_LT(start.clearance, 0.0);

  problem.obstacles = {arms::box("roof", {5.5, 0, 4.5}, {1, 4, 1})};
  const SeedResult goal = find_seed_paths(problem);
  EXPECT_EQ(goal.status, SeedStatus::kGoalInCollision);
  EXPECT_THAT(goal.message, HasSubstr("roof"));

  problem = crane_reach();
  problem.start[0] = 1.5;
  const SeedResult limits = find_seed_paths(problem);
  EXPECT_EQ(limits.status, SeedStatus::kStartOutOfLimits);
  EXPECT_THAT(limits.message, HasSubstr("boom: got 1.5 rad, expected -0.2 to 1.35 rad"));

  problem = crane_reach();
  problem.goal = JointGoal{vec({0.2, -1.0, 7.0})};
  const SeedResult beyond = find_seed_paths(problem);
  EXPECT_EQ(beyond.status, SeedStatus::kGoalOutOfLimits);
  EXPECT_THAT(beyond.message, HasSubstr("extension: got 7 m"));
}

TEST(SeedPaths, AnArmWithoutAWayOutGivesNoPath) {
  // A two-link arm is folded between two plates that it cannot leave; the goal on the other side is clear.
  MotionProblem problem =
      arms::problem(arms::two_link(), vec({-1.2, 0.0}), JointGoal{vec({1.2, 0.0})});
  problem.obstacles = {arms::half_space("none", {0, 0, -50}, {0, 0, 1}),
                       arms::box("front", {2.0, 0, 0}, {2.0, 2, 0.4}),
                       arms::box("back", {-2.0, 0, 0}, {2.0, 2, 0.4})};
  problem.clearance = 0.05;
  SeedOptions options;
  options.iterations = 3000;
  const SeedResult result = find_seed_paths(problem, options);
  EXPECT_EQ(result.status, SeedStatus::kNoPath) << result.message;
  EXPECT_THAT(result.message, HasSubstr("no path found"));
}

TEST(SeedPaths, TipLineKeepsTheTipOnTheLine) {
  MotionProblem problem = crane_reach();
  problem.tip_line = TipLine{0.02};
  const Vector3d from = tip_position<double>(problem.machine, problem.start);
  const Vector3d along = (std::get<TipGoal>(problem.goal).tip - from).normalized();
  const SeedResult result = find_seed_paths(problem);
  ASSERT_EQ(result.status, SeedStatus::kFound) << result.message;
  EXPECT_GE(result.paths.size(), 2u);
  for (const SeedPath& seed : result.paths) {
    EXPECT_EQ(seed.planner, "tip line");
    expect_good_path(problem, seed);
    for (Eigen::Index k = 0; k + 1 < seed.path.rows(); ++k) {
      for (int i = 0; i <= 10; ++i) {
        const VectorXd q =
            seed.path.row(k) + (seed.path.row(k + 1) - seed.path.row(k)) * (i / 10.0);
        const Vector3d off = tip_position<double>(problem.machine, q) - from;
        EXPECT_LT((off - along * along.dot(off)).norm(), 0.02);
      }
    }
  }
}

TEST(SeedPaths, ReportsProgressAndStopsInTime) {
  MotionProblem problem = crane_reach();
  problem.obstacles = {arms::box("beam", {5.6, 0, 2.6}, {0.5, 2, 0.5})};
  SeedOptions options;
  options.seconds = 0.0;
  double last = -1.0;
  options.progress = [&](double share, const std::string&) {
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1.0);
    last = share;
  };
  const SeedResult result = find_seed_paths(problem, options);
  EXPECT_GE(last, 0.0);
  EXPECT_TRUE(result.out_of_time);
}

}  // namespace
}  // namespace sparflow
