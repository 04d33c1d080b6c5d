#include "apps/report/page/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/report/page/assets.h"
#include "models/math/error.h"
#include "models/math/nan.h"
#include "tests/apps/browser_check.h"
#include "tests/apps/sample_page.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// A file that is removed when the test ends.
class PageFile {
 public:
  explicit PageFile(const std::string& html) {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = (std::filesystem::path(SPARFLOW_BINARY_DIR) /
             (std::string("page ") + info->name() + ".html"))
                .string();
    write_file_atomically(path_, html);
  }
  ~PageFile() { std::filesystem::remove(path_); }
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

LineChart line_chart(const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  LineChart chart;
  chart.title = "a chart";
  chart.y_axis = {"pressure", "bar"};
  chart.x = x;
  chart.series.push_back({"measured", y, LineStyle::kMeasured, 0, {}, {}});
  return chart;
}

#define EXPECT_GOOD_PAGE(report)                                 \
  if (!(report).available) GTEST_SKIP() << "chromium is absent"; \
  EXPECT_THAT((report).errors, IsEmpty());                       \
  EXPECT_EQ((report).plots_drawn, (report).plots_expected)

TEST(Page, AssetsAreEmbeddedWholeAndCannotEndTheirScript) {
  for (const std::string name :
       {"uplot/uPlot.iife.min.js", "uplot/uPlot.min.css", "uplot/LICENSE", "page.css", "page.js",
        "line_charts.js", "svg_charts.js", "crane_drawing.js"}) {
    const std::string file =
        read_file(std::string(SPARFLOW_SOURCE_DIR) + "/apps/report/assets/" + name);
    EXPECT_EQ(page_asset(name), file) << name;
    EXPECT_THAT(file, Not(HasSubstr("</"))) << name;
  }
  EXPECT_TRUE(page_asset("no such file").empty());
}

TEST(Page, SameInputMakesTheSameBytes) {
  EXPECT_EQ(test_support::sample_page().html(), test_support::sample_page().html());
}

TEST(Page, MakesNoNetworkRequest) {
  const std::string html = test_support::sample_page().html();
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
  for (const char* request :
       {"src=\"http", "href=\"http", "@import", "url(http", "fetch(", "XMLHttp"}) {
    EXPECT_EQ(html.find(request), std::string::npos) << request;
  }
}

TEST(Page, FormatsNumbers) {
  EXPECT_EQ(display_number(0.0, 4), "0");
  EXPECT_EQ(display_number(1.23456, 3), "1.23");
  EXPECT_EQ(display_number(-1.23456, 3), "\u22121.23");
  EXPECT_EQ(display_number(1234.0, 4), "1234");
  EXPECT_EQ(display_number(20347.4, 5), "20\u202F347");
  EXPECT_EQ(display_number(1234567.0, 4), "1\u202F234\u202F567");
  EXPECT_EQ(display_number(9.9999, 3),
            "10.00");  // Rounding up may add one digit, but never removes one.
  EXPECT_EQ(display_number(1.5e-7, 3), "1.50e-07");
  EXPECT_EQ(display_number(kNaN, 4), "\u2014");
}

TEST(Page, TablesAlignNumbersAndNameUnitsInTheHeader) {
  Page page("t");
  Table table;
  table.columns = {{"cylinder"}, {"RMSE", "bar", 3}, {"samples"}};
  table.rows = {{"boom <1>", 1.2345, 12345.0}, {"jib", kNaN, 7.0}};
  page.table(table);
  const std::string html = page.html();
  EXPECT_THAT(html,
              HasSubstr("<th scope=\"col\" class=\"num\">RMSE <span class=\"unit\">[bar]</span>"));
  EXPECT_THAT(html, HasSubstr("<td>boom &lt;1&gt;</td><td class=\"num\">1.23</td>"
                              "<td class=\"num\">12\u202F345</td>"));
  EXPECT_THAT(html, HasSubstr("<td class=\"num\">\u2014</td><td class=\"num\">7</td>"));
}

TEST(Page, ChecksTheLengthOfTableRows) {
  Page page("t");
  Table table;
  table.columns = {{"a"}, {"b"}};
  table.rows = {{1.0}};
  page.table(table);
  EXPECT_THROW(page.html(), std::logic_error);
}

TEST(Page, ChecksTheLengthOfSeries) {
  Page page("t");
  page.plot(line_chart(Eigen::Vector3d(0, 1, 2), Eigen::Vector2d(0, 1)));
  EXPECT_THROW(page.html(), std::logic_error);
}

TEST(Page, ThinsLongSeriesToThreeMegabytesAndStatesIt) {
  Page page("long");
  const Eigen::Index n = 100000;
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, 0.0, 1234.5);
  for (int i = 0; i < 60; ++i) {
    page.plot(line_chart(x, Eigen::VectorXd::Random(n)));
  }
  const std::string html = page.html();
  EXPECT_LT(html.size(), 3'000'000u);
  EXPECT_GT(html.size(), 1'000'000u);  // Not thinned more than needed.
  EXPECT_THAT(html, HasSubstr("of 100000 points drawn"));
}

TEST(Page, DoesNotThinShortSeries) {
  Page page("short");
  page.plot(line_chart(Eigen::VectorXd::LinSpaced(500, 0, 1), Eigen::VectorXd::Random(500)));
  EXPECT_THAT(page.html(), Not(HasSubstr("points drawn")));
}

TEST(Page, ThrowsInputErrorForAFolderThatCannotBeWritten) {
  EXPECT_THROW(Page("t").write("/no such folder/page.html"), InputError);
}

TEST(PageInBrowser, SampleDrawsEveryFigureWithoutErrors) {
  const PageFile file(test_support::sample_page().html());
  const auto report = test_support::check_page(file.path());
  EXPECT_GOOD_PAGE(report);
  EXPECT_EQ(report.plots_expected, 8);
}

TEST(PageInBrowser, DarkThemeDrawsToo) {
  const PageFile file(test_support::sample_page().html());
  const auto report =
      test_support::check_page(file.path(), "--blink-settings=preferredColorScheme=0");
  EXPECT_GOOD_PAGE(report);
}

/// Figures of every kind that are empty, have only NaN, or have one point.
TEST(PageInBrowser, EmptyFiguresAreDrawnAsEmpty) {
  Page page("empty");
  page.plot(LineChart{});
  page.plot(line_chart(Eigen::VectorXd(0), Eigen::VectorXd(0)));
  page.plot(line_chart(Eigen::Vector3d(0, 1, 2), Eigen::Vector3d::Constant(kNaN)));
  page.plot(line_chart(Eigen::VectorXd::Constant(1, 3.0), Eigen::VectorXd::Constant(1, 5.0)));
  page.plot(line_chart(Eigen::Vector3d(0, 1, 2), Eigen::Vector3d::Constant(7.0)));
  LineChart band = line_chart(Eigen::Vector3d(0, 1, 2), Eigen::Vector3d(1, kNaN, 2));
  band.series[0].band_lower = Eigen::Vector3d(0, kNaN, 1);
  band.series[0].band_upper = Eigen::Vector3d(2, kNaN, 3);
  page.plot(band);

  page.plot(ScatterChart{});
  ScatterChart scatter;
  scatter.trend = true;
  scatter.groups = {{"none", Eigen::VectorXd(0), Eigen::VectorXd(0)},
                    {"NaN", Eigen::Vector2d(1, kNaN), Eigen::Vector2d(kNaN, 1)}};
  page.plot(scatter);
  scatter.groups.push_back({"one", Eigen::VectorXd::Ones(1), Eigen::VectorXd::Ones(1)});
  page.plot(scatter);

  page.plot(BarChart{});
  BarChart bars;
  bars.categories = {"a", "b"};
  bars.series = {{"s", Eigen::Vector2d(kNaN, -1.0)}, {"t", Eigen::Vector2d(kNaN, kNaN)}};
  page.plot(bars);
  bars.stacked = false;
  page.plot(bars);

  page.plot(HeatMap{});
  HeatMap map;
  map.x_edges = map.z_edges = Eigen::Vector2d(0, 1);
  map.values.setConstant(1, 1, kNaN);
  page.plot(map);
  map.values.setConstant(1, 1, 2.0);
  map.diverging = true;
  page.plot(map);

  page.plot(CraneDrawing{});
  CraneDrawing crane;
  crane.frames.resize(1);
  page.plot(crane);
  crane.frames[0].parts = {{PartKind::kLink, {{0, 0}, {0, 2}, {3, 2}}}, {PartKind::kPin, {}}};
  page.plot(crane);

  const PageFile file(page.html());
  const auto report = test_support::check_page(file.path());
  EXPECT_GOOD_PAGE(report);
  EXPECT_EQ(report.plots_expected, 18);
}

TEST(PageInBrowser, ShowsNamesWithMarkupAsText) {
  const std::string name =
      "</script><script>alert(1)</script> <!-- \"'& \u00D6lzylinder \u6CB9\u7F38 \xFF\xC3";
  Page page(name);
  page.subtitle(name);
  page.verdict(Tone::kBad, name, name);
  page.provenance(name, name);
  page.section(name);
  page.paragraph(name);
  page.details(name, name);
  page.tiles({{name, name, name, name, Tone::kGood}});
  Table table;
  table.columns = {{name, name}};
  table.rows = {{name}};
  page.table(table);
  LineChart lines = line_chart(Eigen::Vector2d(0, 1), Eigen::Vector2d(0, 1));
  lines.title = lines.note = lines.group = lines.series[0].name = lines.y_axis.unit = name;
  lines.markers = {{0.5, name}};
  lines.spans = {{0.1, 0.2, name}};
  page.plot(lines);
  ScatterChart scatter;
  scatter.groups = {{name, Eigen::Vector2d(0, 1), Eigen::Vector2d(0, 1)}};
  page.plot(scatter);
  BarChart bars;
  bars.categories = {name};
  bars.series = {{name, Eigen::VectorXd::Ones(1)}};
  page.plot(bars);
  CraneDrawing crane;
  crane.frames.resize(2);
  crane.obstacles = {{name, {{1, 1}}, 0.5}};
  crane.paths = {{name, {{0, 0}, {1, 1}}}};
  page.plot(crane);

  const std::string html = page.html();
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  const PageFile file(html);
  const auto report = test_support::check_page(file.path());
  EXPECT_GOOD_PAGE(report);
  EXPECT_THAT(report.dom, HasSubstr("\u00D6lzylinder \u6CB9\u7F38 \uFFFD\uFFFD"));
}

/// Every button of every figure saves a file that is not empty; pictures are PNGs.
TEST(PageInBrowser, FiguresCanBeSaved) {
  std::string html = test_support::sample_page().html();
  const std::string probe = R"(<script>
    const saved = [];
    URL.createObjectURL = (blob) => { saved.push(blob.type + (blob.size > 40 ? '' : ' empty')); return '#'; };
    HTMLAnchorElement.prototype.click = function () {};
    document.querySelectorAll('.tools button').forEach((b) => b.click());
    // Pictures are compressed by another thread in real time; the page's clock is virtual, so that work is what waits for it.
    const look = (turns) => {
      for (let work = 0; work < 5e7; ++work);
      document.body.dataset.saved = saved.sort().join(',');
      if (turns > 0 && saved.length < document.querySelectorAll('.tools button').length)
        setTimeout(look, 20, turns - 1);
    };
    setTimeout(look, 100, 100);
    </script></body>)";
  html.replace(html.find("</body>"), 7, probe);
  const PageFile file(html);
  const auto report = test_support::check_page(file.path());
  EXPECT_GOOD_PAGE(report);
  std::string expected;
  for (const char* type : {"image/png", "text/csv"}) {
    for (int i = 0; i < report.plots_expected; ++i)
      expected += (expected.empty() ? "" : ",") + std::string(type);
  }
  EXPECT_EQ(report.body_data("saved"), expected);
}

/// Moving the slider moves the crane and the cursors of the charts of its group, and no others.
TEST(PageInBrowser, SliderMovesCraneAndChartsOfItsGroup) {
  std::string html = test_support::sample_page().html();
  const std::string probe = R"(<script>
    const before = document.querySelector('.player output').textContent;
    const slider = document.querySelector('.player input');
    slider.value = 2;
    slider.dispatchEvent(new Event('input'));
    setTimeout(() => {
      const legend = (i) => [...document.querySelectorAll('#figure-' + i + ' .u-value')].map((e) => e.textContent).join();
      document.body.dataset.moved = String(before !== document.querySelector('.player output').textContent);
      document.body.dataset.instant = document.querySelector('.player output').textContent.slice(0, 10);
      document.body.dataset.same = legend(2);
      document.body.dataset.other = legend(3);
    }, 500);
    </script></body>)";
  html.replace(html.find("</body>"), 7, probe);
  const PageFile file(html);
  const auto report = test_support::check_page(file.path());
  EXPECT_GOOD_PAGE(report);
  EXPECT_EQ(report.body_data("moved"), "true");
  EXPECT_EQ(report.body_data("instant"), "t = 2.00 s");
  EXPECT_THAT(report.body_data("same"),
              ::testing::ContainsRegex("(1\\.9[0-9]+|2\\.0[0-9]+) s,.* kW"));
  EXPECT_THAT(report.body_data("other"), Not(HasSubstr("bar")));
}

/// The browser check itself must be able to fail.
TEST(PageInBrowser, CheckSeesErrorsAndFiguresThatAreNotDrawn) {
  std::string html = test_support::sample_page().html();
  const std::string figure = "\"kind\":\"heat\"";
  html.replace(html.find(figure), figure.size(), "\"kind\":\"none\"");
  html.replace(html.find("</body>"), 7,
               "<script>null.x</script><img src=\"http://127.0.0.1:9/a.png\"></body>");
  const PageFile file(html);
  const auto report = test_support::check_page(file.path());
  if (!report.available) GTEST_SKIP() << "chromium is absent";
  EXPECT_EQ(report.plots_drawn, report.plots_expected - 1);
  EXPECT_THAT(report.errors, ::testing::Contains(HasSubstr("null")));
  EXPECT_THAT(report.errors, ::testing::Contains(HasSubstr("Content Security Policy")));
  EXPECT_FALSE(report.good());
}

}  // namespace
}  // namespace sparflow
