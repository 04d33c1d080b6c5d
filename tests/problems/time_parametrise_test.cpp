#include "problems/time_parametrise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "models/math/units.h"
#include "problems/clearance.h"
#include "tests/problems/arms.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MotionProblem crane() {
  return arms::problem(arms::loader_crane(), Eigen::Vector3d(0.2, -1.6, 0.8), TipGoal{});
}

MatrixXd rows(std::initializer_list<Eigen::Vector3d> points) {
  MatrixXd path(static_cast<Eigen::Index>(points.size()), 3);
  Eigen::Index k = 0;
  for (const auto& p : points) path.row(k++) = p;
  return path;
}

MatrixXd random_path(std::mt19937& engine, int waypoints) {
  const Machine m = arms::loader_crane();
  MatrixXd path(waypoints, 3);
  for (int k = 0; k < waypoints; ++k) {
    for (int j = 0; j < 3; ++j) {
      const Range& r = m.joints[static_cast<std::size_t>(j)].position;
      path(k, j) = std::uniform_real_distribution<double>(r.lo, r.hi)(engine);
    }
  }
  return path;
}

/// Expects rest at both ends, and q and qd as integrated from the accelerations.
void expect_consistent(const Trajectory& m, const MatrixXd& path) {
  const Eigen::Index last = m.size() - 1;
  EXPECT_EQ(m.q.row(0), path.row(0));
  EXPECT_EQ(m.q.row(last), path.bottomRows(1));
  EXPECT_EQ(m.qd.row(0).norm(), 0.0);
  EXPECT_EQ(m.qd.row(last).norm(), 0.0);
  EXPECT_EQ(m.qdd.row(last), m.qdd.row(last - 1));
  Eigen::RowVectorXd q = m.q.row(0), qd = m.qd.row(0);
  for (Eigen::Index k = 0; k < last; ++k) {
    const double h = m.t[k + 1] - m.t[k];
    q += h * qd + 0.5 * h * h * m.qdd.row(k);
    qd += h * m.qdd.row(k);
    // sums of 100 terms of order 10: rounding
    EXPECT_LT((q - m.q.row(k + 1)).norm(), 1e-11);
    EXPECT_LT((qd - m.qd.row(k + 1)).norm(), 1e-11);
  }
}

TEST(TimeParametrise, KeepsEveryLimitAtSixteenTimesTheDensity) {
  std::mt19937 engine(3);
  const MotionProblem problem = crane();
  for (int trial = 0; trial < 60; ++trial) {
    const MatrixXd path = random_path(engine, 2 + trial % 5);
    TimingOptions options;
    options.intervals = 40 + 7 * (trial % 11);
    const TimedMotion fast = time_parametrise(problem, path, 0.0, options);
    ASSERT_EQ(fast.status, TimingStatus::kOk) << fast.message;
    ASSERT_EQ(fast.motion.size(), options.intervals + 1);
    EXPECT_DOUBLE_EQ(fast.motion.duration(), fast.shortest);
    expect_consistent(fast.motion, path);
    // 48 = 3 x 16: most of these instants are not used by the code itself.
    const double ratio = limit_ratio(problem, fast.motion, 48);
    EXPECT_LE(ratio, 1.0 + 1e-9);
    EXPECT_GT(ratio, 0.99);  // the shortest duration just keeps a limit

    const TimedMotion slow = time_parametrise(problem, path, 1.7 * fast.shortest, options);
    ASSERT_EQ(slow.status, TimingStatus::kOk);
    EXPECT_DOUBLE_EQ(slow.motion.duration(), 1.7 * fast.shortest);
    expect_consistent(slow.motion, path);
    EXPECT_LE(limit_ratio(problem, slow.motion, 16), 1.0 / 1.69);
  }
}

TEST(TimeParametrise, NamesATooShortDurationWithTheShortest) {
  const MatrixXd path = rows({{0.2, -1.6, 0.8}, {0.8, -0.6, 3.0}});
  const TimedMotion timed = time_parametrise(crane(), path, 2.0);
  EXPECT_EQ(timed.status, TimingStatus::kTooShort);
  EXPECT_DOUBLE_EQ(timed.motion.duration(), timed.shortest);
  EXPECT_THAT(timed.message, testing::HasSubstr("2.00 s is too short"));
  EXPECT_THAT(timed.message, testing::HasSubstr(timed.limit));
}

TEST(TimeParametrise, ShortestOfOneJointApproachesTheClosedForm) {
  // Trapezoid: distance / v + v / a, v from the flow limit of the extension cylinder or the joint.
  MotionProblem problem = crane();
  const double flow = 75 * units::kLitrePerMinute;
  const double area = M_PI / 4 * 0.07 * 0.07;
  const double v = std::min(0.3, flow / area), a = 0.6;
  const double exact = 4.0 / v + v / a;
  for (const int intervals : {24, 200}) {
    TimingOptions options;
    options.intervals = intervals;
    const TimedMotion timed =
        time_parametrise(problem, rows({{0.2, -1, 1}, {0.2, -1, 5}}), 0.0, options);
    EXPECT_GE(timed.shortest, exact * (1 - 1e-6));
    // Where an interval is longer than the ramp, speeding up takes a whole one: T = d / v + T / n. What lies between the
    // instants at the profile's two corners, and what its 600 pieces resolve, is below half a per cent.
    const double coarse = 4.0 / v * intervals / (intervals - 1.0);
    EXPECT_LT(timed.shortest, 1.005 * std::max(exact, coarse)) << intervals;
  }
}

TEST(TimeParametrise, PumpFlowLimitsSimultaneousMotion) {
  MotionProblem problem = crane();
  const MatrixXd path = rows({{0.0, -1.6, 0.8}, {0.6, -0.9, 3.0}});
  const double before = time_parametrise(problem, path, 0.0).shortest;
  problem.limits.pump_max_flow[0] *= 0.3;
  const TimedMotion timed = time_parametrise(problem, path, 0.0);
  EXPECT_GT(timed.shortest, 1.5 * before);
  EXPECT_EQ(timed.limit, "flow of pump main");
  problem.limits.valve_fraction = 0.1;
  EXPECT_THAT(time_parametrise(problem, path, 0.0).limit, testing::HasSubstr("flow of cylinder"));
}

TEST(TimeParametrise, RoundingACornerDoesNotCutIntoAnObstacle) {
  // The path turns round a ball that the joint-space diagonal would hit.
  MotionProblem problem =
      arms::problem(arms::two_link(), Eigen::Vector2d(-0.5, 0.0), JointGoal{VectorXd::Zero(2)});
  MatrixXd path(3, 2);
  path << -0.5, 0.0, -0.5, 2.0, 1.0, 2.0;
  problem.obstacles = {arms::sphere("ball", {3.0, 0, 0.8}, 0.4)};
  problem.clearance = 0.05;
  ClearanceModel clearance(problem);
  ASSERT_TRUE(clearance.path_clear(path));
  const VectorXd from = path.row(0), to = path.row(2);
  ASSERT_FALSE(clearance.motion_clear(from.data(), to.data()));
  const TimedMotion timed = time_parametrise(problem, path, 0.0);
  ASSERT_EQ(timed.status, TimingStatus::kOk) << timed.message;
  EXPECT_FALSE(timed.stops);
  EXPECT_GT(clearance.nearest_on(timed.motion, 64).distance, -2e-3);
  EXPECT_LE(limit_ratio(problem, timed.motion, 48), 1.0 + 1e-9);

  path.row(1) << 0.0, 0.6;  // through the ball, which no timing avoids
  const TimedMotion through = time_parametrise(problem, path, 0.0);
  EXPECT_EQ(through.status, TimingStatus::kCollision);
  EXPECT_LT(through.clearance, 0.0);
  EXPECT_THAT(through.message, testing::HasSubstr("ball"));
}

TEST(TimeParametrise, APathOfOnePostureGivesAMotionAtRest) {
  const TimedMotion timed = time_parametrise(crane(), rows({{0.2, -1.6, 0.8}}), 5.0);
  ASSERT_EQ(timed.status, TimingStatus::kOk);
  EXPECT_DOUBLE_EQ(timed.motion.duration(), 5.0);
  EXPECT_EQ(timed.motion.qd.norm(), 0.0);
}

}  // namespace
}  // namespace sparflow
