// Motions that begin and end moving.
#include <gtest/gtest.h>

#include "optimizer/phases/phases.h"
#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

TEST(EndVelocity, IsThatOfTheProblemAndAllLimitsAreKept) {
  MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  const Eigen::Vector3d goal(0.5, -1.0, 2.0);
  problem.goal = JointGoal{goal};
  problem.start_velocity = Eigen::Vector3d(0.0, 0.06, 0.0);
  problem.goal_velocity = Eigen::Vector3d(0.0, 0.0, 0.1);
  const CraneModel model = test_support::synthetic_model(problem.machine);
  OptimizeOptions options;
  options.intervals = 60;
  options.search_intervals = 40;
  options.sequential_starts = 3;
  options.sequence_rounds = 1;
  const OptimizeResult r = optimize(model, problem, {}, options);
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  EXPECT_LE(worst_excess(r.checks), options.limit_tolerance);
  const Trajectory& m = r.motion;
  EXPECT_EQ(Eigen::VectorXd(m.qd.row(0)), problem.start_velocity);
  EXPECT_EQ(Eigen::VectorXd(m.qd.row(m.size() - 1)), problem.goal_velocity);
  EXPECT_EQ(Eigen::VectorXd(m.q.row(0)), problem.start);
  EXPECT_EQ(Eigen::VectorXd(m.q.row(m.size() - 1)), Eigen::VectorXd(goal));
}

TEST(EndVelocity, PhasesThatLackItAreAddedAndOthersStay) {
  PhasePlan plan;
  plan.modes.resize(2, 2);
  plan.modes << CylinderMode::kExtend, CylinderMode::kRest, CylinderMode::kRest,
      CylinderMode::kRetract;
  plan.durations = Eigen::Vector2d(2.0, 3.0);
  const std::vector<CylinderMode> rest = {CylinderMode::kRest, CylinderMode::kRest};
  const std::vector<CylinderMode> second = {CylinderMode::kRest, CylinderMode::kRetract};
  EXPECT_EQ(with_moving_ends(plan, rest, second, 0.5).count(), 2);
  const PhasePlan wider = with_moving_ends(plan, second, rest, 0.5);
  ASSERT_EQ(wider.count(), 3);
  EXPECT_EQ(wider.modes(0, 1), CylinderMode::kRetract);
  EXPECT_EQ(wider.modes(0, 0), CylinderMode::kRest);
  EXPECT_NEAR(wider.total(), 5.0, 1e-12);
}

}  // namespace
}  // namespace sparflow
