// Pages of strategies and pareto, on results composed by hand, opened in a browser.
#include "apps/report/motion_pages/strategies_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "apps/report/motion_pages/pareto_page.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "problems/problem_file.h"
#include "tests/apps/browser_check.h"
#include "tests/optimizer/synthetic_model.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

StrategyOutcome way(const MotionProblem& problem, const std::string& kind, double energy,
                    double duration) {
  StrategyOutcome o;
  o.kind = kind;
  o.duration = duration;
  o.shortest = 8.0;
  const auto n = static_cast<Eigen::Index>(problem.machine.joint_count());
  o.motion.t = Eigen::VectorXd::LinSpaced(3, 0.0, duration);
  o.motion.q = problem.start.transpose().replicate(3, 1);
  o.motion.q.col(1) += Eigen::Vector3d(0.0, 0.2, 0.4);
  o.motion.qd = o.motion.qdd = Eigen::MatrixXd::Zero(3, n);
  o.energy.total = energy;
  o.energy.throttling = {0.1 * energy, 0.1 * energy, 0.1 * energy};
  o.energy.useful = {0.3 * energy, 0.3 * energy, 0.1 * energy};
  o.energy.share_moving = {0.1, 0.6, 0.3, 0.0};
  o.peak_pressure = {200e5};
  o.mean_pressure = {150e5};
  return o;
}

StrategyComparison comparison(const MotionProblem& problem, double line_excess) {
  StrategyComparison c;
  c.problem = problem.name;
  c.idle_power = 4e3;
  c.shortest = 8.0;
  StrategyRow equal{"equal", 0.0, 16.0, {}}, own{"own", 0.0, 0.0, {}};
  equal.outcomes = {way(problem, kSequential, 102e3, 16.0),
                    way(problem, kJointLine, (1.0 + line_excess) * 100e3, 16.0),
                    way(problem, kOptimal, 100e3, 16.0)};
  own.outcomes = {way(problem, kSequential, 101e3, 20.0), way(problem, kJointLine, 120e3, 9.0),
                  way(problem, kOptimal, 104e3, 10.0)};
  StrategyOutcome none;
  none.kind = kTipLine;
  none.why = "needs 99.00 s";
  equal.outcomes.insert(equal.outcomes.begin() + 2, none);
  c.rows = {equal, own};
  return c;
}

void check_in_browser(const Page& page, const std::string& name) {
  const std::string path = (std::filesystem::path(SPARFLOW_BINARY_DIR) / name).string();
  write_file_atomically(path, page.html());
  const test_support::BrowserReport report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "chromium is absent";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_drawn, page.plot_count());
}

TEST(StrategiesPage, ShowsTheStrategiesOfOneProblemAndWhatIsMissing) {
  const MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  const CraneModel model = test_support::synthetic_model(problem.machine);
  const Page page = strategies_page({comparison(problem, 0.2)}, &model, &problem);
  EXPECT_THAT(page.html(), HasSubstr("needs 99.00 s"));
  EXPECT_THAT(page.html(), HasSubstr("sequential +2.0 %"));
  check_in_browser(page, "strategies page.html");
}

TEST(StrategiesPage, ShowsMediansAndTestsOfSeveralProblems) {
  const MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  std::vector<StrategyComparison> all;
  for (const double excess : {0.1, 0.2, 0.3}) all.push_back(comparison(problem, excess));
  const Page page = strategies_page(all, nullptr, nullptr);
  EXPECT_THAT(page.html(), HasSubstr("simultaneous to the best goal configuration +20.0 %"));
  check_in_browser(page, "strategies set page.html");
  const auto json =
      test_support::parsed_json(strategies_json(all, std::vector<Machine>(3, problem.machine)));
  const auto& line = json.at("summary").at("equal").at("simultaneous");
  EXPECT_NEAR(line.at("median_excess_percent").get<double>(), 20.0, 1e-9);
  EXPECT_NEAR(line.at("wilcoxon_p").get<double>(), 0.25, 1e-12);  // 2 / 2^3
  // At own times idle power counts: 101 + 80 against 104 + 40 kJ.
  EXPECT_NEAR(json["summary"]["own"]["sequential"]["median_excess_percent"].get<double>(),
              100.0 * (181.0 / 144.0 - 1.0), 1e-9);
  EXPECT_EQ(json["problems"][0]["strategies"]["tip_line"]["energy_J"], nullptr);
}

TEST(StrategiesPage, ShowsRoundingAsZeroExcess) {
  const MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  const std::string html =
      strategies_page({comparison(problem, 4e-14), comparison(problem, 0.2)}, nullptr, nullptr)
          .html();
  EXPECT_THAT(html, HasSubstr("[0,20]"));
}

TEST(ParetoPage, ShowsTheCurveItsLimitAndTheBestTimes) {
  const MotionProblem problem = load_problem(bundled_file("reaches/loader_crane_lift.yaml"));
  const CraneModel model = test_support::synthetic_model(problem.machine);
  ParetoCurve curve;
  for (const double t : {8.0, 10.0, 14.0, 20.0, 40.0}) {
    ParetoPoint p;
    p.duration = t;
    p.optimal = way(problem, kOptimal, 80e3 + 300e3 / t, t);
    p.sequential = t < 12.0 ? std::nan("") : 82e3 + 300e3 / t;
    p.simultaneous = 95e3 + 300e3 / t;
    curve.points.push_back(p);
  }
  curve.shortest = 8.0;
  curve.sequential_limit = 80e3;
  curve.simultaneous_limit = 95e3;
  curve.grid_limit = std::nan("");
  // dE/dT = -300e3/T^2 = -P: for 1 kW 17.3 s is best, so the point at 20 s; for 5 kW 7.7 s, so the shortest.
  curve.idle = idle_choices(curve.points, {1e3, 5e3});
  ASSERT_EQ(curve.idle.size(), 2U);
  EXPECT_EQ(curve.idle[0].duration, 20.0);
  EXPECT_EQ(curve.idle[1].duration, 8.0);
  EXPECT_FALSE(curve.idle[0].at_end);
  EXPECT_TRUE(idle_choices(curve.points, {0.0})[0].at_end);
  check_in_browser(pareto_page(model, problem, curve), "pareto page.html");
}

}  // namespace
}  // namespace sparflow
