#include "planners/tip_goal.h"

#include <gtest/gtest.h>

#include <random>

#include "models/machine/kinematics.h"
#include "tests/problems/arms.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

VectorXd random_posture(const Machine& m, std::mt19937& engine) {
  VectorXd q(m.joint_count());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const Range& r = m.joints[static_cast<std::size_t>(i)].position;
    q[i] = std::uniform_real_distribution<double>(r.lo, r.hi)(engine);
  }
  return q;
}

TEST(TipGoal, SamplesReachRandomReachableGoals) {
  std::mt19937 engine(5);
  for (const Machine& m : {arms::loader_crane(), arms::slewing_crane(), arms::two_link()}) {
    for (int trial = 0; trial < 30; ++trial) {
      const Vector3d target = tip_position<double>(m, random_posture(m, engine));
      const MotionProblem problem = arms::problem(m, random_posture(m, engine), TipGoal{target});
      ClearanceModel clearance(problem);
      const GoalPostures goal = sample_goal(problem, clearance, 50, 7);
      ASSERT_TRUE(goal.reachable) << m.name << " trial " << trial;
      ASSERT_FALSE(goal.postures.empty());
      for (const VectorXd& q : goal.postures) {
        EXPECT_LT((tip_position<double>(m, q) - target).norm(), kTipTolerance);
        for (Eigen::Index i = 0; i < q.size(); ++i) {
          EXPECT_GE(q[i], m.joints[static_cast<std::size_t>(i)].position.lo);
          EXPECT_LE(q[i], m.joints[static_cast<std::size_t>(i)].position.hi);
        }
      }
    }
  }
}

TEST(TipGoal, NearlyAllSamplesConvergeToRounding) {
  std::mt19937 engine(6);
  const Machine m = arms::loader_crane();
  int sharp = 0, all = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d target = tip_position<double>(m, random_posture(m, engine));
    const TipSolver solver(arms::problem(m, random_posture(m, engine), TipGoal{target}));
    const Posture found = solver.solve(random_posture(m, engine), target);
    ++all;
    sharp += found.distance < 1e-9;
  }
  EXPECT_GT(sharp, 0.85 * all);  // the others end in a corner of the limits
}

TEST(TipGoal, RedundancyCountsOnlyDirectionsTheTipCanMoveIn) {
  const auto redundancy = [](const Machine& m) {
    return TipSolver(arms::problem(m, VectorXd::Zero(m.joint_count()), TipGoal{})).redundancy();
  };
  EXPECT_EQ(redundancy(arms::loader_crane()), 1);
  EXPECT_EQ(redundancy(arms::slewing_crane()), 1);
  EXPECT_EQ(redundancy(arms::two_link()), 0);
}

TEST(TipGoal, PullingStaysOnTheGoalAndComesNearer) {
  std::mt19937 engine(8);
  const Machine m = arms::slewing_crane();
  const VectorXd scale = speed_scale(arms::problem(m, VectorXd::Zero(4), TipGoal{}));
  for (int trial = 0; trial < 50; ++trial) {
    const VectorXd truth = random_posture(m, engine), anchor = random_posture(m, engine);
    const Vector3d target = tip_position<double>(m, truth);
    const TipSolver solver(arms::problem(m, anchor, TipGoal{target}));
    const Posture pulled = solver.pull_towards({truth, target, 0.0}, anchor, target);
    EXPECT_LT((tip_position<double>(m, pulled.q) - target).norm(), 1e-9);
    EXPECT_LE((pulled.q - anchor).cwiseQuotient(scale).norm(),
              (truth - anchor).cwiseQuotient(scale).norm());
  }
}

TEST(TipGoal, SpreadPosturesAreFurthestFirst) {
  std::vector<VectorXd> line;
  for (int i = 0; i <= 10; ++i) line.push_back(VectorXd::Constant(1, i));
  std::vector<std::size_t> chosen;
  spread_out(line, VectorXd::Ones(1), 3, 0.0, chosen);
  EXPECT_EQ(chosen, (std::vector<std::size_t>{0, 10, 5}));
  spread_out(line, VectorXd::Ones(1), 100, 1.5, chosen);
  EXPECT_EQ(chosen.size(), 5u);  // 2 and 7 are 2 away, then all are within 1
}

}  // namespace
}  // namespace sparflow
