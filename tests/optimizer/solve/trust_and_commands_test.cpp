// Rows of the trust region and the cost of commands: their derivatives and their influence on a motion.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "models/files/machine_file.h"
#include "optimizer/solve/optimize.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "problems/time_parametrise.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using test_support::numeric_gradient;
using test_support::problem_for;
using test_support::random_state;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// A synthetic model whose pressure variance is smaller near the centres of the data.
CraneModel model_with_variance(const Machine& machine) {
  CraneModel model = test_support::synthetic_model(machine);
  for (CylinderModel& c : model.cylinders) {
    for (GaussianProcess* g : {&c.extend, &c.retract}) {
      if (g->empty()) continue;
      GpParameters p = g->parameters();
      const auto n = p.weight.size();
      p.variance_core = Matrix::Zero(n + 2, n + 2);
      const double prior = p.signal_std * p.signal_std;
      p.variance_core.diagonal().head(n).setConstant(0.9 / (static_cast<double>(n) * prior));
      *g = GaussianProcess(p);
    }
  }
  return model;
}

class TrustRows : public ::testing::TestWithParam<std::string> {};

TEST_P(TrustRows, DerivativesMatchFiniteDifferencesInHeldModes) {
  const CraneModel model =
      model_with_variance(load_machine(bundled_file("machines/" + GetParam())));
  MotionProblem problem = problem_for(model.machine, 5);
  problem.limits.pressure_std = 5e5;
  problem.objective.commands = 700.0;
  const int cylinders = model.machine.cylinder_count(), n = model.machine.joint_count();
  std::mt19937 random(41);
  for (int trial = 0; trial < 4; ++trial) {
    const Vector z = random_state(model.machine, random);
    CraneKnotOptions options;
    options.command_weight = problem.objective.commands;
    options.modes.resize(1, cylinders);
    for (int c = 0; c < cylinders; ++c) {
      const int j = model.machine.cylinders[static_cast<std::size_t>(c)].joint;
      const double speed = linkage_rates(model.machine, c, z[j]).d1 * z[n + j];
      options.modes(0, c) = speed > 0.0 ? CylinderMode::kExtend : CylinderMode::kRetract;
    }
    CraneKnotModel knot(model, problem, options);
    knot.begin_node(0, 0);
    const int rows = knot.path_count(), size = knot.size();
    Vector g(rows), multiplier = Vector::Random(rows), gradient(size);
    Matrix jacobian_t(size, rows), hessian = Matrix::Zero(size, size), cost_hessian(size, size);
    knot.path_jacobian(z.data(), g.data(), jacobian_t.data());
    knot.add_path_hessian(z.data(), multiplier.data(), hessian.data());
    bool trusted = false;
    for (int r = 0; r < rows; ++r) {
      const bool trust = knot.path_name(r).starts_with("standard deviation");
      trusted = trusted || (trust && jacobian_t.col(r).cwiseAbs().maxCoeff() > 1e-6);
      const Vector numeric = numeric_gradient(
          [&](const Vector& x) {
            Vector v(rows);
            knot.path(x.data(), v.data());
            return v[r];
          },
          z, 2e-5);
      const double scale = std::max(1.0, jacobian_t.col(r).cwiseAbs().maxCoeff());
      // Truncation and rounding of the step are as in crane_knot_model_test.
      EXPECT_LT((jacobian_t.col(r) - numeric).cwiseAbs().maxCoeff(), 1e-6 * scale)
          << knot.path_name(r);
    }
    EXPECT_TRUE(trusted) << "no row of the trust region depends on anything";
    knot.cost_derivatives(z.data(), gradient.data(), cost_hessian.data());
    const Vector slope =
        numeric_gradient([&](const Vector& x) { return knot.cost(x.data()); }, z, 2e-5);
    EXPECT_LT((gradient - slope).cwiseAbs().maxCoeff(),
              1e-6 * std::max(1.0, gradient.cwiseAbs().maxCoeff()));
    for (int i = 0; i < size; ++i) {
      const Vector path_row = numeric_gradient(
          [&](const Vector& x) {
            Vector v(rows);
            Matrix j(size, rows);
            knot.path_jacobian(x.data(), v.data(), j.data());
            return (j * multiplier)[i];
          },
          z, 2e-5);
      EXPECT_LT((hessian.row(i).transpose() - path_row).cwiseAbs().maxCoeff(),
                1e-6 * std::max(1.0, hessian.cwiseAbs().maxCoeff()));
      const Vector cost_row = numeric_gradient(
          [&](const Vector& x) {
            Vector v(size);
            Matrix unused(size, size);
            knot.cost_derivatives(x.data(), v.data(), unused.data());
            return v[i];
          },
          z, 2e-5);
      EXPECT_LT((cost_hessian.row(i).transpose() - cost_row).cwiseAbs().maxCoeff(),
                1e-6 * std::max(1.0, cost_hessian.cwiseAbs().maxCoeff()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, TrustRows,
                         ::testing::Values("loader_crane.yaml", "swing_crane_two_pumps.yaml",
                                           "excavator.yaml"));

struct Reach {
  MotionProblem problem;
  CraneModel model;
  std::vector<SeedMotion> seeds;
  OptimizeOptions options;
  Reach()
      : problem(load_problem(bundled_file("reaches/loader_crane_lift.yaml"))),
        model(model_with_variance(problem.machine)) {
    Vector end = problem.start;
    EXPECT_TRUE(solve_end_posture(problem.machine, problem.limits,
                                  std::get<TipGoal>(problem.goal).tip, {true, true, true}, end));
    Matrix line(2, 3);
    line << problem.start.transpose(), end.transpose();
    const TimedMotion timed = time_parametrise(problem, line, 0.0);
    seeds.push_back({"line", timed.motion, timed.shortest, true});
    options.intervals = 40;
    options.search_intervals = 30;
    options.sequential_starts = 2;
    options.sequence_rounds = 1;
    options.schedule.clear();
    options.processes = 1;
  }
};

TEST(TrustRegion, IsKeptBetweenTheKnotsAndCostsEnergy) {
  Reach r;
  const OptimizeResult free = optimize(r.model, r.problem, r.seeds, r.options);
  ASSERT_EQ(free.status, OptimizeStatus::kOptimal);
  r.problem.limits.pressure_std = 0.97 * free.energy.largest_pressure_std;
  const OptimizeResult trusted = optimize(r.model, r.problem, r.seeds, r.options);
  ASSERT_EQ(trusted.status, OptimizeStatus::kOptimal) << trusted.message;
  EXPECT_LE(trusted.energy.largest_pressure_std, r.problem.limits.pressure_std * (1.0 + 1e-5));
  // A smaller feasible set cannot be cheaper; 0.1 % allows for different local optima.
  EXPECT_GE(trusted.energy.total, 0.999 * free.energy.total);
}

TEST(Commands, LeastEffortHasItsClosedFormOnOneJoint) {
  // The extension moves out and all other joints are fixed. With u = v / v_full the least integral of u^2 over T is
  // (d / v_full)^2 / T for unlimited acceleration; limited acceleration can only raise it.
  Reach r;
  const auto extension = static_cast<Eigen::Index>(r.problem.machine.joint_index("extension"));
  Vector end = r.problem.start;
  end[extension] += 0.5;
  r.problem.goal = JointGoal{end};
  r.problem.objective = {0.0, 0.0, 1e3, {}};
  r.problem.duration = {20.0, 20.0};
  Matrix line(2, 3);
  line << r.problem.start.transpose(), end.transpose();
  const TimedMotion timed = time_parametrise(r.problem, line, 0.0);
  r.options.intervals = 80;
  const OptimizeResult found =
      optimize(r.model, r.problem, {{"line", timed.motion, timed.shortest, true}}, r.options);
  ASSERT_EQ(found.status, OptimizeStatus::kOptimal) << found.message;
  const int c = r.problem.machine.cylinder_of_joint(static_cast<int>(extension));
  const double full =
      full_speeds(r.problem.machine, r.problem.limits)[static_cast<std::size_t>(c)].extend;
  const double ideal = std::pow(0.5 / full, 2) / 20.0;
  const double effort = command_effort(r.model, r.problem, found.motion);
  EXPECT_GE(effort, ideal * (1.0 - 1e-9));
  // two ramps of one interval each (20 s / 80) at most: 2/3 of an interval's share a ramp
  EXPECT_LE(effort, ideal * 1.03);
}

TEST(ShortestTime, OfOneJointHasItsClosedForm) {
  Reach r;
  const auto extension = static_cast<Eigen::Index>(r.problem.machine.joint_index("extension"));
  Vector end = r.problem.start;
  end[extension] += 0.5;
  r.problem.goal = JointGoal{end};
  Matrix line(2, 3);
  line << r.problem.start.transpose(), end.transpose();
  const TimedMotion timed = time_parametrise(r.problem, line, 0.0);
  const OptimizeResult found = shortest_motion(
      r.model, r.problem, {{"line", timed.motion, timed.shortest, true}}, r.options);
  ASSERT_EQ(found.status, OptimizeStatus::kOptimal) << found.message;
  const auto i = static_cast<std::size_t>(extension);
  const int c = r.problem.machine.cylinder_of_joint(static_cast<int>(extension));
  const Pump& pump = r.problem.machine.pumps[0];
  const Cylinder& cylinder = r.problem.machine.cylinders[static_cast<std::size_t>(c)];
  double v = std::min(
      r.problem.limits.velocity[i].hi,
      full_speeds(r.problem.machine, r.problem.limits)[static_cast<std::size_t>(c)].extend);
  v = std::min(v, pump.max_flow / cylinder.area_piston());
  const double a = r.problem.limits.acceleration[i].hi;
  const double shortest = 0.5 / v + v / a;
  EXPECT_GE(found.duration, shortest * (1.0 - 1e-6));
  EXPECT_LE(found.duration, shortest * 1.02) << "asked: to 2 %";
}

}  // namespace
}  // namespace sparflow
