#include "problems/motion_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "models/machine/kinematics.h"
#include "problems/oriented_goal.h"
#include "problems/problem_file.h"

namespace sparflow {
namespace {

const std::string kReachFolder = SPARFLOW_SOURCE_DIR "/problems/reaches";

/// Two intervals of unequal length with known positions.
Trajectory hop() {
  Trajectory m;
  m.t = (Eigen::VectorXd(3) << 0.0, 1.0, 1.5).finished();
  m.q = (Eigen::MatrixXd(3, 1) << 0.0, 0.5, 0.75).finished();
  m.qd = (Eigen::MatrixXd(3, 1) << 0.0, 1.0, 0.0).finished();
  m.qdd = (Eigen::MatrixXd(3, 1) << 1.0, -2.0, -2.0).finished();
  return m;
}

TEST(AtRate, PositionsAndSpeedsAreThoseOfTheMotion) {
  const Trajectory fast = at_rate(hop(), 100.0);
  ASSERT_EQ(fast.size(), 151);
  EXPECT_NEAR(fast.q(50, 0), 0.125, 1e-12);  // t = 0.5: half of t squared
  EXPECT_NEAR(fast.qd(50, 0), 0.5, 1e-12);
  EXPECT_NEAR(fast.q(125, 0), 0.5 + 0.25 - 0.0625, 1e-12);
  EXPECT_EQ(fast.q(150, 0), 0.75);
  EXPECT_EQ(fast.qd(150, 0), 0.0);
  // Rows are a motion again: each speed follows from the one before by its acceleration.
  for (Eigen::Index k = 0; k + 1 < fast.size(); ++k) {
    EXPECT_NEAR(fast.qd(k + 1, 0), fast.qd(k, 0) + (fast.t[k + 1] - fast.t[k]) * fast.qdd(k, 0),
                1e-12);
  }
}

TEST(AtRate, TheLastStepEndsWithTheMotion) {
  const Trajectory slow = at_rate(hop(), 0.8);  // steps of 1.25 s
  ASSERT_EQ(slow.size(), 3);
  EXPECT_EQ(slow.t[2], 1.5);
  EXPECT_EQ(slow.q(2, 0), 0.75);
}

TEST(LeastFlow, IsTheProblemsShareOfEachValvesFullFlow) {
  const MotionProblem p = parse_problem(
      "machine: ../machines/loader_crane.yaml\n"
      "start: {q: {boom: 0.2, jib: -1.6, extension: 0.8}}\n"
      "goal: {tip: [7.5, 0, 3.5]}\nduration_s: 16\nlimits: {valve_least_fraction: 0.01}\n",
      "p.yaml", kReachFolder);
  const LeastFlows least = least_flows(p.machine, p.limits);
  ASSERT_EQ(least.size(), 3u);
  const Valve* boom = p.machine.valve_of_cylinder(0);
  ASSERT_NE(boom, nullptr);
  EXPECT_DOUBLE_EQ(least[0].extend, 0.01 * boom->max_flow_extend);
  EXPECT_DOUBLE_EQ(least[0].retract, 0.01 * boom->max_flow_retract);
  EXPECT_TRUE(firmly_moving(least, 0, 0.011 * boom->max_flow_extend, 0.01));
  EXPECT_FALSE(firmly_moving(least, 0, 0.009 * boom->max_flow_extend, 0.01));
  EXPECT_TRUE(firmly_moving({}, 0, 1e-12, 0.01)) << "without least flows nothing stands";
}

/// The bundled excavator with a goal for its bucket.
std::string excavator(const std::string& goal) {
  return "machine: ../machines/excavator.yaml\n"
         "start: {q: {swing: 0.0, boom: -0.2, stick: -1.8, bucket: -1.0}}\n"
         "goal: " +
         goal + "\nduration_s: 9\n";
}

TEST(OrientedGoal, TheTipIsAtItsPointAndPointsAsAsked) {
  // Reached by some posture: that of this configuration.
  const Eigen::Vector4d wanted(0.8, 0.3, -1.4, -0.6);
  const MotionProblem some = parse_problem(
      excavator("{q: {swing: 0.8, boom: 0.3, stick: -1.4, bucket: -0.6}}"), "p.yaml", kReachFolder);
  const Eigen::Vector3d tip = tip_position<double>(some.machine, Eigen::VectorXd(wanted));
  // All three lift by their angles: the bucket points along their sum.
  const double angle = 0.3 - 1.4 - 0.6;
  EXPECT_NEAR(tip_angle(some.machine, wanted, tip), angle, 1e-9);
  const MotionProblem p = parse_problem(
      excavator("{tip: [" + std::to_string(tip.x()) + ", " + std::to_string(tip.y()) + ", " +
                std::to_string(tip.z()) + "], angle_rad: " + std::to_string(angle) + "}"),
      "p.yaml", kReachFolder);
  const auto* goal = std::get_if<JointGoal>(&p.goal);
  ASSERT_NE(goal, nullptr);
  // The goal is written with six decimals.
  EXPECT_LT((tip_position<double>(p.machine, goal->q) - tip).norm(), 1e-5);
  EXPECT_NEAR(tip_angle(p.machine, goal->q, tip), angle, 1e-5);
  EXPECT_LT((goal->q - wanted).cwiseAbs().maxCoeff(), 1e-4)
      << "four conditions on four joints: it is that posture";
}

TEST(OrientedGoal, AnAngleThatNothingReachesIsNamedWithItsRemedy) {
  const auto message = [](const std::string& goal) {
    try {
      parse_problem(excavator(goal), "p.yaml", kReachFolder);
    } catch (const std::exception& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_NE(message("{tip: [7, 0, 2], angle_rad: 2.5}").find("no posture within the limits"),
            std::string::npos);
  EXPECT_NE(message("{tip: [7, 0, 2], angle_rad: -90}").find("are these degrees?"),
            std::string::npos);
}

}  // namespace
}  // namespace sparflow
