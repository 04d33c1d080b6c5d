// Cycles and limits of the sway in problem files, good and bad.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/math/error.h"
#include "models/math/units.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"

namespace sparflow {
namespace {

const std::string kHead =
    "machine: loader_crane\n"
    "start: {q: {boom: 0.2, jib: -1.6, extension: 0.8}}\n"
    "duration_s: 40\n";

MotionProblem read_problem(const std::string& text) { return parse_problem(text, "p.yaml", "."); }

std::string refused(const std::string& rest) {
  try {
    read_problem(kHead + rest);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(CycleFile, StopsAreReadInTheirOrder) {
  const MotionProblem p = read_problem(
      kHead +
      "cycle:\n"
      "- {name: pick, tip: [6, 0, 0.5], tolerance_m: 0.05, payload_kg: 500, dwell_s: 2}\n"
      "- {q: {boom: 0.5, jib: -1.0, extension: 2}, tolerance: {jib: 0.1}}\n"
      "- {name: home, start: true}\n");
  ASSERT_EQ(p.stops.size(), 2U);
  EXPECT_EQ(p.stops[0].name, "pick");
  EXPECT_EQ(std::get<TipGoal>(p.stops[0].goal).tolerance, 0.05);
  EXPECT_EQ(p.stops[0].payload, 500.0);
  EXPECT_EQ(p.stops[0].dwell, 2.0);
  EXPECT_EQ(p.stops[1].name, "stop 2");
  EXPECT_EQ(std::get<JointGoal>(p.stops[1].goal).tolerance, Eigen::Vector3d(0.0, 0.1, 0.0));
  EXPECT_EQ(p.goal_name, "home");
  EXPECT_EQ(std::get<JointGoal>(p.goal).q, p.start);
  EXPECT_EQ(payload_on(p, 0), 0.0);
  EXPECT_EQ(payload_on(p, 2), 500.0);
  EXPECT_TRUE(p.notes.empty());
  const MotionProblem leg = leg_of(p, 1, p.start);
  EXPECT_TRUE(leg.stops.empty());
  EXPECT_EQ(leg.payload, 500.0);
  EXPECT_TRUE(std::holds_alternative<JointGoal>(leg.goal));
}

TEST(CycleFile, WhatComesAfterTheEndIsSaidToChangeNothing) {
  const MotionProblem p =
      read_problem(kHead + "cycle:\n- {tip: [6, 0, 0.5]}\n- {start: true, payload_kg: 0}\n");
  ASSERT_EQ(p.notes.size(), 1U);
  EXPECT_THAT(p.notes[0], testing::HasSubstr("do not change it"));
}

TEST(CycleFile, BadCyclesAreRefusedWithASentence) {
  using testing::HasSubstr;
  EXPECT_THAT(refused("cycle: []\n"), HasSubstr("got no stop"));
  EXPECT_THAT(refused("cycle: 3\n"), HasSubstr("expected"));
  EXPECT_THAT(refused("cycle:\n- {name: nowhere}\n"), HasSubstr("missing; expected tip"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 0.5], start: true}\n"), HasSubstr("keep one"));
  EXPECT_THAT(refused("cycle:\n- {start: false}\n"), HasSubstr("got false"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 0.5], tolerance_m: -0.1}\n"), HasSubstr("-0.1"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, .nan]}\n"), HasSubstr("nan"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 0.5], payload_kg: -5}\n"), HasSubstr("-5"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 0.5], dwell_s: -1}\n"), HasSubstr("-1"));
  EXPECT_THAT(refused("cycle:\n- {start: true, tolerance_m: 0.1}\n"),
              HasSubstr("belongs to a stop of the tip"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 0.5], tolerance: {jib: 0.1}}\n"),
              HasSubstr("belongs to a stop with a posture"));
  EXPECT_THAT(refused("cycle:\n- {q: {boom: 0.5, jib: -1, extension: 2}, tolerance: {jib: -1}}\n"),
              HasSubstr("-1"));
  EXPECT_THAT(refused("goal: {tip: [6, 0, 0.5]}\ncycle:\n- {start: true}\n"),
              HasSubstr("drop the one or the other"));
  EXPECT_THAT(
      refused("cycle:\n- {tip: [6, 0, 1]}\n- {start: true}\nwaypoints: [{tip: [5, 0, 1]}]\n"),
      HasSubstr("no waypoints"));
  EXPECT_THAT(refused("cycle:\n- {tip: [6, 0, 1]}\n- {start: true}\n"
                      "path: {tip_line: true, tolerance_m: 0.1}\n"),
              HasSubstr("no straight line"));
  std::string many = "cycle:\n";
  for (int k = 0; k < 21; ++k) many += "- {start: true}\n";
  EXPECT_THAT(refused(many), HasSubstr("20"));
}

TEST(SwayFile, LimitsAreReadAndBadOnesRefused) {
  using testing::HasSubstr;
  const std::string goal = "goal: {tip: [6, 0, 0.5]}\n";
  const MotionProblem p = read_problem(kHead + goal + "sway: {limit_deg: 3, cable_m: 4}\n");
  ASSERT_TRUE(p.sway.has_value());
  EXPECT_DOUBLE_EQ(p.sway->limit, 3.0 * units::kDegree);
  EXPECT_DOUBLE_EQ(p.sway->end_limit, 3.0 * units::kDegree);
  EXPECT_EQ(p.sway->cable, 4.0);
  EXPECT_THAT(refused(goal + "sway: {limit_deg: 0, cable_m: 4}\n"), HasSubstr("got 0"));
  EXPECT_THAT(refused(goal + "sway: {limit_deg: 90, cable_m: 4}\n"), HasSubstr("at most 45"));
  EXPECT_THAT(refused(goal + "sway: {limit_deg: .nan, cable_m: 4}\n"), HasSubstr("nan"));
  EXPECT_THAT(refused(goal + "sway: {limit_deg: 3, cable_m: 0}\n"), HasSubstr("got 0"));
  EXPECT_THAT(refused(goal + "sway: {limit_deg: 3}\n"), HasSubstr("cable_m"));
  EXPECT_THAT(refused(goal + "sway: {limit_deg: 3, cable_m: 4, end_limit_deg: 5}\n"),
              HasSubstr("larger than limit_deg"));
}

TEST(VelocityFile, RatesAreReadAndThoseThatLeadOutOfTheLimitsRefused) {
  using testing::HasSubstr;
  const auto with = [](const std::string& start, const std::string& goal) {
    return "machine: loader_crane\nduration_s: 20\nstart: {q: {boom: 0.2, jib: -1.6, extension: "
           "0.8}, " +
           start + "}\ngoal: " + goal + "\n";
  };
  const auto why = [](const std::string& text) {
    try {
      read_problem(text);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const std::string posture = "{q: {boom: 0.5, jib: -1.0, extension: 2}";
  const MotionProblem p =
      read_problem(with("velocity: {jib: 0.05}", posture + ", velocity: {extension: 0.1}}"));
  EXPECT_EQ(p.start_velocity, Eigen::Vector3d(0.0, 0.05, 0.0));
  EXPECT_EQ(p.goal_velocity, Eigen::Vector3d(0.0, 0.0, 0.1));
  EXPECT_TRUE(moves_at_an_end(p));
  EXPECT_THAT(why(with("velocity: {jib: 5}", posture + "}")), HasSubstr("within the limits"));
  EXPECT_THAT(why(with("velocity: {jib: .nan}", posture + "}")), HasSubstr("nan"));
  EXPECT_THAT(why(with("velocity: {arm: 0.1}", posture + "}")), HasSubstr("arm"));
  EXPECT_THAT(why(with("velocity: {jib: 0.05}", "{tip: [7, 0, 3], velocity: {jib: 0.1}}")),
              HasSubstr("needs a goal with a posture"));
  // 0.2 m/s need 3.3 cm to stop at 0.6 m/s2, and the telescope has 1 cm left.
  EXPECT_THAT(
      why("machine: loader_crane\nduration_s: 20\n"
          "start: {q: {boom: 0.2, jib: -1.6, extension: 5.99}, velocity: {extension: 0.2}}\n"
          "goal: " +
          posture + "}\n"),
      HasSubstr("its range ends before"));
  EXPECT_THAT(why(with("velocity: {boom: 0.1, jib: 0.17, extension: 0.29}", posture + "}")),
              HasSubstr("times the limit of"));
}

}  // namespace
}  // namespace sparflow
