// The verb audit, as a user runs it.
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "tests/cli/cli_fixture.h"
#include "tests/parsed_json.h"

namespace sparflow::test {
namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) out.push_back(cell);
  return out;
}

const std::string kAudited = " --model " + kData + "/models/loader_crane.json";

TEST_F(Cli, AuditComparesEachMoveWithItsOptimum) {
  const Outcome o = run("audit " + kTest + kAudited + " --moves 2 --litres-per-kwh 0.4 --json " +
                        at("a.json") + " --report " + at("a.html"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json a = test_support::parsed_json(slurp(at("a.json")));
  ASSERT_EQ(a.at("moves").size(), 2U);
  EXPECT_EQ(a.at("not_examined"), 10);
  double saving = 0.0;
  for (const json& m : a.at("moves")) {
    ASSERT_TRUE(m.at("judged").get<bool>()) << m;
    // model and log come from the same plant; its own noise and starts and stops are left
    EXPECT_NEAR(m.at("model_J").get<double>() / m.at("measured_J").get<double>(), 1.0, 0.03);
    EXPECT_LE(m.at("optimum_J"), m.at("model_J"));
    EXPECT_LE(m.at("bound_J"), m.at("optimum_J"));
    saving += m.at("saving_J").get<double>();
  }
  const json& total = a.at("total");
  EXPECT_NEAR(total.at("saving_J").get<double>(), saving, 1e-6 * saving);
  EXPECT_NEAR(total.at("saving_litres").get<double>(), 0.4 * saving / 3.6e6, 1e-9);
  EXPECT_THAT(o.out, HasSubstr("2 of 2 moves judged"));
  EXPECT_THAT(slurp(at("a.html")), HasSubstr("The moves worth changing first"));
}

TEST_F(Cli, AuditCountsLitresByTheMapOfEngineAndPump) {
  // 0.3 l/kWh at any power and 2 l/h idle: litres follow from energies by hand
  write(
      "engine.yaml",
      "engine: {power_kW: [0, 100], fuel_l_h: [2, 32]}\n"
      "pump: {pressure_bar: [0, 400], flow_lpm: [0, 200], efficiency: [[0.8, 0.8], [0.8, 0.8]]}\n");
  const std::string call = "audit " + kTest + kAudited + " --moves 1 --no-bound --engine-map ";
  const Outcome o = run(call + at("engine.yaml") + " --json " + at("a.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  const json a = test_support::parsed_json(slurp(at("a.json")));
  const json& move = a.at("moves").at(0);
  const double seconds = move.at("t_s").at(1).get<double>() - move.at("t_s").at(0).get<double>();
  const auto litres = [&](const json& joules) {
    return 2.0 * seconds / 3600.0 + 0.3 * joules.get<double>() / 0.8 / 3.6e6;
  };
  // the trapezoidal rule over the rows against the exact integral over them
  EXPECT_NEAR(move.at("model_litres").get<double>() / litres(move.at("model_J")), 1.0, 5e-3);
  EXPECT_NEAR(move.at("optimum_litres").get<double>() / litres(move.at("optimum_J")), 1.0, 5e-3);
  EXPECT_NEAR(a.at("fuel_at_rest_litres").get<double>(),
              2.0 * a.at("at_rest_s").get<double>() / 3600.0, 1e-9);
  EXPECT_GT(a.at("fuel_litres"), a.at("fuel_at_rest_litres"));
  EXPECT_THAT(o.out, HasSubstr("By the map of engine and pump the logs took"));

  write("twisted.yaml",
        "engine: {power_kW: [0, 20, 10], fuel_l_h: [2, 3, 4]}\npump: {efficiency: 0.9}\n");
  const Outcome twisted = run(call + at("twisted.yaml"));
  EXPECT_EQ(twisted.code, 3);
  EXPECT_THAT(twisted.err, HasSubstr("twisted.yaml:1:"));
  EXPECT_THAT(twisted.err, HasSubstr("ascending order"));
  EXPECT_EQ(run(call + at("engine.yaml") + " --litres-per-kwh 0.3").code, 2);
}

TEST_F(Cli, AuditSaysWhatItCannotJudge) {
  const std::string text = slurp(kTest);
  std::istringstream lines(text);
  std::string line, kept;
  for (int k = 0; std::getline(lines, line) && k < 200; ++k) kept += line + "\n";  // 4 s
  write("short.csv", kept);
  const Outcome o = run("audit " + at("short.csv") + kAudited);
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("None of 1 moves could be judged"));
  EXPECT_THAT(o.out, HasSubstr("It ends in motion"));
  kept.clear();
  lines = std::istringstream(text);
  for (int k = 0; std::getline(lines, line) && k < 40; ++k) kept += line + "\n";  // at rest
  write("rest.csv", kept);
  const Outcome rest = run("audit " + at("rest.csv") + kAudited);
  EXPECT_EQ(rest.code, 3);
  EXPECT_THAT(rest.err, HasSubstr("no move of more than"));
  EXPECT_EQ(run("audit " + kTest).code, 2);
}

TEST_F(Cli, AuditSaysWhereDataIsBad) {
  // the pump's sensor rests at one value for the middle third of the log
  std::istringstream lines(slurp(kTest));
  std::string line, kept, header, held;
  std::getline(lines, header);
  const std::vector<std::string> names = cells(header);
  const auto column =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "p_main_bar") - names.begin());
  ASSERT_LT(column, names.size());
  std::vector<std::vector<std::string>> rows;
  while (std::getline(lines, line)) rows.push_back(cells(line));
  kept = header + "\n";
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (k > rows.size() / 3 && k < 2 * rows.size() / 3)
      rows[k][column] = rows[rows.size() / 3][column];
    kept += fmt::format("{}\n", fmt::join(rows[k], ","));
  }
  write("stuck.csv", kept);
  const Outcome o =
      run("audit " + at("stuck.csv") + kAudited + " --moves 12 --no-bound --json " + at("a.json"));
  ASSERT_EQ(o.code, 0) << o.err;
  EXPECT_THAT(o.out, HasSubstr("Set aside in stuck.csv: p_main is stuck"));
  const json a = test_support::parsed_json(slurp(at("a.json")));
  const double from = std::stod(rows[rows.size() / 3][0]),
               to = std::stod(rows[2 * rows.size() / 3][0]);
  int inside = 0, outside = 0;
  for (const json& m : a.at("moves")) {
    const double first = m.at("t_s").at(0), last = m.at("t_s").at(1);
    if (first > from && last < to) {
      ++inside;
      EXPECT_FALSE(m.at("judged").get<bool>()) << m;
      EXPECT_THAT(m.at("reason").get<std::string>(), HasSubstr("Bad data in it: p_main is stuck"));
    } else if (last < from || first > to) {
      ++outside;
      EXPECT_TRUE(m.at("judged").get<bool>()) << m;
    }
  }
  EXPECT_GT(inside, 0);
  EXPECT_GT(outside, 0);
}

}  // namespace
}  // namespace sparflow::test
