// A motion planned anew on the way: it begins where the machine is and as fast, keeps its goal, and costs no more than going on.
#include "optimizer/solve/replan.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "models/files/model_file.h"
#include "optimizer/crane/exact_energy.h"
#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"

namespace sparflow {
namespace {

class Replan : public ::testing::Test {
 protected:
  Replan() : model_(load_model(bundled_file("models/loader_crane.json"))) {
    problem_ = load_problem(bundled_file("reaches/loader_crane_short_hop.yaml"), &model_.machine);
    OptimizeOptions options;
    options.intervals = 40;
    options.processes = 1;
    options.sequence_rounds = 0;
    motion_ = optimize(model_, problem_, {}, options).motion;
  }
  Underway at(double t) const {
    const Trajectory now = resampled(motion_, Eigen::Vector2d(t, t + 1e-3));
    return {&motion_, t, now.q.row(0), now.qd.row(0)};
  }
  CraneModel model_;
  MotionProblem problem_;
  Trajectory motion_;
};

TEST_F(Replan, BeginsWhereTheMachineIsAndEndsAtTheGoalInTime) {
  ASSERT_GT(motion_.size(), 2);
  const double t = 0.4 * motion_.duration();
  Underway now = at(t);
  for (Eigen::Index j = 0; j < now.q.size(); ++j)
    if (std::abs(now.qd[j]) > 1e-3) now.q[j] -= 0.05 * now.qd[j];  // 50 ms late
  const std::optional<Trajectory> next = replan(model_, problem_, now);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->duration(), motion_.duration() - t, 1e-9);
  EXPECT_LT((next->q.row(0).transpose() - now.q).norm(), 1e-6);
  EXPECT_LT((next->qd.row(0).transpose() - now.qd).norm(), 1e-6);
  EXPECT_GT(now.qd.norm(), 0.01);  // it was moving
  const Eigen::Index last = next->size() - 1;
  EXPECT_LT(next->qd.row(last).norm(), 1e-6);
  problem_.start = now.q;
  const std::vector<LimitCheck> checks = check_limits(model_, problem_, *next);
  const auto goal = std::find_if(checks.begin(), checks.end(), [](const LimitCheck& c) {
    return c.what == "distance of the tip from its goal";
  });
  ASSERT_NE(goal, checks.end());
  EXPECT_LT(goal->value, 1e-4);  // [m] the solve's tolerance
}

TEST_F(Replan, FromTheMotionItselfItGoesOnAsCheaply) {
  const double t = 0.3 * motion_.duration();
  const std::optional<Trajectory> next = replan(model_, problem_, at(t));
  ASSERT_TRUE(next);
  const Eigen::VectorXd rest_times = Eigen::VectorXd::LinSpaced(200, t, motion_.duration());
  const double rest = exact_total_energy(model_, resampled(motion_, rest_times), problem_.payload);
  const double planned = exact_total_energy(model_, *next, problem_.payload);
  // another mesh and a smoothed maximum: two per cent
  EXPECT_NEAR(planned, rest, 0.02 * rest);
}

TEST_F(Replan, SaysThatThereIsNoneWhereTheGoalCannotBeReachedInTheTimeLeft) {
  Underway now = at(0.9 * motion_.duration());
  now.q[2] += 1.0;  // [m] of the telescope, in half a second
  EXPECT_FALSE(replan(model_, problem_, now));
}

}  // namespace
}  // namespace sparflow
