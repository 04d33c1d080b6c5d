// Pages of diagnose and improve, on a diagnosis composed by hand, so that the pages are tested apart from the search.
#include "apps/report/model_pages/diagnose_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "apps/report/model_pages/diagnose_charts.h"
#include "apps/report/model_pages/effect_text.h"
#include "apps/report/model_pages/improve_page.h"
#include "models/math/error.h"
#include "tests/apps/browser_check.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_support::arm_log;
using testing_support::arm_model;

constexpr double kFriction = 5e3;  // [N]

Log log_with_friction(unsigned seed = 1) {
  return testing_support::arm_log_with_friction(kFriction, seed);
}

std::size_t force_channel(const Evidence& evidence) {
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (evidence.channels[c].kind == EvidenceKind::kForce) return c;
  }
  throw std::logic_error("no force in the evidence");
}

/// Evidence computed from a log, with effects and verdict set by hand.
Diagnosis missing_friction(const CraneModel& model) {
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, log_with_friction())});
  d.verdict = Verdict::kMissing;
  d.p_value = 0.003;
  DiagnosedEffect e;
  e.effect = parse_effect("coulomb_friction:arm", model.machine);
  e.id = "coulomb_friction";
  e.at = "arm";
  e.stage = "force";
  e.probability = e.set_probability = 0.99;
  e.parameters = {{"force", "N", "dry friction", 5010.0, 4890.0, 5130.0}};
  e.applied = {e.effect.effect, e.effect.at, {5010.0}, {4890.0}, {5130.0}};
  e.channels = {{force_channel(d.evidence), 5100.0, 420.0, 400.0}};
  e.p_value = 0.003;
  e.gain = 812.0;
  e.held_out_gain = 790.0;
  e.held_out_error = 31.0;
  e.rivals = {{"load_friction:arm", 55.0}};
  e.evidence = {"The force is 5 kN larger extending than the statics say, and smaller retracting"};
  d.effects.push_back(e);
  d.ranking = {{"coulomb_friction:arm", 812.0},
               {"load_friction:arm", 757.0},
               {"viscous_friction:arm", 310.0},
               {"sensor_delay", -4.0}};
  d.search.threshold = 6.5;
  d.indistinguishable = {{"coulomb_friction:arm", "load_friction:arm"}};
  d.experiments = {{"distinguishes coulomb_friction:arm from load_friction:arm",
                    "arm up and down slowly, with no load and with about 500 kg", 2.5, 0.2}};
  d.notes = {"pump main: nothing to say"};
  return d;
}

/// Writes and opens the page; expects no script errors, all figures drawn, and the verdict within the first 900 px of
/// a page as wide as a laptop's.
void expect_good_in_browser(const Page& page, const std::string& name) {
  const std::string path = (std::filesystem::path(SPARFLOW_BINARY_DIR) / (name + ".html")).string();
  std::string html = page.html();
  EXPECT_LT(html.size(), 3'000'000u);
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
  EXPECT_GT(report.plots_expected, 0);
  EXPECT_EQ(report.plots_expected, page.plot_count());
  EXPECT_EQ(report.plots_drawn, report.plots_expected);
  EXPECT_EQ(report.body_data("verdict"), "true");
}

TEST(DiagnosePage, VerdictNamesEffectParameterAndError) {
  const CraneModel model = arm_model();
  const std::string html = diagnose_page(model, missing_friction(model)).html();
  EXPECT_THAT(html, HasSubstr("force 5.01 \u00B1 0.12 kN"));
  EXPECT_THAT(html, HasSubstr("force of arm 5.10 \u2192 0.420 kN, sensor noise 0.40"));
  EXPECT_THAT(html, HasSubstr("Chance of such evidence if no effect were missing: below 0.003."));
  EXPECT_THAT(html, HasSubstr("One of: coulomb_friction:arm, load_friction:arm"));
  // 4 nats at 2.5 nats a minute
  EXPECT_THAT(
      html, HasSubstr("Record 2 minutes of: arm up and down slowly, with no load and with "
                      "about 500 kg (distinguishes coulomb_friction:arm from load_friction:arm)."));
  EXPECT_THAT(html, HasSubstr("against arm rod speed"));
}

TEST(DiagnosePage, ShowsTheProbabilityOfTheTerminalAndNoCertaintyThatIsNone) {
  const CraneModel model = arm_model();
  Diagnosis d = missing_friction(model);
  const auto in_terminal = [&] { return d.table(); };
  const auto in_page = [&] { return diagnose_page(model, d).html(); };
  d.effects[0].probability = 1.0;
  EXPECT_THAT(in_terminal(), HasSubstr("probability 100 %"));
  EXPECT_THAT(in_page(), HasSubstr(">100<"));
  d.effects[0].probability = 0.996;
  EXPECT_THAT(in_terminal(), HasSubstr("probability  99 %"));
  EXPECT_THAT(in_page(), ::testing::Not(HasSubstr(">100<")));
  EXPECT_THAT(in_page(), HasSubstr(">99<"));
  d.effects[0].probability = 0.29;  // 100 * 0.29 is less than 29 in floating point
  EXPECT_EQ(d.effects[0].shown_probability(), 29.0);
}

/// Beside the headline stands the error by which the search judged the effect, and why it is another one than the RMS.
TEST(DiagnosePage, ShowsTheErrorAsTheSearchWeighsIt) {
  const CraneModel model = arm_model();
  Diagnosis d = missing_friction(model);
  ASSERT_FALSE(d.effects[0].channels.empty());
  const std::string plain = diagnose_page(model, d).html();
  EXPECT_THAT(plain, ::testing::Not(HasSubstr("weighed")));
  d.stretches_weighed = true;
  ChannelGain& gain = d.effects[0].channels[0];
  gain.weighed_before = 641.0;
  gain.weighed_after = 123.0;
  const std::string html = diagnose_page(model, d).html();
  EXPECT_THAT(html, HasSubstr("641 \u2192 123 N (weighed by the variance of each stretch"));
  EXPECT_THAT(html,
              HasSubstr("With one variance of the noise for all stretches of motion nothing"));
  EXPECT_THAT(html, HasSubstr("weighed, without it"));
}

/// Beside references the error is compared with what these leave, and a variant of a law is told in words.
TEST(DiagnosePage, ShowsWhatTheReferencesLeaveAndTheVariantInWords) {
  const CraneModel model = arm_model();
  Diagnosis d = missing_friction(model);
  ASSERT_FALSE(d.effects[0].channels.empty());
  EXPECT_THAT(diagnose_page(model, d).html(), ::testing::Not(HasSubstr("in the references")));
  d.effects[0].channels[0].in_references = 0.5 * d.effects[0].channels[0].rmse_before;
  d.effects[0].parameters.push_back(
      {"form", "-", "", 2.0, 2.0, 2.0, true, "the highest load starves"});
  EXPECT_THAT(diagnose_page(model, d).html(), HasSubstr("in the references"));
  EXPECT_THAT(diagnose_page(model, d).html(), HasSubstr("form 2 (the highest load starves)"));
  EXPECT_THAT(d.table(), HasSubstr("form = 2 (the highest load starves)"));
  EXPECT_THAT(d.json(), HasSubstr("\"variant\": \"the highest load starves\""));
  EXPECT_THAT(d.json(), HasSubstr("\"rmse_references\""));
}

TEST(DiagnosePage, ChannelPictureRemovesTheEffect) {
  const CraneModel model = arm_model();
  const Diagnosis d = missing_friction(model);
  const ChannelPicture p = channel_picture(d, 0, force_channel(d.evidence));
  const auto rms = [](const Eigen::VectorXd& x) {
    return std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
  };
  // Without the effect: friction and noise. With it: noise, and friction that the filter smooths where motions begin.
  EXPECT_NEAR(rms(p.without), kFriction, 0.1 * kFriction);
  EXPECT_LT(rms(p.with), 0.2 * kFriction);
  // Measured minus residual is the model's prediction: the static force from which the log was made.
  EXPECT_TRUE(p.measured.allFinite());
  EXPECT_LT(rms(p.measured - p.without) / rms(p.measured), 1.0);
}

TEST(DiagnosePage, HasAHeadlineForEveryVerdict) {
  const CraneModel model = arm_model();
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, arm_log(0.8))});
  d.verdict = Verdict::kNone;
  d.p_value = 0.4;
  d.search.simulations = 300;  // by so few the smallest p-value would be told as a bound
  EXPECT_THAT(diagnose_page(model, d).html(),
              HasSubstr("no more than noise would (probability by chance: 0.4)"));
  d.p_value = 0.02;
  EXPECT_THAT(
      diagnose_page(model, d).html(),
      HasSubstr("contain more than noise would (probability by chance: 0.02), but no effect"));
  d.verdict = Verdict::kUnknown;
  d.unexplained =
      Unexplained{"force", "arm", {"arm angle"}, 0.8,
                  900.0,   300.0, {"N", 1.0},    "the force of arm swings with its angle"};
  const std::string html = diagnose_page(model, d).html();
  EXPECT_THAT(html, HasSubstr("The force of arm swings with its angle."));
  EXPECT_THAT(html, HasSubstr("the residual is 900 N RMS, the sensors\u0026#39; noise 300"));
  d.verdict = Verdict::kBadData;
  d.unexplained.reset();
  d.set_aside = {{"pA_arm", BadDataKind::kStuck, 12.0, 15.0, 0.05, "It rests at 81.2 bar for 3 s",
                  "Check the cable"}};
  EXPECT_THAT(diagnose_page(model, d).html(), HasSubstr("Check the cable"));
}

TEST(EffectText, ParametersShowTheirInterval) {
  EXPECT_EQ(parameter_text({"force", "N", "", 5010.0, 4890.0, 5130.0}),
            "force 5.01 \u00B1 0.12 kN");
  EXPECT_EQ(parameter_text({"limit", "l/min", "", 41.0, 38.0, 49.0}), "limit 41 (38 to 49) l/min");
  EXPECT_EQ(parameter_text({"scale", "", "", 0.97, std::nan(""), std::nan("")}), "scale 0.9700");
}

TEST(EffectText, BestStretchHoldsTheGain) {
  const Eigen::VectorXd time = Eigen::VectorXd::LinSpaced(1001, 0.0, 100.0);
  Eigen::VectorXd gain = Eigen::VectorXd::Zero(1001);
  gain.segment(620, 50).setConstant(1.0);
  gain.segment(100, 20).setConstant(-1.0);
  const Stretch at = best_stretch(time, gain, 20.0);
  EXPECT_LE(at.first, 620);
  EXPECT_GE(at.last, 670);
  EXPECT_LE(time[at.last - 1] - time[at.first], 20.0 + 1e-9);
}

TEST(DiagnosePageInBrowser, MissingEffect) {
  const CraneModel model = arm_model();
  const Page page = diagnose_page(model, missing_friction(model));
  EXPECT_EQ(page.plot_count(), 3);  // curves, residual against speed, ranking
  expect_good_in_browser(page, "diagnose page");
}

TEST(DiagnosePageInBrowser, Unknown) {
  const CraneModel model = arm_model();
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, log_with_friction())});
  d.verdict = Verdict::kUnknown;
  d.unexplained = Unexplained{
      "force", "arm", {"arm rod speed"}, 0.9,
      5e3,     300.0, {"N", 1.0},        "the force of arm changes sides with its speed"};
  const Page page = diagnose_page(model, d);
  EXPECT_EQ(page.plot_count(), 2);  // residual against two signals
  expect_good_in_browser(page, "diagnose page unknown");
}

TEST(DiagnosePageInBrowser, OscillationIsDrawnOverTime) {
  const CraneModel model = arm_model();
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, log_with_friction())});
  d.verdict = Verdict::kUnknown;
  d.unexplained = Unexplained{"force", "arm", {"time, 1.13 Hz"}, 0.9,
                              5e3,     300.0, {"N", 1.0},        "the force of arm swings"};
  const Page page = diagnose_page(model, d);
  EXPECT_THAT(page.html(), HasSubstr("Residual of the force of arm over time"));
  expect_good_in_browser(page, "diagnose page swing");
}

TEST(DiagnosePageInBrowser, BadChannelIsDrawnOverTimeWithTheFaultMarked) {
  const CraneModel model = arm_model();
  Log log = log_with_friction();
  Channel& pressure = testing_support::channel(log, "pA_arm");
  const Eigen::Index from = log.samples() / 3, length = log.samples() / 5;
  pressure.values.segment(from, length).setConstant(pressure.values[from]);
  Diagnosis d;
  const MachineSignals signals = make_signals(model.machine, log);
  d.evidence = collect_evidence(model, {signals});
  d.verdict = Verdict::kBadData;
  d.set_aside = find_bad_channels(model.machine, log, signals);
  ASSERT_EQ(d.set_aside.size(), 1u);
  ASSERT_EQ(d.set_aside[0].stretches.size(), 1u);
  const LineChart chart = bad_channel_chart(d.set_aside[0]);
  EXPECT_EQ(chart.y_axis.unit, "bar");
  EXPECT_NEAR(chart.series[0].y[from], pressure.values[from] / 1e5, 1e-9);
  ASSERT_EQ(chart.spans.size(), 1u);
  EXPECT_EQ(chart.spans[0].label, "stuck");
  // The machine rests shortly around it; the stuck samples are those with a single value.
  EXPECT_NEAR(chart.spans[0].from, log.time[from], 2.0);
  EXPECT_NEAR(chart.spans[0].to, log.time[from + length - 1], 2.0);
  const Page page = diagnose_page(model, d);
  EXPECT_EQ(page.plot_count(), 1);
  expect_good_in_browser(page, "diagnose page bad data");
}

TEST(DiagnosePageInBrowser, NothingMissing) {
  const CraneModel model = arm_model();
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, arm_log(0.8))});
  d.verdict = Verdict::kNone;
  d.p_value = 0.4;
  d.ranking = {{"coulomb_friction:arm", -0.5}};
  d.search.threshold = 6.5;
  const Page page = diagnose_page(model, d);
  EXPECT_GT(page.plot_count(), 1) << "residuals, beside the ranking";
  EXPECT_THAT(page.html(), HasSubstr("Residual of each quantity"));
  expect_good_in_browser(page, "diagnose page none");
}

TEST(ImprovePage, DrawsErrorsBeforeAndAfterAndOverWholeSteps) {
  const CraneModel model = fit(testing_support::arm_machine(), {log_with_friction(1)}).model;
  const std::string html =
      improve_page(extend(model, {parse_effect("coulomb_friction:arm", model.machine)},
                          {{log_with_friction(1)}, {}, {log_with_friction(2)}}))
          .html();
  EXPECT_THAT(html, HasSubstr("\"x_counts\":true"));
  EXPECT_THAT(html, HasSubstr("Unexplained share of each quantity before and after"));
  EXPECT_THAT(html, HasSubstr("{\"color\":-1,\"name\":\"before\"")) << "before is grey";
}

TEST(ImprovePageInBrowser, StepsOfExtend) {
  const CraneModel model = fit(testing_support::arm_machine(), {log_with_friction(1)}).model;
  const ExtendResult result = extend(model, {parse_effect("coulomb_friction:arm", model.machine)},
                                     {{log_with_friction(1)}, {}, {log_with_friction(2)}});
  const Page page = improve_page(result);
  const std::string html = page.html();
  EXPECT_THAT(html, HasSubstr("Error after each step"));
  EXPECT_THAT(html, HasSubstr("sensor noise"));
  EXPECT_GE(page.plot_count(), 3);  // overview, the force's error, its curves
  expect_good_in_browser(page, "improve page");
}

TEST(ImprovePage, CountsTheEffectsNotKeptHoweverTheReasonIsWorded) {
  const CraneModel model = fit(testing_support::arm_machine(), {log_with_friction(1)}).model;
  ExtendResult result = extend(model, {parse_effect("coulomb_friction:arm", model.machine)},
                               {{log_with_friction(1)}, {}, {log_with_friction(2)}});
  result.rejected = {result.steps[0]};
  result.reason = "nothing more is missing";
  result.stopped_because = result.reason + "; friction did no good: its interval contains zero";
  EXPECT_THAT(improve_page(result).html(),
              HasSubstr("othing more is missing; 1 more was tried and not kept."));
}

TEST(ImprovePage, StatesWhyNothingWasAdded) {
  ExtendResult result;
  result.model = arm_model();
  result.stopped_because = "nothing more is missing that these logs could show";
  const std::string html = improve_page(result).html();
  EXPECT_THAT(html, HasSubstr("Nothing was added"));
  EXPECT_THAT(html, HasSubstr("Nothing more is missing"));
}

}  // namespace
}  // namespace sparflow
