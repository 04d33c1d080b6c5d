#include "apps/report/model_pages/compare_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "apps/report/model_pages/compare_charts.h"
#include "models/math/error.h"
#include "models/math/units.h"
#include "tests/apps/browser_check.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing_support::arm_log;
using testing_support::arm_model;
using testing_support::channel;

constexpr double kNoise = 0.8;  // [bar]

/// The arm's log with friction that the model does not have: the measured force is larger when extending.
Log log_with_force(double friction) {
  Log log = arm_log(kNoise);
  const double area = testing_support::arm_machine().cylinders[0].area_piston();
  const Eigen::VectorXd& u = channel(log, "u_arm").values;
  const Eigen::VectorXd side = (u.array() > 0.0).cast<double>() - (u.array() < 0.0).cast<double>();
  channel(log, "pA_arm").values += side * (friction / area);
  return log;
}

void expect_compare_page_good(const Page& page, const std::string& name) {
  const std::string path = (std::filesystem::path(SPARFLOW_BINARY_DIR) / (name + ".html")).string();
  page.write(path);
  EXPECT_LT(std::filesystem::file_size(path), 3'000'000u);
  const test_support::BrowserReport report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "chromium is absent";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_expected, page.plot_count());
  EXPECT_EQ(report.plots_drawn, report.plots_expected);
}

TEST(ComparePage, CorrectModelIsGoodInEveryStage) {
  const CraneModel model = arm_model();
  const CompareResult result = compare(model, {arm_log(kNoise)});
  ASSERT_FALSE(result.ranking.empty());
  for (const RankedError& r : result.ranking.errors)
    EXPECT_EQ(r.grade, Grade::kGood) << r.words << " " << r.unexplained;
  const RankedError* pump = result.ranking.find("pump", "main");
  ASSERT_NE(pump, nullptr);
  // The filter keeps a part of the noise, for which the estimate has an allowance of a tenth: 15 % cover both.
  EXPECT_NEAR(pump->noise / units::kBar, kNoise, 0.15 * kNoise);
  EXPECT_THAT(compare_page(model, result).html(),
              HasSubstr("The model follows the measurements in every stage"));
}

TEST(ComparePage, FrictionIsNamedInTheVerdict) {
  const CraneModel model = arm_model();
  const CompareResult result = compare(model, {log_with_force(40e3)});
  ASSERT_FALSE(result.ranking.empty());
  EXPECT_EQ(result.ranking.errors[0].stage, "force");
  EXPECT_EQ(result.ranking.errors[0].grade, Grade::kPoor);
  const std::string html = compare_page(model, result).html();
  EXPECT_THAT(html,
              HasSubstr("The model misses the force of arm: 4"));  // friction of 40 kN, plus noise
  EXPECT_THAT(html, HasSubstr("kN RMS"));
  EXPECT_THAT(html, HasSubstr("arm.csv, 3000 samples, sha256 0000000000000000"));
}

TEST(ComparePage, NamesTheColumnsThatALogWithoutPressuresLacks) {
  const CraneModel model = arm_model();
  Log log = arm_log();
  for (const char* signal : {"u_arm", "pA_arm", "pB_arm", "p_main"})
    testing_support::remove_channel(log, signal);
  const Page page = compare_page(model, compare(model, {log}));
  EXPECT_EQ(page.plot_count(), 0);
  const std::string html = page.html();
  EXPECT_THAT(html, HasSubstr("Nothing could be compared"));
  EXPECT_THAT(html, HasSubstr("pA_arm_bar"));
}

TEST(ComparePage, DrawsNoMapWithoutAnArea) {
  // The tip of one lifting joint moves on an arc with width and height, so there is a map for each quantity.
  const CraneModel model = arm_model();
  const CompareResult result = compare(model, {arm_log(kNoise)});
  Page page("maps");
  add_working_area(page, model.machine, result, "");
  EXPECT_EQ(page.plot_count(), static_cast<int>(compared_quantities(result).size()));
  // With a joint that never moves nothing is compared, so nothing is drawn.
  Log still = arm_log();
  channel(still, "q_arm").values.setConstant(0.3);
  Page empty("no maps");
  add_working_area(empty, model.machine, compare(model, {still}), "");
  EXPECT_EQ(empty.plot_count(), 0);
}

TEST(ComparePage, ShareExplainedIsOneForALawAndZeroForNoise) {
  const Eigen::Index n = 2400;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
  Eigen::VectorXd noise(n);
  unsigned seed = 7;
  for (Eigen::Index k = 0; k < n; ++k) {
    seed = seed * 1664525u + 1013904223u;
    noise[k] = static_cast<double>(seed >> 8) / 16777216.0 - 0.5;
  }
  // Within 24 bins of a straight line 1/24^2 of its variance remains.
  EXPECT_NEAR(share_explained(x, 3.0 * x), 1.0 - 1.0 / 576.0, 1e-4);
  // The adjusted R^2 of noise is zero with a standard deviation of sqrt(2*23)/2400 = 0.003.
  EXPECT_LT(share_explained(x, noise), 0.012);
  EXPECT_EQ(share_explained(Eigen::VectorXd::Constant(n, 2.0), x), 0.0);
  EXPECT_EQ(share_explained(x.head(39), x.head(39)), 0.0);
  EXPECT_EQ(share_explained(Eigen::VectorXd::Constant(n, std::nan("")), x), 0.0);
}

TEST(ComparePageInBrowser, EveryFigureIsDrawn) {
  const CraneModel model = arm_model();
  expect_compare_page_good(compare_page(model, compare(model, {log_with_force(10e3), arm_log()})),
                           "compare page");
}

TEST(FitPageInBrowser, EveryFigureIsDrawn) {
  const FitResult result = fit(testing_support::arm_machine(), {arm_log(kNoise)});
  const Page page = fit_page(result);
  const std::string html = page.html();
  EXPECT_THAT(html, HasSubstr("All 2 pressure models were identified"));
  EXPECT_THAT(html, HasSubstr("Held-out motions: Scores"));
  EXPECT_THAT(html, HasSubstr("Working pressure of arm retracting"));
  EXPECT_THAT(html, Not(HasSubstr("not learned")));
  expect_compare_page_good(page, "fit page");
}

TEST(FitPage, TellsWhichStretchesTookNoPart) {
  Log log = testing_support::arm_log(0.3, 1);
  Eigen::VectorXd& x = testing_support::channel(log, "pA_arm").values;
  x.segment(1000, 500).setConstant(x[1000]);
  const std::string html =
      fit_page(fit(testing_support::arm_machine(), {log}, {testing_support::arm_log(0.3, 2)}))
          .html();
  EXPECT_THAT(html, HasSubstr("Faulty stretches took no part: pA_arm of arm.csv."));
  EXPECT_THAT(html, HasSubstr("pA_arm is stuck between 20.0 and"));
}

TEST(FitPage, NamesPressureModelsThatWereNotIdentified) {
  Log log = arm_log(kNoise);
  testing_support::remove_channel(log, "pB_arm");
  const std::string html = fit_page(fit(testing_support::arm_machine(), {log})).html();
  EXPECT_THAT(html, HasSubstr("1 of 2 pressure models were identified"));
  EXPECT_THAT(html, HasSubstr("Missing: arm retract"));
}

}  // namespace
}  // namespace sparflow
