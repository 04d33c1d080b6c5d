// Page of a machine found from logs, on a result composed by hand, so that the page is tested apart from the estimate.
#include "apps/report/machine_pages/machine_from_log_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "problems/bundled.h"
#include "tests/apps/browser_check.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

HeldOutForces forces(const std::string& log, Eigen::Index rows, double error) {
  HeldOutForces f;
  f.log = log;
  f.time = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.1 * static_cast<double>(rows - 1));
  f.time.tail(rows / 2).array() += 40.0;  // another motion
  f.measured = 1e4 * f.time.array().sin();
  f.predicted = f.measured.array() + error;
  return f;
}

/// Bore of the jib and mass of the outer boom found from two logs; no forces of the extension.
MachineFromLog found_crane() {
  MachineFromLog found;
  found.machine = load_machine(bundled_file("machines/loader_crane.yaml"));
  found.name = found.machine->name;
  found.values = {{"cylinders[jib].bore", 0.149934, 0.000174, "m", "forces", "", {}, 1},
                  {"links[outer-boom].mass", 559.36, 13.9, "kg", "forces", "", {}, -1, 1}};
  const Eigen::Index rows[] = {40, 60, 0};
  for (std::size_t i = 0; i < 3; ++i) {
    HeldOutError e;
    e.cylinder = found.machine->cylinders[i].name;
    e.force_rmse = e.force_static = e.force_variation = e.stroke_rmse = std::nan("");
    if (rows[i] > 0) e.forces = {forces("one.csv", rows[i], 1e3), forces("two.csv", 20, 2e3)};
    e.force_rows = rows[i] > 0 ? rows[i] + 20 : 0;
    found.held_out.push_back(e);
  }
  return found;
}

/// The figures of one kind, as the page's scripts get them.
std::vector<nlohmann::json> figures(const Page& page, const std::string& kind) {
  std::vector<nlohmann::json> out;
  const std::string html = page.html();
  const std::string begin = "<script type=\"application/json\"";
  for (std::size_t at = html.find(begin); at != std::string::npos; at = html.find(begin, at + 1)) {
    const std::size_t from = html.find('>', at) + 1;
    const auto all =
        test_support::parsed_json(html.substr(from, html.find("</script>", from) - from));
    for (const auto& figure : all.is_array() ? all : nlohmann::json::array({all})) {
      if (figure.is_object() && figure.value("kind", "") == kind) out.push_back(figure);
    }
  }
  return out;
}

TEST(MachineFromLogPage, MarksWhatWasFoundWithItsInterval) {
  const auto drawings = figures(machine_from_log_page(found_crane()), "crane");
  ASSERT_EQ(drawings.size(), 1U);
  EXPECT_EQ(drawings[0]["marks"],
            (nlohmann::json{{{"name", "cylinder jib"}, {"lines", {"bore: 0.14993 ± 0.00017 m"}}},
                            {{"name", "link outer-boom"}, {"lines", {"mass: 559.36 ± 14 kg"}}}}));
  const auto& kinds = drawings[0]["kinds"];
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "mark"), 2);
  // The jib's cylinder is marked from pin to pin, as it is drawn.
  const auto& points = drawings[0]["frames"][0]["points"];
  std::vector<nlohmann::json> rods;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (kinds[k] == "rod") rods.push_back(points[k]);
  }
  ASSERT_EQ(rods.size(), 2U);
  EXPECT_EQ(points[kinds.size() - 2], rods[1]);
  EXPECT_EQ(points[kinds.size() - 1].size(), 2U);  // one point
}

TEST(MachineFromLogPage, DrawsEveryRowThatJudgesOnceOverTimeAndOnceAgainstTheOther) {
  const MachineFromLog found = found_crane();
  const Page page = machine_from_log_page(found);
  const auto clouds = figures(page, "scatter");
  ASSERT_EQ(clouds.size(), 2U);  // none of the extension
  EXPECT_EQ(clouds[0]["of"], found.held_out[0].force_rows);
  EXPECT_EQ(clouds[1]["of"], found.held_out[1].force_rows);
  EXPECT_TRUE(clouds[0]["diagonal"].get<bool>());
  // The first log's forces are predicted 1 kN too high, the second's 2 kN; figures have four digits or more.
  for (std::size_t k = 0; k < clouds.size(); ++k) {
    const auto& group = clouds[k]["groups"][0];
    ASSERT_EQ(group["x"].size(), group["y"].size());
    const std::size_t first = k == 0 ? 40 : 60;
    for (std::size_t i = 0; i < group["x"].size(); ++i)
      EXPECT_NEAR(group["y"][i].get<double>() - group["x"][i].get<double>(), i < first ? 1.0 : 2.0,
                  0.01);
  }
  const auto curves = figures(page, "lines");
  ASSERT_EQ(curves.size(), 4U);  // a log, a cylinder
  const Eigen::Index rows[] = {40, 60, 20, 20};
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const auto& both = curves[k]["series"];
    EXPECT_NEAR(both[1]["y"][3].get<double>() - both[0]["y"][3].get<double>(), k < 2 ? 1.0 : 2.0,
                0.01);
    for (const auto& series : both) {
      const auto& y = series["y"];
      const auto values =
          std::count_if(y.begin(), y.end(), [](const auto& v) { return !v.is_null(); });
      EXPECT_EQ(values, rows[k]) << k;
      EXPECT_EQ(static_cast<Eigen::Index>(y.size()), rows[k] + 1) << "one gap between two motions";
    }
  }
}

TEST(MachineFromLogPage, IsDrawnByABrowser) {
  const Page page = machine_from_log_page(found_crane());
  const std::string path =
      (std::filesystem::path(SPARFLOW_BINARY_DIR) / "machine from log page.html").string();
  write_file_atomically(path, page.html());
  const test_support::BrowserReport report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "chromium is absent";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_drawn, page.plot_count());
  EXPECT_THAT(report.dom, HasSubstr(">bore: 0.14993 ± 0.00017 m</text>"));
  EXPECT_THAT(report.dom, HasSubstr(">link outer-boom</text>"));
}

TEST(MachineFromLogPage, HasNoDrawingWhileSomethingIsAskedFor) {
  MachineFromLog found = found_crane();
  found.machine.reset();
  found.questions = {{"cylinders[jib].bore", "no load changes"}};
  const Page page = machine_from_log_page(found);
  EXPECT_THAT(figures(page, "crane"), IsEmpty());
  EXPECT_THAT(page.html(), HasSubstr("no load changes"));
}

}  // namespace
}  // namespace sparflow
