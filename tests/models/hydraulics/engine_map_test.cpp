// The map of engine and pump: interpolation by hand, fuel of a constant power in closed form, and files that are wrong.
#include "models/hydraulics/engine_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "models/files/engine_map_file.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMap =
    "engine: {power_kW: [0, 10, 30], fuel_l_h: [2, 4, 10]}\n"
    "pump:\n"
    "  pressure_bar: [100, 200]\n"
    "  flow_lpm: [30, 90]\n"
    "  efficiency: [[0.8, 0.9], [0.6, 0.7]]\n";

constexpr double kLitrePerHour = 1e-3 / 3600.0;

TEST(EngineMap, IsLinearBetweenItsValuesAndKeepsThoseAtTheEdge) {
  const EngineMap map = parse_engine_map("map.yaml", kMap);
  EXPECT_NEAR(map.efficiency_at(150e5, 60e-3 / 60.0), 0.75, 1e-12);
  EXPECT_NEAR(map.efficiency_at(125e5, 30e-3 / 60.0), 0.75, 1e-12);
  EXPECT_NEAR(map.efficiency_at(900e5, 1.0), 0.7, 1e-12);
  EXPECT_NEAR(map.efficiency_at(0.0, 0.0), 0.8, 1e-12);
  EXPECT_NEAR(map.fuel_rate(5e3) / kLitrePerHour, 3.0, 1e-12);
  EXPECT_NEAR(map.fuel_rate(40e3) / kLitrePerHour, 13.0, 1e-12) << "the last slope goes on";
  EXPECT_NEAR(map.fuel_rate(-1e3) / kLitrePerHour, 2.0, 1e-12)
      << "a load that drives gives none back";
  EXPECT_EQ(map.shaft_power(-10e5, 1e-3), 0.0);
}

TEST(EngineMap, FuelOfAConstantPowerAndOfRest) {
  const EngineMap map = parse_engine_map("map.yaml", kMap);
  PumpTrace trace;
  trace.t = Eigen::Vector3d(0.0, 1800.0, 3600.0);
  trace.pressure = Eigen::MatrixXd::Constant(3, 1, 150e5);
  trace.flow = Eigen::MatrixXd::Constant(3, 1, 60e-3 / 60.0);
  const double shaft = 150e5 * 1e-3 / 0.75;  // 20 kW: between 4 and 10 l/h
  EXPECT_NEAR(shaft, 20e3, 1e-9);
  EXPECT_NEAR(fuel_of(map, trace), 7e-3, 1e-12);
  trace.flow.setZero();
  trace.pressure.setConstant(std::nan(""));
  EXPECT_NEAR(fuel_of(map, trace), 2e-3, 1e-12) << "no pressure is needed where nothing flows";
  trace.flow.setConstant(1e-3);
  EXPECT_TRUE(std::isnan(fuel_of(map, trace)));
}

TEST(EngineMap, ConsumptionInGramsIsTheSameEngine) {
  const EngineMap map = parse_engine_map("map.yaml",
                                         "engine: {power_kW: [10, 30], consumption_g_kWh: [336, "
                                         "280], density_kg_l: 0.84, idle_l_h: 2}\n"
                                         "pump: {efficiency: 0.8}\n");
  EXPECT_NEAR(map.fuel_rate(0.0) / kLitrePerHour, 2.0, 1e-12);
  EXPECT_NEAR(map.fuel_rate(10e3) / kLitrePerHour, 4.0, 1e-12);
  EXPECT_NEAR(map.fuel_rate(30e3) / kLitrePerHour, 10.0, 1e-12);
  EXPECT_NEAR(map.shaft_power(100e5, 1e-3), 12.5e3, 1e-9);
}

TEST(EngineMap, WhatIsWrongIsSaidWithItsPlace) {
  const auto refused = [](const std::string& text, const std::string& words) {
    try {
      parse_engine_map("map.yaml", text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr("map.yaml:"));
      EXPECT_THAT(e.what(), HasSubstr(words));
    }
  };
  const std::string pump = "pump: {efficiency: 0.8}\n";
  refused("engine: {power_kW: [0, 10], fuel_l_h: [2]}\n" + pump, "one for each power");
  refused("engine: {power_kW: [10, 10], fuel_l_h: [2, 3]}\n" + pump, "ascending");
  refused("engine: {power_kW: [0, 10]}\n" + pump, "either fuel_l_h");
  refused("engine: {power_kW: [0, 10], fuel_l_h: [2, 3], consumption_g_kWh: [200, 300]}\n" + pump,
          "either fuel_l_h");
  refused("engine: {power_kW: [], fuel_l_h: []}\n" + pump, "empty");
  refused("engine: {power_kW: [0, 10], fuel_l_h: [2, 3]}\npump: {efficiency: 85}\n", "efficiency");
  refused("engine: {power_kW: [0, 10], fuel_l_h: [2, 3]}\n", "pump");
  refused(
      "engine: {power_kW: [0, 10], fuel_l_h: [2, 3]}\npump: {pressure_bar: [0, 1], flow_lpm: [0], "
      "efficiency: [[0.5]]}\n",
      "a row for each pressure");
}

}  // namespace
}  // namespace sparflow
