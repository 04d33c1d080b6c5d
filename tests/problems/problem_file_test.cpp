#include "problems/problem_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"

namespace sparflow {
namespace {

const std::string kReaches = SPARFLOW_SOURCE_DIR "/problems/reaches";

MotionProblem parse(const std::string& text) { return parse_problem(text, "p.yaml", kReaches); }

const std::string kStart =
    "machine: ../machines/loader_crane.yaml\n"
    "start: {q: {boom: 0.2, jib: -1.6, extension: 0.8}}\n";
const std::string kMinimal = kStart + "goal: {tip: [7.5, 0, 3.5]}\nduration_s: 16\n";

TEST(ProblemFile, MinimalProblemTakesTheMachinesLimits) {
  const MotionProblem p = parse(kMinimal);
  EXPECT_EQ(p.name, "p");
  EXPECT_EQ(p.machine.name, "loader-crane");
  EXPECT_EQ(p.machine_path,
            std::string(SPARFLOW_SOURCE_DIR "/problems/machines/loader_crane.yaml"));
  EXPECT_EQ(p.model_path, "");
  EXPECT_EQ(p.payload, 0.0);
  EXPECT_EQ(p.start, Eigen::Vector3d(0.2, -1.6, 0.8));
  EXPECT_EQ(std::get<TipGoal>(p.goal).tip, Eigen::Vector3d(7.5, 0, 3.5));
  EXPECT_TRUE(p.duration.fixed());
  EXPECT_EQ(p.duration.max, 16.0);
  EXPECT_EQ(p.limits.velocity[1].hi, 0.18);
  EXPECT_DOUBLE_EQ(p.limits.pump_max_flow[0], 0.002);
  EXPECT_EQ(p.limits.valve_fraction, 1.0);
  EXPECT_TRUE(p.obstacles.empty());
  EXPECT_FALSE(p.tip_line.has_value());
  EXPECT_EQ(p.objective.energy, 1.0);
  EXPECT_FALSE(p.objective.smoothness.has_value());
  EXPECT_FALSE(p.knots.has_value());
}

TEST(ProblemFile, EveryKeyIsRead) {
  const MotionProblem p = parse(
      "name: all\nmachine: loader_crane\nmodel: loader_crane_lift.yaml\npayload_kg: 300\n"
      "start: {q: {extension: 0.8, boom: 0.2, jib: -1.6}}\n"
      "goal: {q: {boom: 0.5, jib: -1.0, extension: 2}}\n"
      "duration_s: {min: 8, max: 20}\nidle_power_W: 2500\n"
      "limits:\n"
      "  joints: {boom: {position: [0, 1], velocity: [-0.05, 0.06], acceleration: [-0.1, 0.2]}}\n"
      "  pumps: {main: {max_flow_lpm: 90, max_pressure_bar: 250}}\n"
      "  valve_fraction: 0.8\n"
      "obstacles:\n"
      "  - {box: {center: [5, 0, 1], size: [1, 2, 3], rpy: [0, 0, 1.5707963267948966]}}\n"
      "  - {name: tank, sphere: {center: [6, 0, 0], radius: 0.5}}\n"
      "  - {half_space: {point: [0, 0, -1], normal: [0, 0, 4]}}\n"
      "clearance_m: 0.2\n"
      "path: {tip_line: true, tolerance_m: 0.03}\n"
      "objective: {energy: 2, smoothness: 0.5}\n"
      "knots: 60\n");
  EXPECT_EQ(p.name, "all");
  EXPECT_THAT(p.machine_path, testing::EndsWith("machines/loader_crane.yaml"));  // the bundled one
  EXPECT_EQ(p.model_path, kReaches + "/loader_crane_lift.yaml");
  EXPECT_EQ(p.payload, 300.0);
  EXPECT_EQ(p.start, Eigen::Vector3d(0.2, -1.6, 0.8));  // the machine's order, not the file's
  EXPECT_EQ(std::get<JointGoal>(p.goal).q, Eigen::Vector3d(0.5, -1.0, 2.0));
  EXPECT_EQ(p.duration.min, 8.0);
  EXPECT_EQ(p.duration.max, 20.0);
  EXPECT_FALSE(p.duration.fixed() || p.duration.free());
  EXPECT_EQ(p.idle_power, 2500.0);
  EXPECT_EQ(p.limits.position[0].hi, 1.0);
  EXPECT_EQ(p.limits.velocity[0].hi, 0.06);
  EXPECT_EQ(p.limits.acceleration[0].lo, -0.1);
  EXPECT_EQ(p.limits.velocity[1].hi, 0.18);  // not overridden
  EXPECT_DOUBLE_EQ(p.limits.pump_max_flow[0], 0.0015);
  EXPECT_DOUBLE_EQ(p.limits.pump_max_pressure[0], 250e5);
  EXPECT_EQ(p.limits.valve_fraction, 0.8);
  ASSERT_EQ(p.obstacles.size(), 3u);
  EXPECT_EQ(p.obstacles[0].name, "box 1");
  EXPECT_EQ(p.obstacles[1].name, "tank");
  EXPECT_EQ(p.obstacles[2].name, "half-space 3");
  const Box& box = std::get<Box>(p.obstacles[0].shape);
  EXPECT_EQ(box.size, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR((box.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 0,
              1e-15);
  EXPECT_EQ(std::get<Sphere>(p.obstacles[1].shape).radius, 0.5);
  EXPECT_EQ(std::get<HalfSpace>(p.obstacles[2].shape).normal, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(p.clearance, 0.2);
  ASSERT_TRUE(p.tip_line.has_value());
  EXPECT_EQ(p.tip_line->tolerance, 0.03);
  EXPECT_EQ(p.objective.energy, 2.0);
  EXPECT_EQ(p.objective.smoothness, 0.5);
  EXPECT_EQ(p.knots, 60);
}

TEST(ProblemFile, FreeDurationWithIdlePower) {
  const MotionProblem p =
      parse(kStart + "goal: {tip: [7.5, 0, 3.5]}\nduration_s: free\nidle_power_W: 3000\n");
  EXPECT_TRUE(p.duration.free());
  EXPECT_FALSE(p.duration.fixed());
}

TEST(ProblemFile, AGivenMachineReplacesTheFilesOwn) {
  Machine machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  machine.pumps[0].max_flow = 0.001;
  const std::string text =
      "start: {q: {boom: 0.2, jib: -1.6, extension: 0.8}}\ngoal: {tip: [7.5, 0, 3.5]}\nduration_s: "
      "9\n";
  const MotionProblem p = parse_problem(text, "p.yaml", "/nowhere", &machine);
  EXPECT_EQ(p.limits.pump_max_flow[0], 0.001);
  EXPECT_EQ(p.machine_path, "");
}

/// The model that a file names decides the machine in the same reading, and its own machine's file stays known.
TEST(ProblemFile, TheModelThatItNamesGivesTheMachine) {
  const std::string file = bundled_file("reaches/swing_crane_far.yaml");
  const MotionProblem own = load_problem(file);
  ASSERT_NE(own.model_path, "");
  std::vector<std::string> asked;
  const auto same = [&](const std::string& model) -> const Machine* {
    asked.push_back(model);
    return nullptr;
  };
  EXPECT_EQ(load_problem_with(file, same).machine.name, own.machine.name);
  EXPECT_THAT(asked, testing::ElementsAre(own.model_path));
  Machine replaced = own.machine;
  replaced.name = "of the model";
  const MotionProblem p = load_problem_with(file, [&](const std::string&) { return &replaced; });
  EXPECT_EQ(p.machine.name, "of the model");
  EXPECT_EQ(p.machine_path, own.machine_path);
}

TEST(ProblemFile, AModelOfAnotherMachineIsRefusedByTheMachinesName) {
  const MotionProblem other = load_problem(bundled_file("reaches/swing_crane_far.yaml"));
  try {
    load_problem(bundled_file("reaches/loader_crane_lift.yaml"), &other.machine);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(
        error.what(),
        testing::HasSubstr("machine: the problem is for a machine with the joints boom, jib, "
                           "extension, the model is of " +
                           other.machine.name + " with the joints slew, boom"));
  }
}

TEST(ProblemFile, EveryBundledProblemLoads) {
  const std::vector<std::string> files = bundled_files("reaches", ".yaml");
  EXPECT_GE(files.size(), 6u);
  for (const std::string& file : files) EXPECT_NO_THROW(load_problem(file)) << file;
}

TEST(FixedTipDirections, PlanarSpatialAndLinearMachines) {
  const auto machine = [](const char* name) {
    return load_machine(bundled_file(std::string("machines/") + name + ".yaml"));
  };
  const auto planar = fixed_tip_directions(machine("loader_crane"));
  ASSERT_EQ(planar.size(), 1u);
  EXPECT_NEAR((planar[0] - Eigen::Vector3d::UnitY()).norm(), 0, 1e-12);
  EXPECT_EQ(fixed_tip_directions(machine("excavator")).size(), 0u);
  EXPECT_EQ(fixed_tip_directions(machine("swing_crane_two_pumps")).size(), 0u);
  // one carriage along x leaves y and z
  const auto linear = fixed_tip_directions(machine("emps"));
  ASSERT_EQ(linear.size(), 2u);
  EXPECT_NEAR(std::abs(linear[0].cross(linear[1]).x()), 1.0, 1e-12);
}

TEST(BundledData, EnvironmentVariableComesFirst) {
  const std::string folder = testing::TempDir() + "sparflow_data_test";
  std::filesystem::create_directories(folder + "/machines");
  write_file_atomically(folder + "/machines/own.yaml", "name: own\n");
  ASSERT_EQ(setenv("SPARFLOW_DATA", folder.c_str(), 1), 0);
  EXPECT_EQ(data_folder(), folder);
  EXPECT_THAT(bundled_files("machines", ".yaml"),
              testing::ElementsAre(folder + "/machines/own.yaml"));
  EXPECT_THROW(bundled_file("machines/none.yaml"), InputError);
  ASSERT_EQ(setenv("SPARFLOW_DATA", (folder + "/none").c_str(), 1), 0);
  EXPECT_THROW(data_folder(), InputError);
  ASSERT_EQ(unsetenv("SPARFLOW_DATA"), 0);
  EXPECT_TRUE(std::filesystem::exists(bundled_file("machines/emps.yaml")));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace sparflow
