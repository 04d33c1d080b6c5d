// The page of benchmark, on a result composed by hand, opened in a browser.
#include "apps/report/motion_pages/benchmark_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "models/files/machine_file.h"
#include "problems/bundled.h"
#include "tests/apps/browser_check.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

BenchmarkedController controller(const std::string& name, double above) {
  BenchmarkedController c;
  c.name = name;
  c.words = "what " + name + " does";
  c.runs = 2;
  c.above = above;
  c.scenario_energy = Eigen::Vector2d(100.0 + above, 50.0 + above);
  c.scenario_time = Eigen::Vector2d(10.0, 12.0);
  c.reference_energy = Eigen::Vector2d(100.0, 50.0);
  return c;
}

BenchmarkedRun run_of(const Machine& machine, const std::string& name) {
  BenchmarkedRun run;
  run.controller = name;
  run.t = Eigen::Vector3d(0.0, 1.0, 2.0);
  run.power_kW = Eigen::Vector3d(0.0, 5.0, 1.0);
  run.loss_kW = Eigen::Vector3d(0.0, 2.0, 1.0);
  run.motion.t = run.t;
  run.motion.q.resize(3, machine.joint_count());
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Range r = machine.joints[static_cast<std::size_t>(j)].position;
    run.motion.q.col(j) = Eigen::Vector3d(r.lo, 0.5 * (r.lo + r.hi), r.hi);
  }
  run.motion.qd = run.motion.qdd = Eigen::MatrixXd::Zero(3, machine.joint_count());
  run.went = {{"gained in height", "", 3.0}, {"meter-in edge", "throttled", 4.0}};
  return run;
}

TEST(BenchmarkPage, DrawsAllFiguresAndNamesEveryFailure) {
  BenchmarkView view;
  view.headline = "Least energy: best";
  view.reference = "best";
  view.controllers = {controller("best", 0.0), controller("other <b>", 12.0)};
  view.failures = {{"lift", "other <b>", "3", "its process ended with code 7"}};
  view.shown = "lift";
  view.machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  view.runs = {run_of(view.machine, "best"), run_of(view.machine, "other <b>")};
  const Page page = benchmark_page(view);
  // a bar chart, two clouds, two cranes, two charts over time, where it went as bars and for each run as a Sankey diagram
  EXPECT_EQ(page.plot_count(), 10);
  EXPECT_EQ(page.html(), benchmark_page(view).html());
  EXPECT_THAT(page.html(), HasSubstr("its process ended with code 7"));
  EXPECT_THAT(page.html(), HasSubstr("other &lt;b&gt;"));
  const std::string path =
      (std::filesystem::temp_directory_path() / "sparflow_benchmark_page.html").string();
  page.write(path);
  const auto report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "no chromium";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_drawn, 10);
}

TEST(BenchmarkPage, IsWholeWithoutAnyRunThatWasDone) {
  BenchmarkView view;
  view.headline = "No run was done";
  view.reference = "best";
  view.controllers = {controller("best", std::nan(""))};
  view.controllers[0].scenario_energy = view.controllers[0].scenario_time =
      view.controllers[0].reference_energy = Eigen::VectorXd();
  const Page page = benchmark_page(view);
  EXPECT_EQ(page.plot_count(), 0);
  EXPECT_THAT(page.html(), HasSubstr("No run was done"));
}

}  // namespace
}  // namespace sparflow
