#include "apps/report/model_pages/improve_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/model_pages/compare_charts.h"
#include "apps/report/model_pages/effect_text.h"
#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kLeastChange = 0.02;  // [-] of an error's logarithm, for the error to be drawn
constexpr double kCurveSeconds =
    30;  // [s] length of a stretch in which curves can still be compared by eye
constexpr std::size_t kMostErrorCharts = 12;

/// One error over the steps; entry 0 is before the first step, entry i after step i.
struct ErrorTrace {
  StageScore score;  // before the first step
  std::string words;
  VectorXd rmse;       // SI
  double noise = 0.0;  // SI, NaN = not known

  double largest_change() const {
    double most = 0.0;
    for (Index i = 1; i < rmse.size(); ++i)
      most = std::max(most, std::abs(std::log(rmse[i] / rmse[i - 1])));
    return most;
  }
};

std::string words_of(const StageScore& s) { return quantity_name(s.stage, s.at, s.regime); }

std::vector<ErrorTrace> traces_of(const ExtendResult& result) {
  std::vector<ErrorTrace> out;
  const auto steps = static_cast<Index>(result.steps.size());
  for (const StageScore& s : result.steps.front().before.scores) {
    ErrorTrace t;
    t.score = s;
    t.words = words_of(s);
    t.rmse = VectorXd::Constant(steps + 1, kNaN);
    t.rmse[0] = s.rmse;
    for (Index i = 0; i < steps; ++i) {
      const StageScore* a =
          result.steps[static_cast<std::size_t>(i)].after.find(s.stage, s.at, s.regime);
      if (a != nullptr) t.rmse[i + 1] = a->rmse;
    }
    t.noise = sensor_noise(result.model.machine, result.steps.back().after, s);
    out.push_back(std::move(t));
  }
  return out;
}

std::vector<Marker> step_markers(const ExtendResult& result) {
  std::vector<Marker> out;
  for (std::size_t i = 0; i < result.steps.size(); ++i) {
    const ExtendStep& s = result.steps[i];
    out.push_back({static_cast<double>(i + 1), s.added.empty() ? "- " + s.removed : s.added});
  }
  return out;
}

LineChart over_steps(const ExtendResult& result) {
  LineChart chart;
  const auto steps = static_cast<Index>(result.steps.size());
  chart.x_axis = {"step", ""};
  chart.x = VectorXd::LinSpaced(steps + 1, 0.0, static_cast<double>(steps));
  chart.x_counts = true;
  return chart;
}

/// Appends all errors before the first step and after the last, and what became of each.
void add_overview(Page& page, const ExtendResult& result) {
  const ModelChange change = result.change();
  BarChart chart;
  chart.title = "Unexplained share of each quantity before and after";
  chart.note = fmt::format(
      "Error beyond the sensor's noise over the quantity's scale, on the {}; up to 15 % is good, "
      "more "
      "than 50 % poor. Largest growth first.",
      result.steps.front().judged_on);
  chart.value_axis = {"unexplained", "%"};
  chart.stacked = false;
  const auto n = static_cast<Index>(change.quantities.size());
  BarSeries before{"before", VectorXd(n), kBeforeColor}, after{"after", VectorXd(n)};
  Table table;
  table.title = "Errors before and after";
  table.columns = {{"quantity and error"}, {""}, {"grade before"}, {"grade after"}};
  for (Index i = 0; i < n; ++i) {
    const QuantityChange& q = change.quantities[static_cast<std::size_t>(i)];
    chart.categories.push_back(q.before.words);
    before.values[i] = 100.0 * q.before.unexplained;
    after.values[i] = 100.0 * q.after.unexplained;
    table.rows.push_back({capitalised(q.text), std::string(change_word(q.kind)),
                          std::string(grade_word(q.before.grade)),
                          std::string(grade_word(q.after.grade))});
  }
  chart.series = {std::move(before), std::move(after)};
  if (n == 0) return;
  page.plot(std::move(chart));
  page.table(std::move(table));
}

void add_error_charts(Page& page, const ExtendResult& result, std::vector<ErrorTrace> traces) {
  std::erase_if(traces, [](const ErrorTrace& t) { return !(t.largest_change() > kLeastChange); });
  if (traces.size() > kMostErrorCharts) {
    std::stable_sort(traces.begin(), traces.end(), [](const ErrorTrace& a, const ErrorTrace& b) {
      return a.largest_change() > b.largest_change();
    });
    traces.resize(kMostErrorCharts);
  }
  for (const ErrorTrace& t : traces) {
    LineChart chart = over_steps(result);
    const auto [largest, unit] = readable_error(t.rmse.maxCoeff(), t.score.unit);
    const double scale = largest / t.rmse.maxCoeff();
    chart.title = capitalised(t.words);
    chart.note = fmt::format("{} to {} {}.", display_number(t.rmse[0] * scale, 3),
                             display_number(t.rmse[t.rmse.size() - 1] * scale, 3), unit);
    chart.width = FigureWidth::kHalf;
    chart.y_axis = {"RMS error", unit};
    chart.markers = step_markers(result);
    chart.series.push_back({"RMS error",
                            t.rmse * scale,
                            LineStyle::kPredicted,
                            place_color(result.model.machine, t.score.stage, t.score.at),
                            {},
                            {}});
    if (std::isfinite(t.noise)) {
      chart.series.push_back({"sensor noise",
                              VectorXd::Constant(chart.x.size(), t.noise * scale),
                              LineStyle::kLimit,
                              -1,
                              {},
                              {}});
    }
    page.plot(std::move(chart));
  }
}

std::string energy_text(const ExtendStep& step) {
  std::string text;
  for (const EnergyScore& b : step.before.energy) {
    for (const EnergyScore& a : step.after.energy) {
      if (a.pump != b.pump || !std::isfinite(b.relative_error) || !std::isfinite(a.relative_error))
        continue;
      text += fmt::format("{}{} {:+.2f} \u2192 {:+.2f} %", text.empty() ? "" : ", ", a.pump,
                          100.0 * b.relative_error, 100.0 * a.relative_error);
    }
  }
  return text.empty() ? "\u2014" : text;
}

Table steps_table(const std::string& title, const std::vector<ExtendStep>& steps) {
  Table table;
  table.title = title;
  table.columns = {
      {"step"},          {"effect"},      {"parameters, 95 % interval"}, {"error where it acts"},
      {"error overall"}, {"energy error"}};
  double number = 0.0;
  for (const ExtendStep& s : steps) {
    table.rows.push_back({++number, s.title, parameters_text(estimates_of(s.effect)),
                          change_text(s.change.own), change_text(s.change.overall),
                          energy_text(s)});
  }
  return table;
}

/// The series of a step whose squared error changed by the largest factor.
struct MostChanged {
  const LogComparison* log = nullptr;
  const ComparedSeries* before = nullptr;
  const ComparedSeries* after = nullptr;
};

MostChanged most_changed(const ExtendStep& step) {
  MostChanged best;
  double most = 0.0;
  for (std::size_t l = 0; l < std::min(step.before.logs.size(), step.after.logs.size()); ++l) {
    for (const ComparedSeries& b : step.before.logs[l].series) {
      for (const ComparedSeries& a : step.after.logs[l].series) {
        if (a.stage != b.stage || a.at != b.at || a.measured.size() != b.measured.size()) continue;
        double was = 0.0, is = 0.0;
        for (Index k = 0; k < a.measured.size(); ++k) {
          if (!std::isfinite(a.measured[k]) || !std::isfinite(b.measured[k])) continue;
          was += std::pow(b.predicted[k] - b.measured[k], 2);
          is += std::pow(a.predicted[k] - a.measured[k], 2);
        }
        if (!(was > 0.0) || !(is > 0.0)) continue;
        const double change = std::abs(std::log(is / was));
        if (change > most) most = change, best = {&step.after.logs[l], &b, &a};
      }
    }
  }
  return best;
}

void add_curves(Page& page, const Machine& machine, const ExtendStep& step) {
  const MostChanged m = most_changed(step);
  if (m.log == nullptr) return;
  const VectorXd& time = m.log->signals.time;
  const VectorXd gain =
      (m.before->residual().array().square() - m.after->residual().array().square()).matrix();
  const Stretch at =
      best_stretch(time, step.change.own > 1.0 ? VectorXd(-gain) : gain, kCurveSeconds);
  const Index n = at.last - at.first;
  const auto cut = [&](const VectorXd& y) { return VectorXd(y.segment(at.first, n)); };
  const double largest = cut(m.after->measured)
                             .array()
                             .isFinite()
                             .select(cut(m.after->measured).array().abs(), 0.0)
                             .maxCoeff();
  const auto [shown, unit] = readable_error(std::max(largest, 1e-300), m.after->unit);
  const double scale = shown / std::max(largest, 1e-300);
  LineChart chart;
  chart.title = fmt::format("{}: {}", capitalised(quantity_words(m.after->stage, m.after->at)),
                            step.added.empty() ? "without " + step.removed : "with " + step.added);
  chart.note = fmt::format(
      "{}, the {:.0f} s in which the change is largest. Only samples that count in the scores are "
      "drawn.",
      m.log->signals.file, kCurveSeconds);
  chart.y_axis = {m.after->stage == "force"            ? "force"
                  : m.after->stage.starts_with("flow") ? "flow"
                                                       : "pressure",
                  unit};
  chart.x = cut(time);
  const int color = place_color(machine, m.after->stage, m.after->at);
  chart.series.push_back(
      {"measured", cut(m.after->measured) * scale, LineStyle::kMeasured, color, {}, {}});
  chart.series.push_back(
      {"before", cut(m.before->predicted) * scale, LineStyle::kBefore, -1, {}, {}});
  chart.series.push_back(
      {"after", cut(m.after->predicted) * scale, LineStyle::kPredicted, color, {}, {}});
  page.plot(std::move(chart));
}

/// The effect with the values that later steps gave it; an effect that was removed, with its own values.
const AppliedEffect& in_the_model(const CraneModel& model, const AppliedEffect& e) {
  for (const AppliedEffect& m : model.effects) {
    if (m.effect == e.effect && m.at == e.at) return m;
  }
  return e;
}

/// Why improve() stopped, without the list of rejected effects, which have a section of their own.
std::string stopped_briefly(const ExtendResult& r) {
  if (r.rejected.empty()) return r.reason;
  return r.reason + fmt::format("; {} more {} tried and not kept", r.rejected.size(),
                                r.rejected.size() == 1 ? "was" : "were");
}

void set_verdict(Page& page, const ExtendResult& r) {
  if (r.steps.empty()) {
    page.verdict(tone_of(r.grade()), "Nothing was added", capitalised(r.stopped_because) + ".");
    return;
  }
  std::string text;
  for (const ExtendStep& s : r.steps)
    text += fmt::format("{}: {}. ", capitalised(s.title),
                        parameters_text(estimates_of(in_the_model(r.model, s.effect))));
  page.verdict(tone_of(r.grade()), capitalised(r.brief()),
               fmt::format("{}{}{}.", text, r.last ? "Stopped because " : "",
                           r.last ? stopped_briefly(r) : capitalised(stopped_briefly(r))));
}

void add_last(Page& page, const Diagnosis& d) {
  page.section("Remaining residuals");
  page.paragraph(d.headline());
  if (d.unexplained) {
    std::string on;
    for (const std::string& s : d.unexplained->depends_on) on += (on.empty() ? "" : ", ") + s;
    page.paragraph(d.unexplained->sentence + (on.empty() ? "" : " It depends on: " + on + "."));
  }
  for (const Experiment& e : d.experiments) page.paragraph(capitalised(e.sentence()) + ".");
}

}  // namespace

void add_steps(Page& page, const ExtendResult& result, const std::string& heading_prefix) {
  if (!result.steps.empty()) {
    const std::vector<ErrorTrace> traces = traces_of(result);
    page.section(heading_prefix + "Better and worse");
    add_overview(page, result);
    page.section(heading_prefix + "Error after each step");
    Table table = steps_table("Steps", result.steps);
    table.note = fmt::format(
        "Errors on the {}: RMS after the step relative to before; overall is the geometric mean "
        "over all "
        "compared quantities.",
        result.steps.front().judged_on);
    page.table(std::move(table));
    if (result.steps.size() > 1) {
      Table now;
      now.title = "In the model now";
      now.columns = {{"effect"}, {"parameters, 95 % interval"}};
      for (const AppliedEffect& e : result.model.effects)
        now.rows.push_back({e.key(result.model.machine), parameters_text(estimates_of(e))});
      now.note =
          "All are estimated together, so that each step changes the values of the earlier ones.";
      page.table(std::move(now));
    }
    add_error_charts(page, result, traces);
    page.section(heading_prefix + "Measured, before and after");
    for (const ExtendStep& s : result.steps) add_curves(page, result.model.machine, s);
  }
  if (!result.rejected.empty()) {
    page.section(heading_prefix + "Tried and not kept");
    Table table = steps_table("Changes that made the error worse", result.rejected);
    page.table(std::move(table));
    for (const ExtendStep& s : result.rejected) add_curves(page, result.model.machine, s);
  }
  for (const std::string& note : result.notes)
    page.paragraph(capitalised(note.ends_with('.') ? note : note + "."));
}

Page improve_page(const ExtendResult& result) {
  Page page("Extended model: " + result.model.machine.name);
  page.subtitle(fmt::format("{} step{}{}", result.steps.size(), result.steps.size() == 1 ? "" : "s",
                            result.rejected.empty()
                                ? ""
                                : fmt::format(", {} tried and not kept", result.rejected.size())));
  set_verdict(page, result);
  if (result.interrupted) {
    page.banner("Interrupted: the steps shown are whole, and more effects may be missing.");
  }
  add_steps(page, result);
  if (result.last) add_last(page, *result.last);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", result.model.machine.name);
  if (!result.model.steps.empty()) {
    for (const DataSource& d : result.model.steps.back().data) {
      page.provenance(d.use + " log", fmt::format("{}, {} rows, sha256 {}", d.file, d.rows,
                                                  d.sha256.substr(0, 16)));
    }
  }
  return page;
}

}  // namespace sparflow
