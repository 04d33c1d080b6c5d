// Scenario files: what they hold, and errors with place, what was found and what was expected.
#include "simulator/benchmark/scenario_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/math/error.h"
#include "problems/bundled.h"

namespace sparflow::benchmark {
namespace {

using ::testing::HasSubstr;

const std::string kHead = "id: lift\nmachine: loader_crane\n";
const std::string kStart = "start: {q: {boom: 0.2, jib: -1.2, extension: 0.6}}\n";
const std::string kGoal = "goals: [{tip: [7, 0, 3], duration_s: 10}]\n";

Scenario read(const std::string& text) {
  return parse_scenario(text, "lift.yaml", ".", bundled_file);
}
std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(ScenarioFile, HoldsTheWorkInSiUnits) {
  const Scenario s =
      read(kHead + kStart +
           "set: test\npayload_kg: 300\noil_C: 20\nseeds: [3, 4]\ntolerance_m: 0.05\n"
           "sensors: {pressure_noise_bar: 2, position_noise: 0.001}\n"
           "effects: [flexible_boom, 'coulomb_friction:boom=6000']\n"
           "goals:\n- {tip: [7, 0, 3], duration_s: 10, payload_kg: 0}\n"
           "- {q: {boom: 0.3, jib: -1, extension: 1}, duration_s: 8}\n");
  EXPECT_EQ(s.id, "lift");
  EXPECT_EQ(s.set, "test");
  EXPECT_EQ(s.payload, 300.0);
  EXPECT_EQ(s.plant.tank.temperature, 20.0);
  EXPECT_DOUBLE_EQ(s.plant.sensors.pressure_noise, 2e5);
  EXPECT_DOUBLE_EQ(s.plant.sensors.position_noise, 0.001);
  EXPECT_EQ(s.plant.sensors.drop_out, 0.0);  // off where no item names it
  EXPECT_GT(s.plant.flex_angle, 0.0);
  EXPECT_DOUBLE_EQ(s.plant.cylinders[0].friction.coulomb, 6000.0);
  ASSERT_EQ(s.goals.size(), 2u);
  EXPECT_EQ(s.goals[0].payload, 0.0);
  EXPECT_FALSE(s.goals[0].q);
  ASSERT_TRUE(s.goals[1].q);
  EXPECT_GT(s.goals[1].tip.x(), 1.0);
  EXPECT_EQ(s.seeds, (std::vector<std::uint64_t>{3, 4}));
  EXPECT_DOUBLE_EQ(s.time_limit, 46.0);  // twice the durations and ten seconds
}

TEST(ScenarioFile, ErrorsTellPlaceFoundAndExpected) {
  EXPECT_THAT(error_of(kHead + kStart), HasSubstr("goals"));
  EXPECT_THAT(error_of(kHead + kStart + kGoal + "sedes: [1]\n"),
              HasSubstr("did you mean \"seeds\""));
  EXPECT_THAT(error_of("id: a\nmachine: loader_krane\n" + kStart + kGoal),
              HasSubstr("lift.yaml:2"));
  EXPECT_THAT(error_of(kHead + "start: {q: {boom: 9, jib: -1, extension: 0.5}}\n" + kGoal),
              HasSubstr("lift.yaml:3:19: start.q.boom: got 9, outside the joint's range"));
  EXPECT_THAT(error_of(kHead + kStart + "goals: [{tip: [7, 1, 3], duration_s: 10}]\n"),
              HasSubstr("1 m off the plane"));
  EXPECT_THAT(error_of(kHead + kStart + "goals: [{duration_s: 10}]\n"),
              HasSubstr("tip: [x, y, z]"));
  EXPECT_THAT(error_of(kHead + kStart + kGoal + "effects: [coulomb_frction]\n"),
              HasSubstr("coulomb_friction"));
  EXPECT_THAT(error_of(kHead + kStart + kGoal + "oil_C: 500\n"), HasSubstr("from -30 to 110"));
  EXPECT_THAT(error_of(kHead + kStart + kGoal + "time_limit_s: 5\n"), HasSubstr("at least"));
  EXPECT_THAT(error_of(kHead + kStart + kGoal + "set: training\n"), HasSubstr("tuning"));
}

}  // namespace
}  // namespace sparflow::benchmark
