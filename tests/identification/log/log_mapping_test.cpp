/// Tests of mapping files and their expressions.
#include "identification/log/log_mapping.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "tests/identification/log_machines.h"

namespace sparflow {
namespace {

using test::LogFiles;
using testing::HasSubstr;
using testing::IsEmpty;

const char* const kForeign =
    "Time [ms];PT01;PT01 [raw];angle-boom;Ext. length;1;max;operator\n"
    "1000;80,5;1;90;1,5;7;3;Ann\n"
    "1020;81,5;2;89;1,51;7;4;Ann\n"
    "1040;82,5;3;88;1,52;7;5;Ann\n";

RawTable small_table() {
  RawTable table;
  table.file = "log.csv";
  table.header_line = 1;
  const std::vector<std::pair<const char*, std::vector<double>>> columns = {
      {"a", {2.0, 3.0}},           {"b", {5.0, NAN}},   {"a b", {7.0, 8.0}},
      {"a-b [m/s]", {11.0, 12.0}}, {"1", {13.0, 14.0}}, {"sin", {17.0, 18.0}}};
  for (const auto& [name, values] : columns) {
    RawColumn& column = table.columns.emplace_back();
    column.name = name;
    column.values = values;
  }
  return table;
}

double value_of(const std::string& expression) {
  return evaluate_expression(expression, small_table(), {"m.yaml", 3, 7}, "columns.x")[0];
}

TEST(Expression, Arithmetic) {
  const double pi = std::numbers::pi;
  for (const auto& [expression, expected] :
       std::vector<std::pair<const char*, double>>{{"1 + 2 * 3", 7.0},
                                                   {"(1 + 2) * 3", 9.0},
                                                   {"2 - 3 - 4", -5.0},
                                                   {"12 / 3 / 2", 2.0},
                                                   {"2 ^ 3 ^ 2", 512.0},
                                                   {"-2 ^ 2", -4.0},
                                                   {"2 ^ -1", 0.5},
                                                   {"--3", 3.0},
                                                   {"+3", 3.0},
                                                   {"1e3", 1000.0},
                                                   {".5", 0.5},
                                                   {"abs(-4)", 4.0},
                                                   {"sqrt(16)", 4.0},
                                                   {"sin(90 * deg)", 1.0},
                                                   {"cos(pi)", -1.0},
                                                   {"min(3, 2)", 2.0},
                                                   {"max(3, 2)", 3.0},
                                                   {"pi", pi}}) {
    EXPECT_NEAR(value_of(expression), expected, 1e-15 * std::abs(expected)) << expression;
  }
}

TEST(Expression, UsesTheLongestMatchingColumnName) {
  EXPECT_EQ(value_of("a"), 2.0);
  EXPECT_EQ(value_of("a+b"), 7.0);
  EXPECT_EQ(value_of("a b"), 7.0);
  EXPECT_EQ(value_of("a-b [m/s]"), 11.0);
  EXPECT_EQ(value_of("`a`-b"), -3.0);
  EXPECT_EQ(value_of("a - b"), -3.0);
  EXPECT_EQ(value_of("1"), 1.0);       // the number
  EXPECT_EQ(value_of("`1`"), 13.0);    // the column
  EXPECT_EQ(value_of("sin"), 17.0);    // the column
  EXPECT_EQ(value_of("sin(0)"), 0.0);  // the function
}

TEST(Expression, MissingStaysMissing) {
  for (const char* expression : {"b", "b * 0", "max(b, 1)", "min(1, b)", "abs(b)"}) {
    EXPECT_TRUE(std::isnan(evaluate_expression(expression, small_table(), {}, "")[1]))
        << expression;
  }
}

TEST(Expression, ErrorsNameTheirPlaceAndCause) {
  const auto error = [](const std::string& expression) -> std::string {
    try {
      value_of(expression);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  const std::string place = "m.yaml:3:7: columns.x: ";
  EXPECT_EQ(
      error("a +"),
      place +
          "\"a +\", character 4: the expression ends where a number, a name or ( should follow");
  EXPECT_EQ(error("(a"), place + "\"(a\", character 1: this ( is never closed");
  EXPECT_EQ(error("a)"), place + "\"a)\", character 2: this ) has no ( before it");
  EXPECT_EQ(
      error("a 5"),
      place + "\"a 5\", character 3: expected an operator before \"5\"; a product is written *");
  EXPECT_EQ(error("a % 2"), place +
                                "\"a % 2\", character 3: \"%\" means nothing in a formula; it is "
                                "written with numbers, names and + - * / ^ ( )");
  EXPECT_EQ(error("* a"),
            place + "\"* a\", character 1: found \"*\", expected a number, a name or ( before it");
  EXPECT_EQ(error("max(a)"),
            place + "\"max(a)\", character 1: max() takes two values or more, as in max(0, x)");
  EXPECT_EQ(error("abs(a"), place + "\"abs(a\", character 4: this ( is never closed");
  EXPECT_EQ(error("`a"), place + "\"`a\", character 1: a backtick is opened and not closed");
  EXPECT_EQ(error("1 + a-b [m/h]"), place +
                                        "\"1 + a-b [m/h]\", character 9: expected an operator "
                                        "before \"[m/h]\"; a product is written *");
  EXPECT_EQ(
      error("pressure_7"),
      place +
          "\"pressure_7\", character 1: the log has no column \"pressure_7\"; its columns are: "
          "a, b, a b, a-b [m/s], 1, sin");
  EXPECT_EQ(error("`a_b`"),
            place + "\"`a_b`\", character 1: the log has no column \"a_b\"; did you mean \"a b\"?");
  for (const char c : {'(', '-'}) {
    EXPECT_THAT(error(std::string(5000, c)), HasSubstr("nested more than 100 deep; split it"));
    EXPECT_THAT(error(std::string(100000, c)), HasSubstr("longer than 10000 characters; split it"));
  }
  EXPECT_THAT(error("1e999 * a"), HasSubstr("character 1: the number 1e999 is beyond"));
}

TEST_F(LogFiles, AMappingFileConvertsOtherColumnNames) {
  LogOptions options;
  options.mapping_file = write("map.yaml",
                               "columns:\n"
                               "  t_s: \"Time [ms] * 0.001\"\n"
                               "  q_boom_deg: 90 - angle-boom\n"
                               "  q_extension_m: Ext. length\n"
                               "  pA_boom_bar: \"(PT01 - `PT01 [raw]` / 2) * 1\"\n"
                               "  payload_kg: 800\n"
                               "  load factor: max(max, 4)\n"
                               "ignore: [PT01, operator]\n");
  const Log log = load(kForeign, options);
  EXPECT_THAT(log.warnings, IsEmpty());
  EXPECT_DOUBLE_EQ(log.time[1], 1.02);
  EXPECT_DOUBLE_EQ(log.find(Role::kJointPosition, 0)->values[2], 2.0 * std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(log.find(Role::kPressureA, 0)->values[0], 80e5);
  EXPECT_DOUBLE_EQ(log.find(Role::kPayload)->values[2], 800.0);
  EXPECT_DOUBLE_EQ(log.find("load factor")->values[2], 5.0);
  // A column that an expression reads is no candidate signal, because it would explain the mapped channel perfectly.
  EXPECT_EQ(log.find("PT01"), nullptr);
  EXPECT_EQ(log.find("angle-boom"), nullptr);
}

TEST_F(LogFiles, AMappedColumnReplacesOneOfItsName) {
  LogOptions options;
  options.mapping_file = write("map.yaml", "columns: {u_boom: \"u_boom / 127\", v: u_boom}\n");
  const Log log =
      load("t_s,q_boom_rad,q_extension_m,u_boom\n0,0.5,1,127\n0.02,0.5,1,-127\n", options);
  EXPECT_DOUBLE_EQ(log.find(Role::kCommand, 0)->values[1], -1.0);
  EXPECT_DOUBLE_EQ(log.find("v")->values[1], -127.0);  // expressions use the file's columns
}

TEST_F(LogFiles, TheMappingFilePrescribesTheDialect) {
  LogOptions options;
  options.mapping_file =
      write("map.yaml", "skip_rows: 2\ndelimiter: ';'\ndecimal: comma\nmissing: [-999, 'bad']\n");
  const Log log = load(
      "Project: crane 7\nOperator;Ann\nt_s;q_boom_rad;q_extension_m;a\n"
      "0;0,5;1;-999\n0,02;0,5;1;4\n0,04;0,5;1;bad\n0,06;0,5;1;6\n",
      options);
  EXPECT_EQ(log.samples(), 4);
  EXPECT_EQ(log.counts.cells_missing, 2);
  EXPECT_EQ(log.counts.cells_unreadable, 0);
  EXPECT_DOUBLE_EQ(log.find("a")->values[2], 5.0);
}

TEST_F(LogFiles, BrokenMappingFilesAreRefusedWithAMessage) {
  const auto error = [&](const std::string& mapping) {
    LogOptions options;
    options.mapping_file = write("map.yaml", mapping);
    return message_of([&] { load(kForeign, options); });
  };
  EXPECT_EQ(error("colums: {}\n"),
            "map.yaml:1:1: unknown key \"colums\"; did you mean \"columns\"?");
  EXPECT_EQ(
      error("resample: 50\n"),
      "map.yaml:1:1: unknown key \"resample\"; known are columns, ignore, delimiter, decimal, "
      "skip_rows, missing, dbc, clock_s");
  EXPECT_EQ(error("- a\n"),
            "map.yaml:1: expected a mapping file: columns: {t_s: \"Time [ms] * 0.001\", ...}");
  EXPECT_EQ(
      error("columns: 3\n"),
      "map.yaml:1:10: columns: expected a table of name: expression, e.g. {t_s: \"Time [ms] * "
      "0.001\"}");
  EXPECT_EQ(error("columns:\n  t_s: [1]\n"),
            "map.yaml:2:8: columns.t_s: expected one value, got a list or a table");
  EXPECT_EQ(
      error("columns:\n  t_s: ''\n"),
      "map.yaml:2:8: columns.t_s: the expression is empty, expected e.g. \"Time [ms] * 0.001\"");
  EXPECT_EQ(error("columns:\n  a: 1\n  a: 2\n"), "map.yaml:3:3: columns.a: is given twice");
  EXPECT_EQ(
      error("columns:\n  t_s: Tme [ms] / 1000\n"),
      "map.yaml:2:8: columns.t_s: \"Tme [ms] / 1000\", character 1: the log has no column \"Tme "
      "[ms]\"; did you mean \"Time [ms]\"?");
  EXPECT_EQ(error("columns:\n  t_s: operator\n"),
            "map.yaml:2:8: columns.t_s: \"operator\", character 1: column \"operator\" holds text "
            "(\"Ann\" in line 2), expected numbers");
  EXPECT_EQ(error("ignore: [PT02]\n"),
            "map.yaml:1:9: ignore: the log has no column \"PT02\"; did you mean \"PT01\"?");
  EXPECT_EQ(error("delimiter: '|'\n"),
            "map.yaml:1:12: delimiter: got \"|\", expected \",\", \";\", tab or blanks");
  EXPECT_EQ(error("decimal: dot\n"),
            "map.yaml:1:10: decimal: got \"dot\", expected point or comma");
  EXPECT_EQ(error("skip_rows: -1\n"),
            "map.yaml:1:12: skip_rows: expected a number of lines, 0 or more");
  EXPECT_EQ(error("skip_rows: 100\n"), "log.csv: nothing is left after skip_rows");
  EXPECT_EQ(error("columns: {a: [\n").substr(0, 9), "map.yaml:");
}

}  // namespace
}  // namespace sparflow
