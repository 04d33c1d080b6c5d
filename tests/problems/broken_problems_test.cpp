// Errors in problem files, each with the complete message.
#include <gtest/gtest.h>

#include <cctype>
#include <ostream>

#include "models/math/error.h"
#include "problems/problem_file.h"

namespace sparflow {
namespace {

const std::string kFolder = SPARFLOW_SOURCE_DIR "/problems/reaches";

// clang-format off
const std::string kGood =
/* 1*/ "machine: ../machines/loader_crane.yaml\n"
/* 2*/ "payload_kg: 500\n"
/* 3*/ "start: {q: {boom: 0.2, jib: -1.6, extension: 0.8}}\n"
/* 4*/ "goal: {tip: [7.5, 0, 3.5]}\n"
/* 5*/ "duration_s: 16\n"
/* 6*/ "idle_power_W: 0\n"
/* 7*/ "limits:\n"
/* 8*/ "  joints: {boom: {position: [0, 1], velocity: [-0.1, 0.1]}}\n"
/* 9*/ "  pumps: {main: {max_flow_lpm: 100}}\n"
/*10*/ "  valve_fraction: 0.9\n"
/*11*/ "obstacles:\n"
/*12*/ "  - {box: {center: [5, 0, 0], size: [1, 1, 1]}}\n"
/*13*/ "  - {sphere: {center: [9, 0, 9], radius: 0.5}}\n"
/*14*/ "  - {half_space: {point: [0, 0, -3], normal: [0, 0, 1]}}\n"
/*15*/ "clearance_m: 0.1\n"
/*16*/ "path: {tip_line: false, tolerance_m: 0.05}\n"
/*17*/ "objective: {energy: 1, smoothness: 0.01}\n"
/*18*/ "knots: 40\n";
// clang-format on

struct Broken {
  std::string what;
  std::string find, replace;  ///< one edit of the good file
  std::string message;        ///< {} stands for the bundled folder
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.what; }

std::string case_name(const testing::TestParamInfo<Broken>& info) {
  std::string name = info.param.what;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

class BrokenProblem : public testing::TestWithParam<Broken> {};

TEST_P(BrokenProblem, SaysWhatIsWrongAndWhere) {
  const Broken& broken = GetParam();
  std::string text = kGood;
  const std::size_t at = text.find(broken.find);
  ASSERT_NE(at, std::string::npos) << broken.find;
  ASSERT_EQ(text.find(broken.find, at + 1), std::string::npos)
      << "the text to be edited occurs twice";
  text.replace(at, broken.find.size(), broken.replace);
  std::string expected = broken.message;
  const std::size_t folder = expected.find("{}");
  if (folder != std::string::npos) expected.replace(folder, 2, SPARFLOW_SOURCE_DIR "/problems");
  try {
    parse_problem(text, "lift.yaml", kFolder);
    ADD_FAILURE() << "accepted: " << broken.what;
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), expected);
  }
}

TEST(GoodProblem, TheUnchangedFileIsRead) {
  EXPECT_NO_THROW(parse_problem(kGood, "lift.yaml", kFolder));
}

const std::vector<Broken> kCases = {
    {"unknown key", "payload_kg: 500", "payload: 500",
     "lift.yaml:2:1: unknown key \"payload\"; did you mean \"payload_kg\"?"},
    {"a colon is missing", "duration_s: 16", "duration_s 16:",
     "lift.yaml:5:1: unknown key \"duration_s 16\"; a colon is missing: \"duration_s: 16\""},
    {"payload in the wrong unit", "payload_kg: 500", "payload_t: 0.5",
     "lift.yaml:2:1: unknown key \"payload_t\"; did you mean \"payload_kg\"?"},
    {"negative payload", "payload_kg: 500", "payload_kg: -5",
     "lift.yaml:2:13: payload_kg: got -5, expected a mass that is not negative [kg]"},
    {"no machine", "machine: ../machines/loader_crane.yaml\n", "",
     "lift.yaml:1:1: machine: missing; expected the machine file"},
    {"machine that is nowhere", "../machines/loader_crane.yaml", "../machines/loder_crane.yaml",
     "lift.yaml:1:10: machine: there is no file {}/machines/loder_crane.yaml (the path is relative "
     "to the problem file) and no bundled machine \"../machines/loder_crane.yaml\""},
    {"model that is nowhere", "payload_kg: 500", "model: fitted.json",
     "lift.yaml:2:8: model: there is no file {}/reaches/fitted.json; the path is relative to the "
     "problem file"},
    {"start of an unknown joint", "jib: -1.6", "jip: -1.6",
     "lift.yaml:3:24: start.q: unknown key \"jip\"; did you mean \"jib\"?"},
    {"start without a joint", ", extension: 0.8", "",
     "lift.yaml:3:12: start.q.extension: missing; expected a position [m]"},
    {"start outside the limits", "jib: -1.6", "jib: -2.6",
     "lift.yaml:3:29: start.q.jib: got -2.6 (-149.0 deg), outside the joint's range [-2.3, 0.05] "
     "rad"},
    {"start in degrees", "jib: -1.6", "jib: -90",
     "lift.yaml:3:29: start.q.jib: got -90, outside the joint's range [-2.3, 0.05] rad; angles are "
     "in rad, are these degrees?"},
    {"start outside the problem's own limits", "boom: 0.2", "boom: -0.1",
     "lift.yaml:3:19: start.q.boom: got -0.1 (-5.7 deg), outside the joint's range [0, 1] rad"},
    {"start too far out", "extension: 0.8", "extension: 6.8",
     "lift.yaml:3:46: start.q.extension: got 6.8, outside the joint's range [0, 6] m"},
    {"start not by q", "start: {q: {", "start: {x: {",
     "lift.yaml:3:9: start: unknown key \"x\"; did you mean \"q\"?"},
    {"no goal", "goal: {tip: [7.5, 0, 3.5]}\n", "",
     "lift.yaml:1:1: goal: missing; expected where the motion ends, {tip: [x, y, z]} or {q: "
     "{...}}"},
    {"empty goal", "{tip: [7.5, 0, 3.5]}", "{}",
     "lift.yaml:4:7: goal: missing; expected tip: [x, y, z] or q: {JOINT: position}"},
    {"two goals", "{tip: [7.5, 0, 3.5]}",
     "{tip: [7.5, 0, 3.5], q: {boom: 1, jib: -1, extension: 1}}",
     "lift.yaml:4:7: goal: gives both tip and q; keep one"},
    {"flat goal", "[7.5, 0, 3.5]", "[7.5, 3.5]",
     "lift.yaml:4:13: goal.tip: got a list of 2, expected three numbers [x, y, z], each a "
     "coordinate [m]"},
    {"goal off the plane", "[7.5, 0, 3.5]", "[7.5, 0.4, 3.5]",
     "lift.yaml:4:13: goal.tip: got y = 0.4, expected y = 0: the machine moves its tip only in "
     "that plane"},
    {"goal in millimetres", "[7.5, 0, 3.5]", "[7500, 0, 3500]",
     "lift.yaml:4:14: goal.tip[0]: got 7500, expected a coordinate [m] below 1000; in millimetres? "
     "then write 7.5"},
    {"goal posture outside the limits", "{tip: [7.5, 0, 3.5]}",
     "{q: {boom: 1, jib: 0.3, extension: 1}}",
     "lift.yaml:4:26: goal.q.jib: got 0.3 (17.2 deg), outside the joint's range [-2.3, 0.05] rad"},
    {"free time without idle power", "duration_s: 16", "duration_s: free",
     "lift.yaml:5:13: duration_s: got free, but idle_power_W is zero: slower is then always "
     "cheaper and no best duration exists; give idle_power_W, the engine's power while time "
     "passes, or {min, max}"},
    {"zero duration", "duration_s: 16", "duration_s: 0",
     "lift.yaml:5:13: duration_s: got 0, expected a positive duration [s]"},
    {"duration in words", "duration_s: 16", "duration_s: soon",
     "lift.yaml:5:13: duration_s: got \"soon\", expected a duration [s], {min, max} or free"},
    {"duration as a list", "duration_s: 16", "duration_s: [8, 16]",
     "lift.yaml:5:13: duration_s: got a list of 2, expected a duration [s], {min, max} or free"},
    {"duration range reversed", "duration_s: 16", "duration_s: {min: 20, max: 10}",
     "lift.yaml:5:13: duration_s: got min 20 above max 10; swap the two"},
    {"duration range half given", "duration_s: 16", "duration_s: {min: 20}",
     "lift.yaml:5:13: duration_s.max: missing; expected a positive duration [s]"},
    {"negative idle power", "idle_power_W: 0", "idle_power_W: -1",
     "lift.yaml:6:15: idle_power_W: got -1, expected a power that is not negative [W]"},
    {"limits of an unknown joint", "joints: {boom:", "joints: {bom:",
     "lift.yaml:8:12: limits.joints: unknown key \"bom\"; did you mean \"boom\"?"},
    {"limits wider than the machine", "position: [0, 1]", "position: [0, 1.5]",
     "lift.yaml:8:29: limits.joints.boom.position: got [0, 1.5], expected a part of the machine's "
     "own range [-0.2, 1.35]"},
    {"velocity limit without rest", "velocity: [-0.1, 0.1]", "velocity: [0, 0.1]",
     "lift.yaml:8:47: limits.joints.boom.velocity: got [0, 0.1], expected lo < 0 < hi; every "
     "motion starts and ends at rest"},
    {"limits of an unknown pump", "pumps: {main:", "pumps: {mian:",
     "lift.yaml:9:11: limits.pumps: unknown key \"mian\"; did you mean \"main\"?"},
    {"pump limit without its unit", "max_flow_lpm: 100", "max_flow: 100",
     "lift.yaml:9:18: limits.pumps.main: unknown key \"max_flow\"; did you mean \"max_flow_lpm\"?"},
    {"valve fraction above one", "valve_fraction: 0.9", "valve_fraction: 90",
     "lift.yaml:10:19: limits.valve_fraction: got 90, expected at most 1, the valve's full flow"},
    {"box without size", ", size: [1, 1, 1]", "",
     "lift.yaml:12:11: obstacles[0].box.size: missing; expected its edge lengths [x, y, z] [m]"},
    {"flat box", "size: [1, 1, 1]", "size: [1, 0, 1]",
     "lift.yaml:12:41: obstacles[0].box.size[1]: got 0, expected a positive size [m]"},
    {"sphere of no radius", "radius: 0.5", "radius: 0",
     "lift.yaml:13:42: obstacles[1].sphere.radius: got 0, expected a positive radius [m]"},
    {"normal of no length", "normal: [0, 0, 1]", "normal: [0, 0, 0]",
     "lift.yaml:14:46: obstacles[2].half_space.normal: got [0, 0, 0], expected a direction such as "
     "[0, 0, 1]"},
    {"unknown shape", "- {sphere:", "- {ball:",
     "lift.yaml:13:6: obstacles[1]: unknown key \"ball\"; known here: name, box, sphere, "
     "half_space"},
    {"two shapes in one", "{sphere: {center: [9, 0, 9], radius: 0.5}}",
     "{sphere: {center: [9, 0, 9], radius: 0.5}, half_space: {point: [0, 0, 0], normal: [0, 0, "
     "1]}}",
     "lift.yaml:13:5: obstacles[1]: got 2 shapes, expected an obstacle {box: {center, size}}, "
     "{sphere: {center, radius}} or {half_space: {point, normal}}"},
    {"no shape", "{sphere: {center: [9, 0, 9], radius: 0.5}}", "{name: ball}",
     "lift.yaml:13:5: obstacles[ball]: got 0 shapes, expected an obstacle {box: {center, size}}, "
     "{sphere: {center, radius}} or {half_space: {point, normal}}"},
    {"negative clearance", "clearance_m: 0.1", "clearance_m: -0.1",
     "lift.yaml:15:14: clearance_m: got -0.1, expected a distance that is not negative [m]"},
    {"line without tolerance", "{tip_line: false, tolerance_m: 0.05}", "{tip_line: true}",
     "lift.yaml:16:7: path.tolerance_m: missing; expected a positive tolerance [m]"},
    {"line neither true nor false", "tip_line: false", "tip_line: maybe",
     "lift.yaml:16:18: path.tip_line: got \"maybe\", expected true or false"},
    {"no weight at all", "{energy: 1, smoothness: 0.01}", "{energy: 0}",
     "lift.yaml:17:12: objective: both weights are zero, so every motion is as good; give energy "
     "or smoothness a positive weight"},
    {"negative weight", "smoothness: 0.01", "smoothness: -1",
     "lift.yaml:17:36: objective.smoothness: got -1, expected a weight that is not negative"},
    {"too few knots", "knots: 40", "knots: 2",
     "lift.yaml:18:8: knots: got 2, expected the number of knots, a whole number of at least 4"},
    {"fractional knots", "knots: 40", "knots: 40.5",
     "lift.yaml:18:8: knots: got 40.5, expected the number of knots, a whole number of at least 4"},
};

INSTANTIATE_TEST_SUITE_P(Keys, BrokenProblem, testing::ValuesIn(kCases), case_name);

}  // namespace
}  // namespace sparflow
