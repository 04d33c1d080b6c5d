// The loop of trust as text, JSON and page, on a result composed by hand.
#include "apps/report/trust/trust_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/apps/browser_check.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TrackedMotion motion(double predicted, double measured) {
  TrackedMotion m;
  m.predicted = predicted;
  m.measured = measured;
  m.tip_error = 0.01;
  return m;
}

ComparedSeries pump_series(double error) {
  ComparedSeries s;
  s.stage = "pump";
  s.at = "main <b>";
  s.unit = {"bar", 1e5};
  s.measured = Eigen::Vector3d(1e7, 1.2e7, 1.1e7);
  s.predicted = s.measured.array() + error;
  return s;
}

CompareResult compared(double error, double relative) {
  CompareResult r;
  LogComparison& log = r.logs.emplace_back();
  log.signals.time = Eigen::Vector3d(0.0, 0.1, 0.2);
  log.series = {pump_series(error)};
  StageScore score;
  score.stage = "pump";
  score.at = "main <b>";
  score.unit = {"bar", 1e5};
  score.rmse = error;
  r.scores = {score};
  r.energy = {{"main <b>", 100.0, 100.0 * (1.0 + relative), relative, std::nullopt, 1.0}};
  return r;
}

/// Two moves done, and a third whose optimum could not be tracked.
TrustLoop loop() {
  TrustLoop l;
  l.machine = "crane <i>";
  l.train_seconds = 100.0;
  l.test_seconds = 50.0;
  l.test_before = compared(2e5, -0.05);
  l.test_after = compared(1e5, -0.01);
  l.moves.resize(3);
  const double before[] = {90e3, 45e3, 10e3}, after[] = {98e3, 51e3, 10e3};
  const double measured[] = {100e3, 50e3, 11e3};
  for (std::size_t i = 0; i < l.moves.size(); ++i) {
    TrustedMove& m = l.moves[i];
    m.name = "move " + std::to_string(i + 1);
    m.payload = 300.0;
    m.duration = 8.0;
    m.before = motion(before[i], measured[i]);
    m.after = motion(after[i], measured[i]);
    m.sequential = motion(std::nan(""), 1.25 * measured[i]);
    m.joint_pi = motion(std::nan(""), 1.1 * measured[i]);
  }
  l.moves[2].after.failure = "goal 1 was not reached";
  return l;
}

TEST(TrustPage, MediansAreOfMovesThatBothModelsDidToTheEnd) {
  const TrustSums s = sums_of(loop());
  EXPECT_EQ(s.moves, 2);
  // by hand: predicted 90 and 45 of 100 and 50 are both 10 % too low; 98 and 51 are 2 % off, one below and one above
  EXPECT_NEAR(s.error_before, 0.10, 1e-12);
  EXPECT_NEAR(s.bias_before, -0.10, 1e-12);
  EXPECT_NEAR(s.error_after, 0.02, 1e-12);
  EXPECT_NEAR(s.bias_after, 0.0, 1e-12);
  EXPECT_NEAR(s.saving, 0.2, 1e-12) << "one less 1 / 1.25";
  TrustLoop none = loop();
  none.moves.clear();
  EXPECT_EQ(sums_of(none).moves, 0);
  EXPECT_TRUE(std::isnan(sums_of(none).error_after));
  EXPECT_THAT(trust_headline(none), HasSubstr("No move"));
}

TEST(TrustPage, TextAndJsonTellTheSameAndNameAFailure) {
  const TrustLoop l = loop();
  const nlohmann::json j = test_support::parsed_json(trust_json(l));
  EXPECT_EQ(j["moves"].size(), 3u);
  EXPECT_EQ(j["moves"][0]["after"]["predicted_J"], 98e3);
  EXPECT_EQ(j["moves"][2]["after"]["reason"], "goal 1 was not reached");
  EXPECT_TRUE(j["moves"][0]["joint_pi"]["predicted_J"].is_null());
  EXPECT_NEAR(j["median"]["error_after"].get<double>(), sums_of(l).error_after, 1e-15);
  const std::string table = trust_table(l);
  EXPECT_THAT(table, HasSubstr("goal 1 was not reached"));
  EXPECT_THAT(table, HasSubstr("-10.0 %"));
  EXPECT_THAT(table, HasSubstr("saves 20 %"));
}

TEST(TrustPage, DrawsTheLogAndTheEnergies) {
  const TrustLoop l = loop();
  const Page page = trust_page(l);
  // the pump's pressure, and bars
  EXPECT_EQ(page.plot_count(), 2);
  EXPECT_EQ(page.html(), trust_page(l).html());
  EXPECT_THAT(page.html(), HasSubstr("crane &lt;i&gt;"));
  EXPECT_THAT(page.html(), HasSubstr("goal 1 was not reached"));
  const std::string path =
      (std::filesystem::temp_directory_path() / "sparflow_trust_page.html").string();
  page.write(path);
  const auto report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "no chromium";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_drawn, 2);
}

}  // namespace
}  // namespace sparflow
