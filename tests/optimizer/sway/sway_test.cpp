// The load on its rope: its pendulum, its derivatives, and motions that keep its limits.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "models/files/machine_file.h"
#include "models/math/units.h"
#include "optimizer/crane/crane_knot_model.h"
#include "optimizer/nlp/derivative_check.h"
#include "optimizer/solve/optimize.h"
#include "optimizer/sway/sway_model.h"
#include "optimizer/transcription/transcription.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "tests/optimizer/knot_support.h"
#include "tests/optimizer/sway/rope_by_cvodes.h"
#include "tests/optimizer/synthetic_model.h"

namespace sparflow {
namespace {

using test_support::largest_angle_by_cvodes;

/// A motion whose joints accelerate by these patterns of -1, 0 and 1, `step` seconds each, from the middle of their ranges.
Trajectory driven(const Machine& machine, const std::vector<std::vector<double>>& pattern,
                  double step, double share) {
  Trajectory m;
  const auto rows = static_cast<Eigen::Index>(pattern.size()) + 1;
  const Eigen::Index n = machine.joint_count();
  m.t = Eigen::VectorXd::LinSpaced(rows, 0.0, step * static_cast<double>(rows - 1));
  for (Eigen::MatrixXd* v : {&m.q, &m.qd, &m.qdd}) *v = Eigen::MatrixXd::Zero(rows, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
    m.q(0, j) = 0.5 * (joint.position.lo + joint.position.hi);
    for (Eigen::Index k = 0; k + 1 < rows; ++k) {
      const auto& now = pattern[static_cast<std::size_t>(k)];
      const double full = std::min(joint.acceleration.hi, 1.0);
      m.qdd(k, j) = share * full * now[static_cast<std::size_t>(j) % now.size()];
      m.qd(k + 1, j) = m.qd(k, j) + step * m.qdd(k, j);
      m.q(k + 1, j) = m.q(k, j) + 0.5 * step * (m.qd(k, j) + m.qd(k + 1, j));
    }
  }
  m.qdd.row(rows - 1) = m.qdd.row(rows - 2);
  return m;
}

std::vector<std::vector<double>> lively() {
  return {{1, 0, -1}, {1, 1, 0}, {-1, 1, 1}, {-1, -1, 0},
          {0, -1, 0}, {0, 0, 0}, {0, 0, 0},  {0, 0, 0}};
}

class SwayOfMachine : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Machines, SwayOfMachine,
                         testing::Values("loader_crane.yaml", "swing_crane.yaml",
                                         "hmf_2020_k4_load_sensing.yaml"),
                         test_support::machine_test_name);

TEST_P(SwayOfMachine, ThePendulumAgreesWithTwoAnglesByCvodes) {
  const Machine machine = load_machine(bundled_file("machines/" + GetParam()));
  const Trajectory motion = driven(machine, lively(), 0.6, 0.7);
  for (const double cable : {1.5, 6.0}) {
    const double mine = rope_course(machine, motion, cable, 16).largest_angle;
    const double other = largest_angle_by_cvodes(machine, motion, cable, 16);
    EXPECT_GT(mine, 0.01) << "a motion that does not make the load swing tells nothing";
    // Runge-Kutta of order 4 with 16 steps in 0.6 s: (w h)^4 is 1e-5 at most.
    EXPECT_NEAR(mine, other, 1e-5 * other);
  }
}

TEST_P(SwayOfMachine, AmplitudeAtTheEndIsWhatFollows) {
  const Machine machine = load_machine(bundled_file("machines/" + GetParam()));
  const Trajectory motion = driven(machine, lively(), 0.6, 0.4);
  // The joints stand still over the last three intervals.
  const double cable = 3.0;
  const RopeCourse course = rope_course(machine, motion, cable, 64);
  const double first = swing_amplitude(machine, course.knots[5]);
  const double last = swing_amplitude(machine, course.knots.back());
  ASSERT_LT(motion.qd.row(5).cwiseAbs().maxCoeff(), 1e-12);
  ASSERT_GT(first, 0.005);
  // Runge-Kutta with 64 steps in 0.6 s; the energy of a free pendulum stays.
  EXPECT_NEAR(first, last, 1e-6);
}

TEST(Sway, OfASmallAngleHasThePeriodOfThePendulum) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  Trajectory motion = driven(machine, {{0, 0, 1}, {0, 0, -1}}, 0.05, 0.05);
  // A jerk of the tip, then a long rest.
  const double cable = 4.0, period = 2.0 * std::numbers::pi * std::sqrt(cable / 9.81);
  const RopeCourse jerk = rope_course(machine, motion, cable, 16);
  Trajectory rest =
      driven(machine, std::vector<std::vector<double>>(400, {0}), period / 400.0, 1.0);
  rest.t.array() += motion.t[2];
  Trajectory both;
  both.t.resize(403);
  both.t << motion.t, rest.t.tail(400);
  for (auto member : {&Trajectory::q, &Trajectory::qd, &Trajectory::qdd}) {
    (both.*member).resize(403, 3);
    (both.*member).topRows(3) = motion.*member;
    (both.*member).bottomRows(400) = member == &Trajectory::q
                                         ? Eigen::MatrixXd((motion.q.row(2)).replicate(400, 1))
                                         : Eigen::MatrixXd::Zero(400, 3);
  }
  both.qdd.row(2).setZero();
  const RopeCourse course = rope_course(machine, both, cable, 8);
  const RopeState &before = course.knots[2], &after = course.knots[402];
  // After one period the load is where it was; the correction of a finite angle is its square over 16.
  EXPECT_NEAR((after.rope - before.rope).norm(), 0.0, 1e-3 * jerk.knots[2].rate.norm());
  EXPECT_NEAR((after.rate - before.rate).norm(), 0.0, 1e-3 * jerk.knots[2].rate.norm());
}

/// Why a bound on the tip's acceleration is no bound of the sway: in time with the pendulum small accelerations add up.
TEST(Sway, GrowsByResonanceFarBeyondTheAngleOfTheSameSteadyAcceleration) {
  const Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  const double cable = 4.0, half = std::numbers::pi * std::sqrt(cable / 9.81);
  std::vector<std::vector<double>> pattern;
  for (int k = 0; k < 6; ++k) pattern.push_back({0, 0, k % 2 == 0 ? 1.0 : -1.0});
  const Trajectory motion = driven(machine, pattern, half, 0.1);
  const double steady = 0.06 / 9.81;  // [rad] of the telescope's 0.06 m/s2, were it horizontal
  EXPECT_GT(rope_course(machine, motion, cable, 64).largest_angle, 5.0 * steady);
}

TEST_P(SwayOfMachine, DerivativesOfRowsAndDynamicsAgreeWithDifferences) {
  const Machine machine = load_machine(bundled_file("machines/" + GetParam()));
  const CraneModel model = test_support::synthetic_model(machine);
  MotionProblem problem = test_support::problem_for(machine, 3);
  problem.obstacles.clear();
  problem.tip_line.reset();
  const int n = machine.joint_count(), m = static_cast<int>(sway_directions(machine).cols());
  EXPECT_EQ(m, GetParam() == "swing_crane.yaml" ? 2 : 1);
  const int intervals = 4;
  TranscriptionSpec spec;
  spec.t.resize(intervals + 1);
  spec.t << 0.0, 0.3, 0.5, 0.9, 1.2;
  CraneKnotOptions options;
  options.smoothing = {20e-3, 10e5};
  SwayRows rows{0.05, 0.03, 4.0, {2, intervals}, Eigen::VectorXd::Constant(m, 0.1)};
  spec.knot = std::make_shared<SwayKnotModel>(
      machine, std::make_shared<CraneKnotModel>(model, problem, options), rows);
  spec.terminal = std::make_shared<PostureBesideLoad>(
      std::make_shared<TipAtGoal>(machine, std::get<TipGoal>(problem.goal).tip), n, m);
  spec.waypoints.push_back(
      {2, std::make_shared<PostureBesideLoad>(
              std::make_shared<TipNearGoal>(machine, std::get<TipGoal>(problem.goal).tip, 2.0), n,
              m)});
  Eigen::VectorXd stiffness = Eigen::VectorXd::LinSpaced(intervals, 2.2, 2.7);
  spec.interval = std::make_shared<SwayDynamics>(machine, stiffness);
  const Eigen::VectorXd far = Eigen::VectorXd::Constant(n + m, 1e3);
  spec.bounds = TranscriptionBounds::uniform(intervals, {-far, far}, {-far, far}, {-far, far});
  spec.phases.of_interval = {0, 0, 1, 1};
  spec.phases.lower = Eigen::Vector2d(0.01, 0.01);
  spec.phases.upper = Eigen::Vector2d(5.0, 5.0);
  Transcription transcription(std::move(spec));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Eigen::VectorXd x(transcription.size().variables);
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = 0.3 * unit(random);
  for (int k = 0; k <= intervals; ++k) {
    const Eigen::VectorXd z = test_support::random_state(machine, random);
    const Eigen::VectorXd q = z.head(n);
    const Eigen::VectorXd y =
        sway_directions(machine).transpose() * tip_position<double>(machine, q);
    for (int j = 0; j < n; ++j) {
      x[transcription.q_index(k, j)] = q[j];
      x[transcription.qd_index(k, j)] = z[n + j];
    }
    for (int d = 0; d < m; ++d) x[transcription.q_index(k, n + d)] = y[d] + 0.1 * unit(random);
  }
  x[transcription.tau_index(0)] = 0.6;
  x[transcription.tau_index(1)] = 0.8;
  const DerivativeCheck check = check_derivatives(transcription, x, 1e-4);
  // Errors of the differences: the smooth law varies over a twentieth of a unit of speed.
  EXPECT_LT(check.gradient_error, 1e-6) << check.worst_gradient;
  EXPECT_LT(check.jacobian_error, 1e-6) << check.worst_jacobian;
  EXPECT_LT(check.hessian_error, 1e-4) << check.worst_hessian;
}

TEST(Sway, LimitIsKeptByTheOptimumAndSeenByCvodes) {
  MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  problem.duration = {20.0, 20.0};
  const CraneModel model = test_support::synthetic_model(problem.machine);
  OptimizeOptions options;
  options.intervals = 60;
  options.search_intervals = 40;
  options.sequential_starts = 2;
  options.sequence_rounds = 1;
  const OptimizeResult free = optimize(model, problem, {}, options);
  ASSERT_EQ(free.status, OptimizeStatus::kOptimal) << free.message;
  const double deg = units::kDegree;
  const double cable = 4.0;
  const double unlimited = largest_angle_by_cvodes(problem.machine, free.motion, cable);
  problem.sway = SwayLimit{cable, 2.0 * deg, 1.0 * deg};
  ASSERT_GT(unlimited, 1.2 * problem.sway->limit) << "a limit that binds nothing tells nothing";
  const OptimizeResult held = optimize(model, problem, {}, options);
  ASSERT_EQ(held.status, OptimizeStatus::kOptimal) << held.message;
  // Beside limit_tolerance, 1e-5 of the limit, the other integration and its instants.
  EXPECT_LE(largest_angle_by_cvodes(problem.machine, held.motion, cable),
            problem.sway->limit * (1.0 + 1e-4));
  const RopeCourse course = rope_course(problem.machine, held.motion, cable, 8);
  EXPECT_LE(swing_amplitude(problem.machine, course.knots.back()),
            problem.sway->end_limit * (1.0 + 1e-4));
  EXPECT_LE(worst_excess(held.checks), options.limit_tolerance);
  EXPECT_GE(held.energy.total, 0.995 * free.energy.total)
      << "a limit does not make the optimum cheaper, but for local minima";
}

}  // namespace
}  // namespace sparflow
