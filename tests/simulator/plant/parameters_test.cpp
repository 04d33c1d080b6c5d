/// Parameters of the dynamic plant: table, file and switches.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "simulator/plant/parameters/parameter_table.h"
#include "simulator/plant/parameters/plant_effects.h"
#include "simulator/plant/parameters/plant_file.h"

namespace sparflow::plant {
namespace {

Machine crane() {
  return load_machine(std::string(SPARFLOW_SOURCE_DIR) + "/problems/machines/loader_crane.yaml");
}

TEST(PlantParameters, EveryRowHasItsOwnKeyANumberWithinBoundsAndASource) {
  const Machine machine = crane();
  PlantParameters p = default_parameters(machine);
  std::set<std::string_view> keys;
  std::set<const double*> places;
  for (const ParameterRow& row : parameter_table()) {
    EXPECT_TRUE(keys.insert(row.key).second) << row.key;
    double& value = row.value(p, 0);
    EXPECT_TRUE(places.insert(&value).second) << row.key << " is the number of another row";
    EXPECT_FALSE(row.source.empty()) << row.key;
    if (row.key == "drive_gain_N_s_m") continue;  // of drives without hydraulics
    EXPECT_GE(value, row.lowest * row.scale) << row.key;
    EXPECT_LE(value, row.highest * row.scale) << row.key;
  }
}

TEST(PlantParameters, AFileReplacesNumbersOfPlantCylindersAndPumps) {
  const Machine machine = crane();
  PlantParameters p = default_parameters(machine);
  parse_plant_file(
      "plant:\n  bulk_modulus_MPa: 1200\n  cylinders:\n    boom: {hysteresis: 0.03}\n"
      "    all: {hysteresis: 0.02, coulomb_friction_N: 700}\n  pumps:\n    main: {margin_bar: "
      "18}\n",
      "plant.yaml", machine, p);
  EXPECT_DOUBLE_EQ(p.oil.bulk_modulus, 1.2e9);
  EXPECT_DOUBLE_EQ(p.cylinders[0].spool.hysteresis, 0.03);
  EXPECT_DOUBLE_EQ(p.cylinders[1].spool.hysteresis, 0.02);
  EXPECT_DOUBLE_EQ(p.cylinders[2].friction.coulomb, 700.0);
  EXPECT_DOUBLE_EQ(p.pumps[0].margin, 18e5);
}

std::string error_of(const std::string& text) {
  const Machine machine = crane();
  PlantParameters p = default_parameters(machine);
  try {
    parse_plant_file(text, "plant.yaml", machine, p);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(PlantParameters, AWrongFileIsAnErrorWithItsPlace) {
  EXPECT_THAT(error_of("plant: {bulk_modulus: 1500}"), testing::HasSubstr("bulk_modulus_MPa"));
  EXPECT_THAT(error_of("plant: {bulk_modulus_MPa: 1.5}"), testing::HasSubstr("from 200"));
  EXPECT_THAT(error_of("plant: {cylinders: {bom: {hysteresis: 0.1}}}"),
              testing::HasSubstr("plant.yaml:1"));
  EXPECT_THAT(error_of("plant: {pumps: {main: {hysteresis: 0.1}}}"),
              testing::HasSubstr("hysteresis"));
}

TEST(PlantParameters, ThePageHasTheTable) {
  const std::string page = read_file(std::string(SPARFLOW_SOURCE_DIR) + "/docs/plant.md");
  EXPECT_THAT(page, testing::HasSubstr(parameter_markdown()));
}

PlantParameters with(const std::vector<std::string>& items) {
  const Machine machine = crane();
  PlantParameters p = default_parameters(machine);
  std::vector<EffectSetting> settings;
  settings.reserve(items.size());
  for (const std::string& i : items) settings.push_back(parse_effect(i));
  apply_effects(machine, settings, p);
  return p;
}

TEST(PlantEffects, AreOnOffOrOffNominalEverywhereOrAtOnePlace) {
  const PlantParameters plain = with({});
  EXPECT_GT(plain.cylinders[0].friction.coulomb, 0.0);
  EXPECT_EQ(plain.flex_angle, 0.0);  // off unless named
  EXPECT_GT(with({"flexible_boom"}).flex_angle, 0.0);
  const PlantParameters none = with({"none", "coulomb_friction:boom=1234"});
  EXPECT_DOUBLE_EQ(none.cylinders[0].friction.coulomb, 1234.0);
  EXPECT_EQ(none.cylinders[1].friction.coulomb, 0.0);
  EXPECT_EQ(none.pendulum.rope_length, 0.0);
  const PlantParameters one = with({"coulomb_friction:jib=off", "pump_lag:main=0.1"});
  EXPECT_EQ(one.cylinders[1].friction.coulomb, 0.0);
  EXPECT_DOUBLE_EQ(one.cylinders[0].friction.coulomb, plain.cylinders[0].friction.coulomb);
  EXPECT_DOUBLE_EQ(one.pumps[0].response, 0.1);
}

TEST(PlantEffects, EachOffValueIsWithinTheBoundsOfItsParameter) {
  for (const PlantEffect& e : plant_effects()) {
    const ParameterRow* row = find_parameter(e.key);
    ASSERT_NE(row, nullptr) << e.name;
    EXPECT_GE(e.off, row->lowest) << e.name;
    EXPECT_LE(e.off, row->highest) << e.name;
    EXPECT_THAT(effects_help(), testing::HasSubstr(std::string(e.name)));
  }
}

TEST(PlantEffects, EachPassesFromOnToOffAndChangesItsParameterAlone) {
  for (const PlantEffect& e : plant_effects()) {
    PlantParameters on = with({std::string(e.name)}), off = with({std::string(e.name) + "=off"});
    for (const ParameterRow& row : parameter_table()) {
      const double before = row.value(on, 0), after = row.value(off, 0);
      if (row.key == e.key) {
        EXPECT_NE(before, after) << e.name;
      } else {
        EXPECT_EQ(before, after) << e.name << " changes " << row.key;
      }
    }
  }
}

TEST(PlantEffects, WhatIsUnknownIsAUsageErrorWithTheNearestName) {
  const auto message = [](const std::string& item) {
    try {
      with({item});
    } catch (const UsageError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(message("coulomb_frction"), testing::HasSubstr("coulomb_friction"));
  EXPECT_THAT(message("leakage:main"), testing::HasSubstr("a cylinder"));
  EXPECT_THAT(message("sway:boom"), testing::HasSubstr("no single place"));
  EXPECT_THAT(message("leakage=much"), testing::HasSubstr("l/min"));
  EXPECT_THAT(message("leakage="), testing::HasSubstr("no value"));
}

}  // namespace
}  // namespace sparflow::plant
