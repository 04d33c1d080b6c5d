// The page of selftest, on a result composed by hand.
#include "apps/report/model_pages/selftest_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "models/math/error.h"
#include "tests/apps/browser_check.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_support::arm_model;

Selftest by_hand(const Machine& machine) {
  Selftest t;
  const auto add = [&](const char* key, Visibility visibility, double times) -> InjectedEffect& {
    InjectedEffect e;
    e.effect = parse_effect(key, machine);
    e.id = e.effect.effect->info().id;
    e.at = "arm";
    e.stage = "force";
    e.visibility = visibility;
    e.times80 = times;
    e.times95 = 1.2 * times;
    e.separated_by = e.effect.effect->info().separated_by;
    t.effects.push_back(e);
    return t.effects.back();
  };
  InjectedEffect& friction = add("coulomb_friction:arm", Visibility::kSeen, 0.11);
  friction.power = 1.0;
  friction.typical = {{"Fc", "N", 8000.0}};
  friction.smallest = {{"Fc", "N", 880.0}};
  friction.confused_with = {{"load_friction:arm", 2.1, 0.98}};
  InjectedEffect& viscous = add("viscous_friction:arm", Visibility::kOnlyLarge, 3.0);
  viscous.power = 0.1;
  InjectedEffect& never =
      add("end_cushion:arm", Visibility::kNever, std::numeric_limits<double>::infinity());
  never.reason = "no motion of these logs excites it";
  t.checks = {{"coulomb_friction:arm", "force", 1.0, true, true, "coulomb_friction:arm"}};
  t.sets = {{"coulomb_friction:arm", "load_friction:arm"}};
  t.samples = 3000.0;
  t.duration = 60.0;
  t.logs = 1;
  return t;
}

TEST(SelftestPage, NamesWhatWouldBeFound) {
  const CraneModel model = arm_model();
  const std::string html = selftest_page(model, by_hand(model.machine)).html();
  EXPECT_THAT(html, HasSubstr("Of 3 candidate effects 1 would be named"));
  EXPECT_THAT(html, HasSubstr("Fc 880 N"));
  EXPECT_THAT(html, HasSubstr("no motion of these logs excites it"));
  EXPECT_THAT(html, HasSubstr("1 of 1 as predicted"));
  EXPECT_THAT(html, HasSubstr("coulomb_friction:arm, load_friction:arm"));
}

TEST(SelftestPageInBrowser, DrawsAndShowsItsVerdictFirst) {
  const CraneModel model = arm_model();
  const Page page = selftest_page(model, by_hand(model.machine));
  EXPECT_EQ(page.plot_count(), 1);
  const std::string path =
      (std::filesystem::path(SPARFLOW_BINARY_DIR) / "selftest page.html").string();
  std::string html = page.html();
  const std::string probe = R"(<script>
    const box = document.querySelector('.verdict').getBoundingClientRect();
    document.body.dataset.verdict = String(box.height > 20 && box.top >= 0 && box.bottom <= 900);
    </script></body>)";
  html.replace(html.find("</body>"), 7, probe);
  write_file_atomically(path, html);
  const test_support::BrowserReport report = test_support::check_page(path);
  std::filesystem::remove(path);
  if (!report.available) GTEST_SKIP() << "chromium is absent";
  EXPECT_THAT(report.errors, IsEmpty());
  EXPECT_EQ(report.plots_drawn, page.plot_count());
  EXPECT_EQ(report.body_data("verdict"), "true");
}

}  // namespace
}  // namespace sparflow
