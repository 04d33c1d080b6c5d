#include "apps/report/trust/trust_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// Length of the stretch of the held-out log that is drawn.
/// @threshold [s] 5..600; chosen: curves can still be told apart
constexpr double kDrawn = 40.0;

const ComparedSeries* find_series(const CompareResult& r, const std::string& stage,
                                  const std::string& at) {
  if (r.logs.empty()) return nullptr;
  for (const ComparedSeries& s : r.logs.front().series)
    if (s.stage == stage && s.at == at) return &s;
  return nullptr;
}

/// Square of the errors of a series over all its samples.
double squared_error(const ComparedSeries& s) {
  const auto known = s.measured.array().isFinite() && s.predicted.array().isFinite();
  return known.select(s.residual().array().square(), 0.0).sum();
}

/// One quantity of the held-out log: measured, and predicted before and after.
LineChart over_log(const TrustLoop& loop, const ComparedSeries& before,
                   const ComparedSeries& after) {
  const Eigen::VectorXd& time = loop.test_after.logs.front().signals.time;
  const double* begin = time.data();
  const Index n = std::upper_bound(begin, begin + time.size(), time[0] + kDrawn) - begin;
  const bool force =
      after.stage == "force";  // drawn in kN, so that the axis has room for its numbers
  const double si = force ? 1e3 : after.unit.si;
  const auto cut = [&](const Eigen::VectorXd& y) { return Eigen::VectorXd(y.head(n) / si); };
  LineChart chart;
  chart.title = fmt::format("{} of {}, measured and predicted",
                            force                   ? "Force"
                            : after.stage == "pump" ? "Pressure"
                                                    : "Working pressure",
                            after.at);
  chart.note = fmt::format("The first {:.0f} s of the held-out log of the plant.", kDrawn);
  chart.y_axis = {force ? "force" : "pressure", force ? "kN" : after.unit.name};
  chart.group = "held-out log";
  chart.x = time.head(n);
  chart.series.push_back({"measured", cut(after.measured), LineStyle::kMeasured, 0, {}, {}});
  chart.series.push_back({"before improve", cut(before.predicted), LineStyle::kBefore, -1, {}, {}});
  chart.series.push_back({"after improve", cut(after.predicted), LineStyle::kPredicted, 0, {}, {}});
  return chart;
}

/// The pump's pressure, and the force whose error fell most.
void add_curves(Page& page, const TrustLoop& loop) {
  if (loop.test_before.logs.empty() || loop.test_after.logs.empty()) return;
  const ComparedSeries *best_before = nullptr, *best_after = nullptr;
  double most = 1.0;
  for (const ComparedSeries& b : loop.test_before.logs.front().series) {
    const ComparedSeries* a = find_series(loop.test_after, b.stage, b.at);
    if (a == nullptr || a->measured.size() != b.measured.size()) continue;
    if (b.stage == "pump") page.plot(over_log(loop, b, *a));
    const double was = squared_error(b), is = squared_error(*a);
    if (b.stage != "force" || !(is > 0.0) || was / is <= most) continue;
    most = was / is;
    best_before = &b;
    best_after = a;
  }
  if (best_after != nullptr) page.plot(over_log(loop, *best_before, *best_after));
}

/// What changed on the held-out log.
Table errors(const TrustLoop& loop) {
  Table table;
  table.title = "Errors on the held-out log";
  table.columns = {{"quantity"}, {"unit"}, {"before improve", "", 3}, {"after improve", "", 3}};
  for (const StageScore& b : loop.test_before.scores) {
    for (const StageScore& a : loop.test_after.scores) {
      if (a.stage != b.stage || a.at != b.at || a.regime != b.regime) continue;
      table.rows.push_back({quantity_name(b.stage, b.at, b.regime), b.unit.name, b.rmse / b.unit.si,
                            a.rmse / a.unit.si});
    }
  }
  for (std::size_t p = 0;
       p < std::min(loop.test_before.energy.size(), loop.test_after.energy.size()); ++p)
    table.rows.push_back({"energy of pump " + loop.test_before.energy[p].pump, std::string("%"),
                          100.0 * loop.test_before.energy[p].relative_error,
                          100.0 * loop.test_after.energy[p].relative_error});
  table.note = "RMS errors; of the energy the relative error.";
  return table;
}

BarChart energies(const TrustLoop& loop) {
  BarChart chart;
  chart.title = "Predicted and true energy of each move";
  chart.note =
      "Optima of the model before and after improve, tracked on the plant by the same controller. "
      "True: the pump's pressure times its flow into the valves.";
  chart.value_axis = {"energy", "kJ"};
  chart.stacked = false;
  const auto n = static_cast<Index>(loop.moves.size());
  BarSeries series[] = {{"predicted before", Eigen::VectorXd(n), kBeforeColor},
                        {"true before", Eigen::VectorXd(n)},
                        {"predicted after", Eigen::VectorXd(n)},
                        {"true after", Eigen::VectorXd(n)},
                        {"sequential operator, true", Eigen::VectorXd(n)}};
  for (Index i = 0; i < n; ++i) {
    const TrustedMove& m = loop.moves[static_cast<std::size_t>(i)];
    chart.categories.push_back(m.name);
    const double values[] = {m.before.predicted, m.before.done() ? m.before.measured : kNaN,
                             m.after.predicted, m.after.done() ? m.after.measured : kNaN,
                             m.sequential.done() ? m.sequential.measured : kNaN};
    for (std::size_t k = 0; k < std::size(series); ++k) series[k].values[i] = 1e-3 * values[k];
  }
  chart.series.assign(std::begin(series), std::end(series));
  return chart;
}

Table moves(const TrustLoop& loop) {
  Table table;
  table.title = "Predicted against true energy";
  table.columns = {{"move"},
                   {"payload", "kg", 4},
                   {"time", "s", 3},
                   {"predicted before", "kJ", 4},
                   {"true", "kJ", 4},
                   {"error", "%", 2},
                   {"predicted after", "kJ", 4},
                   {"true", "kJ", 4},
                   {"error", "%", 2},
                   {"sequential operator", "kJ", 4},
                   {"saving", "%", 3},
                   {"joint PI", "kJ", 4}};
  for (const TrustedMove& m : loop.moves) {
    const auto kJ = [](const TrackedMotion& t) { return t.done() ? 1e-3 * t.measured : kNaN; };
    table.rows.push_back(
        {m.name, m.payload, m.duration, 1e-3 * m.before.predicted, kJ(m.before),
         m.before.done() ? 100.0 * m.before.error() : kNaN, 1e-3 * m.after.predicted, kJ(m.after),
         m.after.done() ? 100.0 * m.after.error() : kNaN, kJ(m.sequential),
         m.after.done() && m.sequential.done() ? 100.0 * m.saving() : kNaN, kJ(m.joint_pi)});
  }
  for (const TrustedMove& m : loop.moves)
    for (const TrackedMotion* t : {&m.before, &m.after, &m.sequential, &m.joint_pi})
      if (!t->done()) table.note += fmt::format("{}: {}. ", m.name, t->failure);
  return table;
}

}  // namespace

void add_trust(Page& page, const TrustLoop& loop, const std::string& heading_prefix) {
  page.section(heading_prefix + "A model of the plant, before and after improve");
  page.paragraph(fmt::format(
      "The dynamic plant of {} wrote {:.0f} s of an operator's work to learn from and {:.0f} s to "
      "judge on; its laws are none of the model's. {}",
      loop.machine, loop.train_seconds, loop.test_seconds, trust_story(loop)));
  add_curves(page, loop);
  page.table(errors(loop));
  if (loop.moves.empty()) return;
  page.section(heading_prefix + "Predicted and true energy");
  page.paragraph(trust_headline(loop) + ".");
  page.plot(energies(loop));
  page.table(moves(loop));
}

Page trust_page(const TrustLoop& loop) {
  Page page("Predicted and true energy: " + loop.machine);
  page.subtitle("a model learned from the dynamic plant, improved, and its optima tracked on it");
  const TrustSums s = sums_of(loop);
  const bool better = s.moves > 0 && s.error_after <= s.error_before;
  page.verdict(better ? Tone::kGood : Tone::kWarning, trust_headline(loop) + ".",
               trust_story(loop));
  if (loop.interrupted) page.banner("Interrupted: not every move was tracked.");
  add_trust(page, loop);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("seed", std::to_string(loop.seed));
  page.provenance("effects of the plant", loop.effects.empty()
                                              ? "default"
                                              : fmt::format("{}", fmt::join(loop.effects, " ")));
  return page;
}

}  // namespace sparflow
