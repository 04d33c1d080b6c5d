// Cycles: stops with changes of the payload as one optimisation.
#include <gtest/gtest.h>

#include "models/math/units.h"
#include "optimizer/solve/optimize_cycle.h"
#include "problems/bundled.h"
#include "problems/motion_table.h"
#include "problems/problem_file.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

MotionProblem load_work() {
  MotionProblem p = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  p.payload = 0.0;
  p.stops = {{"pick", TipGoal{{6.0, 0.0, 0.5}, 0.1}, 500.0, 2.0},
             {"place", TipGoal{{4.5, 0.0, 3.0}, 0.05}, 0.0, 0.0}};
  p.goal = JointGoal{p.start};
  p.goal_name = "return";
  p.duration = {40.0, 40.0};
  return p;
}

OptimizeOptions few_starts() {
  OptimizeOptions options;
  options.intervals = 50;
  options.search_intervals = 40;
  options.sequential_starts = 2;
  options.sequence_rounds = 1;
  options.smooth_starts = 0;
  return options;
}

Eigen::Vector3d tip_at(const MotionProblem& p, const Trajectory& m, double t) {
  const Eigen::VectorXd q = resampled(m, Eigen::VectorXd::Constant(1, t)).q.row(0).transpose();
  return tip_position<double>(p.machine, q);
}

TEST(Cycle, IsNeverDearerThanItsLegsAndKeepsWhatItsStopsAskFor) {
  const MotionProblem problem = load_work();
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const OptimizeOptions options = few_starts();
  const OptimizeResult r = optimize_cycle(model, problem, {}, options);
  ASSERT_EQ(r.status, OptimizeStatus::kOptimal) << r.message;
  EXPECT_LE(worst_excess(r.checks), options.limit_tolerance);
  ASSERT_GT(r.legwise_energy, 0.0);
  EXPECT_LE(r.energy.total, r.legwise_energy * (1.0 + 1e-9));
  EXPECT_NEAR(r.duration, 40.0, 1e-6);

  const Trajectory& m = r.motion;
  ASSERT_EQ(m.stops.size(), 2U);
  EXPECT_LE((tip_at(problem, m, m.stops[0]) - Eigen::Vector3d(6.0, 0.0, 0.5)).norm(), 0.1 + 1e-5);
  EXPECT_LE((tip_at(problem, m, m.stops[1]) - Eigen::Vector3d(4.5, 0.0, 3.0)).norm(), 0.05 + 1e-5);
  EXPECT_EQ(Eigen::VectorXd(m.q.row(m.size() - 1)), problem.start);
  // The machine rests at the first stop for two seconds.
  int resting = 0;
  for (Eigen::Index k = 0; k < m.size(); ++k) {
    if (m.t[k] < m.stops[0] || m.t[k] > m.stops[0] + 2.0 - 1e-9) continue;
    ++resting;
    EXPECT_LT(m.qd.row(k).cwiseAbs().maxCoeff(), 1e-9) << m.t[k];
  }
  EXPECT_GE(resting, 2);  // both ends of the pause are knots

  // The energy is the exact one of the legs with their payloads, and another payload gives another one.
  const std::vector<LegEnergy> legs = leg_energies(model, problem, m);
  ASSERT_EQ(legs.size(), 3U);
  double sum = 0.0;
  for (const LegEnergy& leg : legs) sum += leg.energy;
  EXPECT_NEAR(sum, r.energy.total, 1e-9 * sum);
  EXPECT_EQ(legs[0].payload, 0.0);
  EXPECT_EQ(legs[1].payload, 500.0);
  EXPECT_EQ(legs[2].payload, 0.0);
  EXPECT_NEAR(legs[1].begin, m.stops[0] + 2.0, 1e-9);
  const std::vector<CycleLeg> parts = legs_of(problem, m);
  EXPECT_NEAR(exact_total_energy(model, parts[1].motion, 500.0), legs[1].energy,
              1e-9 * legs[1].energy);
  EXPECT_GT(legs[1].energy, 1.02 * exact_total_energy(model, parts[1].motion, 0.0));
  EXPECT_EQ(payload_at(problem, m, 0.0), 0.0);
  EXPECT_EQ(payload_at(problem, m, m.stops[0] + 2.5), 500.0);
  EXPECT_EQ(payload_at(problem, m, m.stops[1] + 0.1), 0.0);
}

TEST(Cycle, ToAPlaceOutOfReachNamesTheStop) {
  MotionProblem problem = load_work();
  problem.stops[1].goal = TipGoal{{30.0, 0.0, 3.0}, 0.0};
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const OptimizeResult r = optimize_cycle(model, problem, {}, few_starts());
  EXPECT_EQ(r.status, OptimizeStatus::kInfeasible);
  EXPECT_NE(r.message.find("leg 2 of 3, to place"), std::string::npos) << r.message;
}

TEST(Cycle, ThatRestsLongerThanItMayLastSaysSo) {
  MotionProblem problem = load_work();
  problem.stops[0].dwell = 50.0;
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const OptimizeResult r = optimize_cycle(model, problem, {}, few_starts());
  EXPECT_EQ(r.status, OptimizeStatus::kInfeasible);
  EXPECT_NE(r.message.find("rests for 50 s"), std::string::npos) << r.message;
}

TEST(Cycle, ABallAroundAStopHasExactDerivatives) {
  const MotionProblem problem = load_work();
  TipNearGoal ball(problem.machine, {6.0, 0.0, 0.5}, 0.3);
  const Eigen::VectorXd q = problem.start;
  const int n = problem.machine.joint_count();
  std::vector<double> slope(3), up(3), down(3);
  ball.jacobian(q.data(), slope.data());
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
  const double one = 1.0;
  ball.add_hessian(q.data(), &one, hessian.data());
  const double h = 1e-5;
  for (int k = 0; k < n; ++k) {
    Eigen::VectorXd a = q, b = q;
    a[k] += h;
    b[k] -= h;
    double fa = 0.0, fb = 0.0;
    ball.value(a.data(), &fa);
    ball.value(b.data(), &fb);
    // Central differences: h^2 of the third derivative and rounding over h.
    EXPECT_NEAR(slope[static_cast<std::size_t>(k)], (fa - fb) / (2.0 * h), 1e-4);
    ball.jacobian(a.data(), up.data());
    ball.jacobian(b.data(), down.data());
    for (int i = 0; i < n; ++i) {
      const auto j = static_cast<std::size_t>(i);
      EXPECT_NEAR(hessian(i, k), (up[j] - down[j]) / (2.0 * h), 1e-4);
    }
  }
}

}  // namespace
}  // namespace sparflow
