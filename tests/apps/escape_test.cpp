#include "apps/report/page/escape.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "apps/report/charts/chart_json.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

TEST(Escape, HtmlSpecialCharacters) {
  EXPECT_EQ(html_escape("<a href=\"x\">'&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/a&gt;");
  EXPECT_EQ(html_escape("\u00D6l 油 \U0001F3D7"), "\u00D6l 油 \U0001F3D7");
  EXPECT_EQ(html_escape(std::string("a\0b", 3)), "a\uFFFDb");
}

TEST(Escape, EachBytethatIsNotUtf8BecomesOneReplacement) {
  const std::string r = "\uFFFD";
  EXPECT_EQ(valid_utf8("\xD6l"), r + "l");                   // Latin-1
  EXPECT_EQ(valid_utf8("a\xC3"), "a" + r);                   // cut off
  EXPECT_EQ(valid_utf8("\xC0\xAF"), r + r);                  // overlong
  EXPECT_EQ(valid_utf8("\xE0\x80\x80"), r + r + r);          // overlong
  EXPECT_EQ(valid_utf8("\xED\xA0\x80"), r + r + r);          // surrogate
  EXPECT_EQ(valid_utf8("\xF4\x90\x80\x80"), r + r + r + r);  // beyond Unicode
  EXPECT_EQ(valid_utf8("\xF0\x9F\x8F\x97"), "\U0001F3D7");
}

TEST(Escape, ScriptSafeKeepsTheValue) {
  const nlohmann::json value = {{"name", "</script><!-- <b>"}};
  const std::string safe = script_safe(value.dump());
  EXPECT_EQ(safe.find('<'), std::string::npos);
  EXPECT_EQ(test_support::parsed_json(safe), value);
}

TEST(ChartJson, NumbersAreShortAndNaNIsNull) {
  EXPECT_EQ(number_json(1.0 / 3.0, 5).dump(), "0.33333");
  EXPECT_EQ(number_json(12.0, 5).dump(), "12");
  EXPECT_EQ(number_json(-0.0, 5).dump(), "0");
  EXPECT_EQ(number_json(123456.7, 5).dump(), "123460");
  EXPECT_TRUE(number_json(std::numeric_limits<double>::quiet_NaN(), 5).is_null());
  EXPECT_TRUE(number_json(std::numeric_limits<double>::infinity(), 5).is_null());
}

TEST(ChartJson, AutomaticColoursSkipLimits) {
  LineChart chart;
  chart.x = Eigen::Vector2d(0, 1);
  const Eigen::VectorXd y = chart.x;
  chart.series = {{"a", y, LineStyle::kPlain, -1, {}, {}},
                  {"limit", y, LineStyle::kLimit, -1, {}, {}},
                  {"b", y, LineStyle::kPlain, -1, {}, {}},
                  {"b, predicted", y, LineStyle::kPredicted, 1, {}, {}}};
  const nlohmann::json json = chart_json(chart, 100);
  EXPECT_EQ(json["series"][0]["color"], 0);
  EXPECT_EQ(json["series"][1]["color"], -1);
  EXPECT_EQ(json["series"][2]["color"], 1);
  EXPECT_EQ(json["series"][3]["color"], 1);
}

}  // namespace
}  // namespace sparflow
