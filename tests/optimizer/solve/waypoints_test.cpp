// Waypoints of the tip are read, planned and passed.
#include <gtest/gtest.h>

#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;

double nearest(const MotionProblem& problem, const Trajectory& motion, const Vector3d& point,
               double* when) {
  double best = 1e9;
  for (Eigen::Index k = 0; k < motion.size(); ++k) {
    const Eigen::VectorXd q = motion.q.row(k).transpose();
    const double d = (tip_position<double>(problem.machine, q) - point).norm();
    if (d >= best) continue;
    best = d;
    *when = motion.t[k];
  }
  return best;
}

TEST(Waypoints, ArePassedInOrderAtOptimisedInstants) {
  MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  problem.waypoints = {Vector3d(5.0, 0.0, 3.0), Vector3d(6.5, 0.0, 4.3)};
  problem.duration = {20.0, 20.0};
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const Eigen::MatrixXd path = [&] {  // a path through solved postures, without planners/
    Eigen::MatrixXd p(4, 3);
    Eigen::VectorXd q = problem.start;
    p.row(0) = q.transpose();
    int row = 1;
    for (const Vector3d& tip :
         {problem.waypoints[0], problem.waypoints[1], std::get<TipGoal>(problem.goal).tip}) {
      EXPECT_TRUE(solve_end_posture(problem.machine, problem.limits, tip, {true, true, true}, q));
      p.row(row++) = q.transpose();
    }
    return p;
  }();
  const TimedMotion timed = time_parametrise(problem, path, 0.0);
  OptimizeOptions options;
  options.intervals = 60;
  options.search_intervals = 40;
  options.processes = 1;
  const OptimizeResult r =
      optimize(model, problem, {{"through", timed.motion, timed.shortest, false}}, options);
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  double first = 0.0, second = 0.0;
  // The tolerance is that of the solver on the goal rows, in metres.
  EXPECT_LT(nearest(problem, r.motion, problem.waypoints[0], &first), 1e-5);
  EXPECT_LT(nearest(problem, r.motion, problem.waypoints[1], &second), 1e-5);
  EXPECT_LT(first, second);
  EXPECT_GT(first, 0.0);
  EXPECT_LT(second, 20.0);
  // Without waypoints the optimum is cheaper.
  problem.waypoints.clear();
  const OptimizeResult free =
      optimize(model, problem, {{"through", timed.motion, timed.shortest, false}}, options);
  EXPECT_LT(free.energy.total, r.energy.total);
  // A motion that does not pass them violates a limit.
  problem.waypoints = {Vector3d(5.0, 0.0, 3.0)};
  const std::vector<LimitCheck> checks = check_limits(model, problem, free.motion);
  EXPECT_EQ(checks.front().what, "distance of the tip from waypoint 1");
  EXPECT_GT(checks.front().excess, 1e-3);
}

}  // namespace
}  // namespace sparflow
