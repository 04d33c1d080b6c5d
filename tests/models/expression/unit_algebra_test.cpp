/// Unit texts: dimension and factor against hand-computed values, and messages for wrong ones.
#include "models/expression/unit_algebra.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>
#include <vector>

#include "models/math/error.h"
#include "tests/models/numeric.h"

namespace sparflow {
namespace {

struct Known {
  std::string text;
  double si;
  Dimension dimension;  ///< twice the exponents of m, kg, s, K
};

TEST(UnitAlgebra, KnownUnitsHaveTheirDimensionAndFactor) {
  const double lpm = 1e-3 / 60.0;
  const std::vector<Known> all = {
      {"bar", 1e5, {{-2, 2, -4, 0}}},
      {"l/min", lpm, {{6, 0, -2, 0}}},
      {"lpm", lpm, {{6, 0, -2, 0}}},
      {"N", 1.0, {{2, 2, -4, 0}}},
      {"kN", 1e3, {{2, 2, -4, 0}}},
      {"N s/m", 1.0, {{0, 2, -2, 0}}},
      {"N*s/m", 1.0, {{0, 2, -2, 0}}},
      {"N·s/m", 1.0, {{0, 2, -2, 0}}},
      {"mm/s", 1e-3, {{2, 0, -2, 0}}},
      {"deg", std::numbers::pi / 180.0, {}},
      {"rad", 1.0, {}},
      {"%", 0.01, {}},
      {"1", 1.0, {}},
      {"-", 1.0, {}},
      {"degC", 1.0, {{0, 0, 0, 2}}},
      {"1/degC", 1.0, {{0, 0, 0, -2}}},
      {"bar/(l/min)^2", 1e5 / (lpm * lpm), {{-14, 2, 0, 0}}},
      {"bar / (l/min)²", 1e5 / (lpm * lpm), {{-14, 2, 0, 0}}},
      {"Pa s^2/m^6", 1.0, {{-14, 2, 0, 0}}},
      {"1/s", 1.0, {{0, 0, -2, 0}}},
      {"s^-1", 1.0, {{0, 0, -2, 0}}},
      {"kg", 1.0, {{0, 2, 0, 0}}},
      {"t", 1e3, {{0, 2, 0, 0}}},
      {"m/s/s", 1.0, {{2, 0, -4, 0}}},
      {"J/(kg K)", 1.0, {{4, 0, -4, -2}}},
      {"l/(min bar^0.5)", lpm / std::sqrt(1e5), {{7, -1, 0, 0}}},
      {"rpm", std::numbers::pi / 30.0, {{0, 0, -2, 0}}},
      {"kW", 1e3, {{4, 2, -6, 0}}},
      {"cm^2", 1e-4, {{4, 0, 0, 0}}},
      {"cSt", 1e-6, {{4, 0, -2, 0}}},
      {" ( N ) ", 1.0, {{2, 2, -4, 0}}},
  };
  for (const Known& known : all) {
    SCOPED_TRACE(known.text);
    const Unit unit = parse_unit(known.text);
    EXPECT_EQ(unit.dimension, known.dimension) << unit.dimension.text();
    // a handful of multiplications and powers, each rounded once or twice
    EXPECT_NEAR(unit.si / known.si, 1.0, 1e-14);
  }
}

TEST(UnitAlgebra, OnlyDegreesCelsiusAloneAreAReading) {
  for (const char* text : {"degC", " degC ", "degC\n"})
    EXPECT_TRUE(parse_unit(text).reading) << text;
  for (const char* text : {"K", "1/degC", "bar/degC", "degC^2", "(degC)", "1 degC"}) {
    EXPECT_FALSE(parse_unit(text).reading) << text;
  }
}

TEST(UnitAlgebra, EveryListedUnitIsRead) {
  std::string word;
  int count = 0;
  for (const char c : known_units() + ",") {
    if (c == ' ') continue;
    if (c != ',') {
      word += c;
      continue;
    }
    EXPECT_GT(parse_unit(word).si, 0.0) << word;
    word.clear();
    ++count;
  }
  EXPECT_GT(count, 30);
}

TEST(UnitAlgebra, DimensionsArePrintedInUsualUnits) {
  const std::vector<std::pair<std::string, std::string>> pairs = {
      {"kN", "N"},
      {"bar", "Pa"},
      {"bar/(l/min)^2", "Pa s^2/m^6"},
      {"N s/mm", "N s/m"},
      {"N mm", "N m"},
      {"t", "kg"},
      {"deg", "1"},
      {"rpm", "1/s"},
      {"l/min", "m^3/s"},
      {"%/degC", "1/K"},
      {"kW", "N m/s"},
      {"bar s/l", "Pa s/m^3"},
      {"kg/m^3", "kg/m^3"},
      {"kg/s", "N s/m"},
      {"J/(kg K)", "m^2/(s^2 K)"},
      {"1/(min bar)", "1/(Pa s)"},
  };
  for (const auto& [text, printed] : pairs) {
    EXPECT_EQ(parse_unit(text).dimension.text(), printed) << text;
  }
  EXPECT_EQ(in_brackets(parse_unit("kN").dimension), "[N]");
  EXPECT_EQ(in_brackets({}), "no unit");
}

TEST(UnitAlgebra, PrintedDimensionsAreReadBack) {
  test_support::Random random(7);
  for (int i = 0; i < 2000; ++i) {
    Dimension d;
    for (int& twice : d.twice) twice = random.integer(-8, 8);
    SCOPED_TRACE(d.text());
    const Unit unit = parse_unit(d.text());
    EXPECT_EQ(unit.dimension, d);
    EXPECT_EQ(unit.si, 1.0);
  }
}

TEST(UnitAlgebra, PowersOfDimensions) {
  const Dimension pressure = dimensions::kPressure;
  EXPECT_EQ(pressure.power(2.0), pressure * pressure);
  EXPECT_EQ(pressure.power(0.5) * pressure.power(0.5), pressure);
  EXPECT_EQ(pressure.power(-1.0) * pressure, dimensions::kNone);
  EXPECT_EQ(dimensions::kNone.power(1.234), dimensions::kNone);
  EXPECT_THROW(dimensions::kFlow.power(0.25), TextError);
}

struct WrongUnit {
  std::string text;
  int column;
  std::string message;  ///< the whole of it, or its beginning when it ends in "..."
};

TEST(UnitAlgebra, WrongTextsAreExplained) {
  const std::vector<WrongUnit> all = {
      {"", 1, "the unit is empty; write 1 for a pure number"},
      {"  ", 3, "the unit is empty; write 1 for a pure number"},
      {"Nm", 1, "unknown unit \"Nm\"; did you mean \"N m\"?"},
      {"N sec/m", 3, "unknown unit \"sec\"; did you mean \"s\"?"},
      {"Bar", 1, "unknown unit \"Bar\"; did you mean \"bar\"?"},
      {"KN", 1, "unknown unit \"KN\"; did you mean \"kN\"?"},
      {"°C", 1, "unknown unit \"°C\"; did you mean \"degC\"?"},
      {"N/°C", 3, "unknown unit \"°C\"; did you mean \"degC\"?"},
      {"°C Bar", 1, "unknown unit \"°C\"; did you mean \"degC\"?"},
      {"m²·Bar", 4, "unknown unit \"Bar\"; did you mean \"bar\"?"},
      {"L/min", 1, "unknown unit \"L\"; did you mean \"l\"?"},
      {"bars", 1, "unknown unit \"bars\"; did you mean \"bar\"?"},
      {"quux", 1, "unknown unit \"quux\"; known units: m, mm, ..."},
      {"J/kg K", 6, "it is not clear whether \"K\" stands above or below the /; put what ..."},
      {"J/kg*K", 5, "it is not clear whether \"*K\" stands above or below the /; put what ..."},
      {"bar/", 5, "the unit ends where a number, a name or ( should follow"},
      {"bar/(l/min", 5, "this ( is never closed"},
      {"bar)", 4, "this ) has no ( before it"},
      {"m2", 2, "a number here means nothing; write an exponent as ^2"},
      {"m^x", 3, "expected an exponent from -12 to 12 after ^, as in m^2 or s^-1"},
      {"m^99", 3, "expected an exponent from -12 to 12 after ^, as in m^2 or s^-1"},
      {"m^0.3", 1, "[m] to the power 0.3 has no exponents that are whole or half"},
      {"10 N", 1, "\"10 N\" is no unit; expected a name such as bar or l/min"},
      {"N + m", 3, "\"+ m\" is no unit; expected a name such as bar or l/min"},
      {std::string(100000, '(') + "N", 10001, "the unit is longer than 10000 characters; ..."},
      {std::string(200, '(') + "N", 101, "the unit is nested more than 100 deep; split it"},
      {"(km^12)^12", 1, "this unit is beyond what a computer can hold, 1e-307 to 1e308 in SI"},
  };
  for (const WrongUnit& wrong : all) {
    SCOPED_TRACE(wrong.text);
    try {
      parse_unit(wrong.text);
      ADD_FAILURE() << "was read";
    } catch (const TextError& error) {
      EXPECT_EQ(error.column, wrong.column) << error.what();
      const bool open_end = wrong.message.ends_with("...");
      if (open_end) {
        EXPECT_THAT(error.what(),
                    ::testing::StartsWith(wrong.message.substr(0, wrong.message.size() - 3)));
      } else {
        EXPECT_EQ(std::string(error.what()), wrong.message);
      }
    }
  }
}

}  // namespace
}  // namespace sparflow
