#include "apps/report/model_pages/compare_causes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/model_pages/compare_charts.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Appends own and inherited error as shares of the measured variance, so that kN and bar can be compared. The shares
/// are of squared errors, because squares of independent errors add up and RMS errors do not.
void add_stages(Page& page, const CompareResult& result) {
  const std::vector<StageSplit>& stages = result.fault.stages;
  if (stages.empty()) return;
  BarChart chart;
  chart.title = "Own and inherited error of each stage";
  chart.note =
      "Mean squared error as a share of the square of the quantity's scale, by which the ranking "
      "judges; "
      "at 100 % nothing is explained. Own: the error beyond the sensor's noise when the input from "
      "the "
      "stage before is the measured one. Inherited: the change when that input is the predicted "
      "one.";
  chart.value_axis = {"squared error", "%"};
  const auto n = static_cast<Index>(stages.size());
  BarSeries own{"own", VectorXd(n)}, inherited{"inherited", VectorXd(n)};
  BarSeries noise{"sensor noise", VectorXd(n)};
  for (Index i = 0; i < n; ++i) {
    const StageSplit& s = stages[static_cast<std::size_t>(i)];
    chart.categories.push_back(s.words);
    const RankedError* ranked = result.ranking.find(s.stage, s.at, s.regime);
    const StageScore* score = result.find(s.stage, s.at, s.regime);
    const double scale =
        ranked != nullptr && score != nullptr ? ranked->scale / score->unit.si : 0.0;
    const auto share = [scale](double rms) {
      return scale > 0.0 ? 100.0 * rms * rms / (scale * scale) : kNaN;
    };
    // Where a law compensates the error that it inherits, the remaining error of both is drawn.
    const double own_error = s.compensates ? s.error : s.own;
    noise.values[i] = share(std::min(s.noise, own_error));
    own.values[i] = share(own_error) - noise.values[i];
    inherited.values[i] = s.compensates ? 0.0 : share(s.inherited);
  }
  chart.series = {std::move(own), std::move(inherited), std::move(noise)};
  page.plot(std::move(chart));
  Table table;
  table.title = "Where the error arises";
  table.columns = {{"stage"},        {"error", "", 3}, {"own", "", 3}, {"inherited", "", 3},
                   {"noise", "", 2}, {"unit"}};
  for (const StageSplit& s : stages)
    table.rows.push_back({capitalised(s.words), s.error, s.own, s.inherited, s.noise, s.unit});
  table.note =
      "RMS, without samples outside the training data. Where own and inherited errors are "
      "correlated, their squares do not add up; where they "
      "cancel, the law was learned with the wrong force and compensates it (the remaining error is "
      "drawn).";
  table.highlighted_row = result.fault.fault;
  page.table(std::move(table));
}

void add_tests(Page& page, const CompareResult& result) {
  constexpr std::size_t kMost = 12;
  const ResidualTests& tests = result.tests;
  if (tests.tests.empty()) return;
  std::string undecided;
  for (const std::string& sentence : tests.undecided()) undecided += sentence + ". ";
  if (tests.smallest_p() > tests.alarm) {
    page.paragraph(
        fmt::format("{}: {} tests of bias and of dependence on signals, over {} blocks of motion, "
                    "found no more than autocorrelated noise would show. {}",
                    undecided.empty() ? "No part of the error is systematic"
                                      : "No part of the error is significantly systematic",
                    tests.tested, tests.blocks, undecided));
    return;
  }
  Table table;
  table.title = "Systematic errors";
  table.columns = {
      {"finding"}, {"of the error", "%", 2}, {"p", "", 2}, {"independent samples", "", 3}};
  BarChart chart;
  chart.title = "Share of the error that is systematic";
  chart.width = FigureWidth::kHalf;
  chart.value_axis = {"of the squared error", "%"};
  std::vector<double> shares;
  for (const ResidualTest& t : tests.tests) {
    if (t.p_value > tests.alarm || table.rows.size() == kMost) continue;
    table.rows.push_back(
        {capitalised(t.sentence), 100.0 * t.share_explained, t.p_value, t.effective_samples});
    chart.categories.push_back(quantity_words(t.stage, t.at) +
                               (t.regime.empty() ? "" : " " + t.regime) + ": " +
                               (t.depends_on.empty() ? "offset" : t.depends_on));
    shares.push_back(100.0 * t.share_explained);
  }
  table.note = fmt::format(
      "The signs of whole blocks of motion are flipped at random ({} blocks, {} tests together); "
      "the "
      "chance that noise alone, whatever its autocorrelation, gives even one line of this table is "
      "{:.0f} %.",
      tests.blocks, tests.tested, 100.0 * tests.alarm);
  chart.series = {
      {"explained", Eigen::Map<VectorXd>(shares.data(), static_cast<Index>(shares.size()))}};
  page.plot(std::move(chart));
  page.table(std::move(table));
  if (!undecided.empty()) page.paragraph(undecided);
}

/// Appends the errors by regime of the stage at fault, or of the first stage; the JSON result has all stages.
void add_regimes(Page& page, const Machine& machine, const CompareResult& result) {
  if (result.regimes.empty()) return;
  std::string stage = result.regimes.front().stage, at = result.regimes.front().at;
  if (result.fault.fault >= 0) {
    stage = result.fault.stages[static_cast<std::size_t>(result.fault.fault)].stage;
    at = result.fault.stages[static_cast<std::size_t>(result.fault.fault)].at;
  }
  Table table;
  table.title = "Error by regime: " + quantity_words(stage, at);
  table.columns = {{"regime"},        {"RMSE", "", 3}, {"95 % interval"}, {"bias", "", 3},
                   {"95 % interval"}, {"unit"},        {"blocks", "", 3}};
  BarChart chart;
  chart.title = "Error by regime: " + quantity_words(stage, at);
  chart.width = FigureWidth::kHalf;
  std::vector<double> values;
  const auto interval = [](const Range& r) {
    return std::isfinite(r.lo)
               ? fmt::format("{} to {}", display_number(r.lo, 3), display_number(r.hi, 3))
               : std::string("too few motions");
  };
  for (const RegimeError& e : result.regimes) {
    if (e.stage != stage || e.at != at) continue;
    const std::string words = (e.regime.empty() ? "" : e.regime + ", ") + e.factor + ": " + e.level;
    table.rows.push_back({words, e.rmse, interval(e.rmse_ci95), e.bias, interval(e.bias_ci95),
                          e.unit, static_cast<double>(e.blocks)});
    chart.categories.push_back(words);
    chart.value_axis = {"RMS error", e.unit};
    values.push_back(e.rmse);
  }
  if (values.empty()) return;
  chart.series = {{"RMSE", Eigen::Map<VectorXd>(values.data(), static_cast<Index>(values.size())),
                   place_color(machine, stage, at)}};
  table.note =
      "Intervals are from a bootstrap of whole blocks of motion. The JSON result (--json) has all "
      "quantities.";
  page.plot(std::move(chart));
  page.table(std::move(table));
}

void add_segments(Page& page, const CompareResult& result) {
  if (result.segments.empty()) return;
  Table table;
  table.title = "Worst motions";
  table.columns = {{"motion"}, {"RMSE", "", 3}, {"unit"}};
  for (const WorstSegment& w : result.segments)
    table.rows.push_back({capitalised(w.sentence), w.rmse, w.unit});
  page.table(std::move(table));
}

}  // namespace

void add_bad_data(Page& page, const CompareResult& result) {
  if (result.bad_data.empty()) return;
  Table table;
  table.title = "Bad data";
  table.columns = {{"log"}, {"what was found"}, {"of the log", "%", 2}, {"in the errors"}};
  for (const BadChannelOfLog& b : result.bad_data)
    table.rows.push_back({b.file, bad_channel_sentence(b.bad), 100.0 * b.bad.share,
                          b.in_errors ? "yes" : "set aside"});
  table.note =
      "No model explains these channels, and nothing is learned from them. Where a model is "
      "judged, "
      "jumps are in the errors, because an effect may explain them, and so are ripples of a "
      "position, which hardly change a static force.";
  page.table(std::move(table));
}

void add_causes(Page& page, const Machine& machine, const CompareResult& result,
                const std::string& heading_prefix) {
  if (result.fault.stages.empty() && result.tests.tests.empty() && result.bad_data.empty()) return;
  page.section(heading_prefix + "Where the error arises");
  if (!result.fault.sentence.empty()) page.paragraph(result.fault.sentence);
  add_bad_data(page, result);
  add_stages(page, result);
  add_tests(page, result);
  add_regimes(page, machine, result);
  add_segments(page, result);
}

}  // namespace sparflow
