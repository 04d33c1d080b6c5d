// One ranking feeds headline, stage at fault, tiles, colours, terminal and JSON: each test takes one result and holds all
// outputs against each other.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <tuple>

#include "apps/report/model_pages/compare_page.h"
#include "apps/report/model_pages/diagnose_page.h"
#include "apps/report/model_pages/improve_page.h"
#include "apps/report/page/escape.h"
#include "models/math/units.h"
#include "tests/identification/arm_log.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing_support::arm_log;
using testing_support::arm_log_with_friction;
using testing_support::arm_model;
using testing_support::channel;
using units::kBar;

constexpr double kSensorNoise = 0.5;  // [bar]

/// The arm on a constant supply of 140 bar by the model, and of 140 + `off` bar by the log, where it varies by 0.3 bar.
CraneModel with_constant_supply(CraneModel model) {
  model.machine.pumps[0].type = PumpType::kConstantPressure;
  model.pumps[0].standby = 140.0 * kBar;
  return model;
}

Log supplied(Log log, double off) {
  Eigen::VectorXd& p = channel(log, "p_main").values;
  for (Eigen::Index k = 0; k < p.size(); ++k)
    p[k] = (140.0 + off + 0.3 * std::sin(0.8 * log.time[k])) * kBar;
  return log;
}

CraneModel with_pressure_off(double bar) {
  CraneModel model = arm_model();
  model.cylinders[0].extend = testing_support::linear_process(
      (4.0 + bar) * kBar, 1.0 / model.machine.cylinders[0].area_piston());
  return model;
}

const char* class_of(Grade grade) {
  return grade == Grade::kGood ? "good" : grade == Grade::kPoor ? "bad" : "warning";
}

/// The piece of a text from the first occurrence of `from` up to the next `to`; "" when there is none.
std::string piece(const std::string& text, const std::string& from, const std::string& to) {
  const std::size_t first = text.find(from);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find(to, first) - first);
}

/// Where the error of the first entry of the ranking arises, by JSON alone.
nlohmann::json cause_in(const nlohmann::json& ranking) {
  nlohmann::json at = ranking[0];
  while (!at["inherited_from"].is_null()) {
    for (const nlohmann::json& r : ranking) {
      if (r["words"] == at["inherited_from"]) {
        at = r;
        break;
      }
    }
  }
  return at;
}

std::size_t rank_of(const CompareResult& result, const nlohmann::json& item) {
  return result.ranking.place(item["stage"], item["at"], item["regime"]);
}

/// Holds terminal, JSON and page of one comparison against each other.
void expect_one_ranking(const CraneModel& model, const CompareResult& result) {
  const std::string text = compare_table(result), html = compare_page(model, result).html();
  const auto json = test_support::parsed_json(compare_json(result));
  ASSERT_FALSE(result.ranking.empty());
  // worst grade first, own errors before inherited ones, the larger unexplained share before the smaller
  const std::vector<RankedError>& errors = result.ranking.errors;
  const auto key = [](const RankedError& e) {
    return std::tuple(-static_cast<int>(e.grade), e.source >= 0, -e.unexplained);
  };
  for (std::size_t k = 0; k + 1 < errors.size(); ++k)
    EXPECT_LE(key(errors[k]), key(errors[k + 1])) << k << " of " << errors.size();
  // the headline, in all three
  const std::string headline = json["headline"];
  EXPECT_THAT(text, HasSubstr("\n" + headline + ".\n"));
  EXPECT_THAT(html,
              HasSubstr(fmt::format("<div class=\"verdict {}\"><strong>{}</strong>",
                                    class_of(result.ranking.grade()), html_escape(headline))));
  EXPECT_EQ(json["grade"], json["ranking"][0]["grade"]);
  if (json["grade"] != "good") {
    EXPECT_THAT(headline, HasSubstr(json["ranking"][0]["words"].get<std::string>()));
  }
  // the stage at fault is where the first of the ranking comes from
  const nlohmann::json cause = cause_in(json["ranking"]);
  const std::string sentence = json["stage_at_fault"]["sentence"];
  if (json["stage_at_fault"]["stage"].is_null()) {
    EXPECT_EQ(json["grade"], "good") << sentence;
  } else {
    EXPECT_EQ(json["stage_at_fault"]["stage"], cause["stage"]);
    EXPECT_EQ(json["stage_at_fault"]["at"], cause["at"]);
    EXPECT_THAT(sentence, HasSubstr("arises in the " + cause["words"].get<std::string>()));
  }
  EXPECT_THAT(html, HasSubstr(html_escape(sentence)));
  // grades and explained shares: ranking, stages, rows of the terminal, rows of the page
  for (const nlohmann::json& r : json["ranking"]) {
    const std::string words = r["words"], stage = r["stage"], at = r["at"], regime = r["regime"];
    const auto& score =
        regime.empty() ? json["stages"][stage][at] : json["stages"][stage][at][regime];
    EXPECT_EQ(score["grade"], r["grade"]) << words;
    std::string capital = words;
    capital[0] = static_cast<char>(std::toupper(capital[0]));
    const std::string row = piece(html, "<td>" + capital + "</td>", "</tr>");
    EXPECT_THAT(row, HasSubstr(">" + r["grade"].get<std::string>() + "<")) << words;
    EXPECT_THAT(row, HasSubstr(html_escape(r["error"].get<std::string>())));
    if (stage == "energy") continue;
    EXPECT_EQ(score["explained_percent"], r["explained_percent"]);
    const std::string line = piece(
        text, fmt::format("\n{:<12}{} ", stage, regime.empty() ? at : at + " " + regime), "\n\n");
    EXPECT_THAT(line.substr(0, line.find('\n', 1)),
                HasSubstr(fmt::format(" {:.0f}  {}", r["explained_percent"].get<double>(),
                                      r["grade"].get<std::string>())));
  }
  // a tile has colour and share of the first of its stage
  for (const RankedError* r : result.ranking.worst_of_stages()) {
    if (r->stage == "energy") continue;
    const std::string tiles = piece(html, "<div class=\"tiles\">", "<h");
    EXPECT_THAT(tiles, HasSubstr(fmt::format("{:.0f} % explained", r->explained_percent())));
    const std::string number = r->amount.substr(0, r->amount.find(' '));
    const std::size_t at = tiles.find("<div class=\"tile-value\">" + number + " ");
    ASSERT_NE(at, std::string::npos) << r->words;
    const std::size_t start = tiles.rfind("<div class=\"tile ", at);
    EXPECT_EQ(tiles.substr(start + 17, tiles.find('"', start + 17) - start - 17),
              class_of(r->grade))
        << r->words;
  }
  // regions and motions are in the order of the ranking
  for (const char* list : {"worst", "worst_segments"}) {
    for (std::size_t i = 1; i < json[list].size(); ++i)
      EXPECT_LE(rank_of(result, json[list][i - 1]), rank_of(result, json[list][i])) << list;
  }
}

TEST(OneRanking, ARightModelIsGoodEverywhere) {
  const CraneModel model = arm_model();
  const CompareResult result = compare(model, {arm_log(kSensorNoise)});
  expect_one_ranking(model, result);
  EXPECT_EQ(result.ranking.grade(), Grade::kGood);
}

TEST(OneRanking, AWrongForceIsNamedByAllAndThePressuresThatInheritItComeBehind) {
  const CraneModel model = arm_model();
  const CompareResult result = compare(model, {arm_log_with_friction(40e3)});
  expect_one_ranking(model, result);
  EXPECT_EQ(result.ranking.errors[0].stage, "force");
  EXPECT_THAT(compare_headline(result), HasSubstr("misses the force of arm"));
}

TEST(OneRanking, AWrongPressureModelAndAWrongMarginAreNamedByAll) {
  const CraneModel pressure = with_pressure_off(30.0);
  const CompareResult off = compare(pressure, {arm_log(kSensorNoise)});
  expect_one_ranking(pressure, off);
  EXPECT_EQ(off.ranking.cause()->words, "working pressure of arm extending");
  CraneModel margin = arm_model();
  margin.cylinders[0].margin += 25.0 * kBar;
  const CompareResult late = compare(margin, {arm_log(kSensorNoise)});
  expect_one_ranking(margin, late);
  EXPECT_EQ(late.ranking.cause()->words, "pressure of pump main");
}

// The case of a real crane: the headline said the force, the stage at fault the supply, which is 10 bar off.
TEST(OneRanking, AForceThatIsWrongAndASupplyThatIsOffHaveOneOrder) {
  const CraneModel model = with_constant_supply(arm_model());
  const CompareResult result = compare(model, {supplied(arm_log_with_friction(40e3), 9.85)});
  expect_one_ranking(model, result);
  EXPECT_EQ(result.ranking.cause()->words, "force of arm");
}

// A supply that hardly varies and is 3 bar of 140 off has a fit below -200 %; no output shows it beside a green tile.
TEST(OneRanking, NoGreenTileShowsANegativeFit) {
  const CraneModel model = with_constant_supply(arm_model());
  const CompareResult result = compare(model, {supplied(arm_log(kSensorNoise), 3.0)});
  const StageScore* pump = result.find("pump", "main");
  ASSERT_NE(pump, nullptr);
  EXPECT_LT(pump->fit_percent, -200.0);
  expect_one_ranking(model, result);
  EXPECT_EQ(result.ranking.find("pump", "main")->grade, Grade::kGood);
  EXPECT_GT(result.ranking.find("pump", "main")->explained_percent(), 85.0);
  const std::string number = fmt::format("{:.0f}", pump->fit_percent).substr(0, 3);  // "-12"
  EXPECT_THAT(compare_table(result), Not(HasSubstr(number)));
  // 2.1 % of the energy is not good, and its source is the supply
  EXPECT_EQ(result.ranking.errors[0].stage, "energy");
  EXPECT_THAT(compare_headline(result), HasSubstr("except for the energy of pump main: -2."));
  EXPECT_EQ(result.ranking.at_fault()->words, "pressure of pump main");
}

TEST(OneRanking, WhereNothingButZeroIsMeasuredAnErrorExplainsNothing) {
  // with a lever of reversed sign no rod moves as commanded, so that the measured flow is zero
  Log log = arm_log(kSensorNoise);
  channel(log, "u_arm").values *= -1.0;
  const CompareResult result = compare(arm_model(), {log});
  const std::vector<RankedError>& errors = result.ranking.errors;
  const auto flow = std::find_if(errors.begin(), errors.end(),
                                 [](const RankedError& e) { return e.stage == "flow"; });
  ASSERT_NE(flow, errors.end());
  ASSERT_EQ(flow->scale, 0.0);
  ASSERT_GT(flow->error, 0.0);
  EXPECT_EQ(flow->explained_percent(), 0.0);
  EXPECT_EQ(flow->grade, Grade::kPoor);
}

TEST(OneRanking, StagesThatAMachineFileCannotPredictAreNowhere) {
  const CraneModel model = CraneModel::untrained(testing_support::arm_machine());
  CompareResult result = compare(model, {arm_log_with_friction(40e3)});
  keep_stages(model.machine, {"force", "flow_sensor"}, result);
  expect_one_ranking(model, result);
  EXPECT_EQ(result.ranking.errors.size(), 1u);
  EXPECT_THAT(compare_table(result), Not(HasSubstr("\nflow ")));
}

// ------------------------------------------------------------------ before and after

/// One step from a model to another, judged on one log.
ExtendResult one_step(const CraneModel& before, const CraneModel& after, const Log& log) {
  ExtendResult r;
  r.model = after;
  const EffectAt friction = parse_effect("coulomb_friction:arm", r.model.machine);
  ExtendStep step;
  step.added = "coulomb_friction:arm";
  step.title = "Coulomb friction, arm";
  step.stage = "force";
  step.effect = {friction.effect, friction.at, {20e3}, {19e3}, {21e3}};
  step.judged_on = "test logs";
  step.before = compare(before, {log});
  step.after = compare(after, {log});
  step.change = error_change(r.model.machine, step.before, step.after, "force", "arm");
  r.steps = {step};
  r.stopped_because = r.reason = "all effects asked for were added";
  return r;
}

/// A pressure model that was 60 bar off and is right then.
ExtendResult better_everywhere() {
  return one_step(with_pressure_off(60.0), arm_model(), arm_log(kSensorNoise));
}

/// Friction that the model lacked is taken in; learning anew makes a pressure, and with it the energy, wrong by 60 bar.
ExtendResult better_and_worse() {
  CraneModel after = with_pressure_off(60.0);
  const EffectAt friction = parse_effect("coulomb_friction:arm", after.machine);
  after.effects = {{friction.effect, friction.at, {20e3}, {}, {}}};
  return one_step(arm_model(), after, arm_log_with_friction(20e3));
}

void expect_one_change(const ExtendResult& r) {
  const std::string html = improve_page(r).html();
  const auto json = test_support::parsed_json(r.json());
  EXPECT_EQ(json["headline"], r.brief());
  EXPECT_THAT(r.table(), HasSubstr(r.brief()));
  std::string capital = r.brief();
  capital[0] = static_cast<char>(std::toupper(capital[0]));
  EXPECT_THAT(html, HasSubstr(fmt::format("<div class=\"verdict {}\"><strong>{}</strong>",
                                          class_of(r.grade()), html_escape(capital))));
  EXPECT_EQ(json["grade"], grade_word(r.grade()));
  std::size_t worse = 0;
  for (const nlohmann::json& q : json["changes"]) worse += q["change"] == "worse" ? 1 : 0;
  EXPECT_EQ(worse == 0, r.brief().find("nothing worse by 2 %") != std::string::npos);
}

TEST(OneRanking, APageIsGreenOnlyWhenNothingBecameWorse) {
  const ExtendResult good = better_everywhere();
  expect_one_change(good);
  EXPECT_EQ(good.grade(), Grade::kGood) << good.brief();
  const ExtendResult mixed = better_and_worse();
  expect_one_change(mixed);
  EXPECT_NE(mixed.grade(), Grade::kGood);
  EXPECT_THAT(mixed.brief(), HasSubstr("worse: "));
  EXPECT_THAT(mixed.brief(), HasSubstr("working pressure of arm extending"));
  EXPECT_THAT(mixed.brief(), HasSubstr("energy of pump main"));
  ExtendResult on_training = better_everywhere();
  on_training.steps[0].judged_on = "training logs";
  EXPECT_NE(on_training.grade(), Grade::kGood);
}

TEST(OneRanking, TheHeadlineOfADiagnosisSaysWhatGotWorseOnTheTestLogs) {
  const CraneModel model = arm_model();
  const ExtendResult mixed = better_and_worse();
  Diagnosis d;
  d.evidence = collect_evidence(model, {make_signals(model.machine, arm_log_with_friction(20e3))});
  d.verdict = Verdict::kMissing;
  DiagnosedEffect e;
  e.effect = parse_effect("coulomb_friction:arm", model.machine);
  e.id = "coulomb_friction";
  e.at = "arm";
  e.stage = "force";
  e.probability = e.set_probability = 0.9967;
  e.applied = mixed.steps[0].effect;
  d.effects = {e};
  const std::string headline = headline_on_tests(d, &mixed);
  EXPECT_THAT(headline, HasSubstr("Missing: Coulomb friction, arm."));
  EXPECT_THAT(headline, HasSubstr("worse: "));
  const std::string text = d.table(headline), html = diagnose_page(model, d, &mixed).html();
  EXPECT_EQ(text.substr(0, headline.size()), headline);
  EXPECT_THAT(html, HasSubstr("<strong>" + html_escape(headline)));
  EXPECT_THAT(html, Not(HasSubstr("<div class=\"verdict good\">")));
  // one probability
  EXPECT_THAT(text, HasSubstr("probability  99 %"));
  EXPECT_THAT(html, HasSubstr(">99<"));
  EXPECT_EQ(test_support::parsed_json(d.json())["effects"][0]["probability_percent"], 99.0);
  // what the verdict withholds is named by none
  d.verdict = Verdict::kUnknown;
  EXPECT_TRUE(test_support::parsed_json(d.json())["effects"].empty());
  EXPECT_THAT(d.table(), HasSubstr("not proven"));
  EXPECT_THAT(diagnose_page(model, d).html(), HasSubstr("Found, but not proven"));
}

TEST(OneRanking, AnInterruptedResultSaysSoInItsHeadline) {
  ExtendResult r = better_everywhere();
  r.interrupted = true;
  expect_one_change(r);
  EXPECT_THAT(r.brief(), HasSubstr("Interrupted: "));
}

// "mass 58.61 kg (-53103630 .. 53103747)" was shown.
TEST(OneRanking, ANumberWithoutInformationIsShownToNobody) {
  ExtendResult r = better_everywhere();
  r.steps[0].effect.lower95 = {-53103630.0};
  r.steps[0].effect.upper95 = {53103747.0};
  r.model.effects = {r.steps[0].effect};
  EXPECT_THAT(r.table(), HasSubstr("Fc is not determined by these logs"));
  EXPECT_THAT(r.table(), Not(HasSubstr("53103747")));
  const std::string html = improve_page(r).html();
  EXPECT_THAT(html, HasSubstr("Fc is not determined by these logs"));
  EXPECT_THAT(html, Not(HasSubstr("53 10")));
  EXPECT_EQ(test_support::parsed_json(r.json())["steps"][0]["parameters"][0]["determined"], false);
}

}  // namespace
}  // namespace sparflow
