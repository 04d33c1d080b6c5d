#include "apps/report/model_pages/selftest_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

std::string values_text(const std::vector<ShownValue>& values) {
  std::string text;
  for (const ShownValue& v : values) {
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", v.name, display_number(v.value, 3),
                        v.unit == "-" || v.unit.empty() ? "" : " " + v.unit);
  }
  return text;
}

std::string confusions_text(const InjectedEffect& e) {
  std::string text;
  for (const Confusion& c : e.confused_with) text += (text.empty() ? "" : ", ") + c.key;
  return text;
}

void add_power_chart(Page& page, const Selftest& t) {
  std::vector<const InjectedEffect*> seen;
  for (const InjectedEffect& e : t.effects) {
    if (std::isfinite(e.times80) && e.visibility != Visibility::kNever) seen.push_back(&e);
  }
  if (seen.empty()) return;
  std::stable_sort(seen.begin(), seen.end(),
                   [](const auto* a, const auto* b) { return a->times80 < b->times80; });
  BarChart chart;
  chart.title = "Smallest size at which each effect would be found";
  chart.note =
      "Size at which an effect would be named with 80 % power, in decades below its typical size: "
      "1 "
      "is a tenth of the typical size, 0 the typical size, and below 0 the effect is found only if "
      "it is larger than typical.";
  chart.value_axis = {"decades below the typical size", ""};
  chart.stacked = false;
  chart.series = {{"80 % power", Eigen::VectorXd(static_cast<Eigen::Index>(seen.size()))}};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    chart.categories.push_back(seen[i]->key());
    chart.series[0].values[static_cast<Eigen::Index>(i)] = -std::log10(seen[i]->times80);
  }
  page.plot(std::move(chart));
}

void add_table(Page& page, const Selftest& t) {
  Table table;
  table.title = "Every effect, injected at its typical size";
  table.columns = {{"effect"},
                   {"stage"},
                   {"typical size"},
                   {"power", "%", 3},
                   {"named from"},
                   {"of typical", "", 2},
                   {"size by noise", "", 2},
                   {"absorbed", "%", 2},
                   {"without reference", "%", 2},
                   {"indistinguishable from"}};
  for (const InjectedEffect& e : t.effects) {
    if (e.visibility == Visibility::kNever) continue;
    table.rows.push_back({e.key(), e.stage, values_text(e.typical), std::round(100.0 * e.power),
                          values_text(e.smallest), std::isfinite(e.times80) ? e.times80 : kNaN,
                          e.size, std::round(100.0 * e.absorbed),
                          std::round(100.0 * e.absorbed_alone), confusions_text(e)});
  }
  table.note =
      "Power: chance that the effect is named. Named from: the size that is named with 80 % power. "
      "Size by noise: the typical effect where it acts, divided by the noise of that channel. "
      "Absorbed: the share of its signature that fitted pressure models would take over, with the "
      "references given and without any.";
  if (!table.rows.empty()) page.table(std::move(table));
}

void add_never(Page& page, const Selftest& t) {
  Table table;
  table.title = "Effects that these logs cannot reveal";
  table.columns = {{"effect"}, {"why"}, {"what to record"}};
  for (const InjectedEffect& e : t.effects) {
    if (e.visibility != Visibility::kNever) continue;
    table.rows.push_back({e.key(), e.reason, e.separated_by});
  }
  if (!table.rows.empty()) page.table(std::move(table));
}

void add_sets(Page& page, const Selftest& t) {
  if (t.sets.empty()) return;
  page.section("Indistinguishable sets");
  Table table;
  table.title = "Sets, and a motion that decides between their effects";
  table.columns = {{"one of"}, {"motion"}};
  for (std::size_t k = 0; k < t.sets.size(); ++k) {
    std::string keys, motions = k < t.experiments.size() ? t.experiments[k].sentence() : "";
    for (const std::string& key : t.sets[k]) {
      keys += (keys.empty() ? "" : ", ") + key;
      if (k < t.experiments.size()) continue;
      const auto e = std::find_if(t.effects.begin(), t.effects.end(),
                                  [&](const InjectedEffect& x) { return x.key() == key; });
      if (e != t.effects.end() && motions.find(e->separated_by) == std::string::npos)
        motions += (motions.empty() ? "" : "; ") + e->separated_by;
    }
    table.rows.push_back({keys, motions});
  }
  table.note =
      "The effects of a set differ by less than 4 nats of log-likelihood on these logs, with the "
      "other "
      "effects fitted again.";
  page.table(std::move(table));
}

void add_checks(Page& page, const Selftest& t) {
  if (t.checks.empty()) return;
  page.section("Checked by injection");
  page.paragraph(
      "The figures above are calculated. For this check the effects were added to newly drawn "
      "noise, "
      "and the search of `diagnose` was run on the result.");
  Table table;
  table.title = "Injected and named effects";
  table.columns = {{"effect"}, {"stage"}, {"power", "%", 3}, {"named"}, {"as predicted"}};
  for (const InjectionCheck& c : t.checks) {
    table.rows.push_back({c.key, c.stage, std::round(100.0 * c.power),
                          c.answer.empty() ? std::string("nothing") : c.answer,
                          std::string(c.as_predicted() ? "yes" : "no")});
  }
  page.table(std::move(table));
}

}  // namespace

Page selftest_page(const CraneModel& model, const Selftest& t) {
  const Machine& machine = model.machine;
  Page page("Self-test of logs: " + machine.name);
  page.subtitle(fmt::format(
      "{:.0f} samples in {} log{}, {:.0f} s{}", t.samples, t.logs, t.logs == 1 ? "" : "s",
      t.duration,
      t.references == 0 ? ", no reference" : fmt::format(", {} of reference", t.references)));
  const auto right = std::count_if(t.checks.begin(), t.checks.end(),
                                   [](const InjectionCheck& c) { return c.as_predicted(); });
  const bool all_right = right == static_cast<std::ptrdiff_t>(t.checks.size());
  std::string text;
  if (!t.checks.empty())
    text = fmt::format("Checked by injection: {} of {} as predicted. ", right, t.checks.size());
  if (!t.sets.empty())
    text += fmt::format("{} set{} of effects cannot be distinguished on these motions.",
                        t.sets.size(), t.sets.size() == 1 ? "" : "s");
  page.verdict(!all_right || t.residual_over_noise > 0.0 ? Tone::kWarning
               : t.count(Visibility::kNever) > 0         ? Tone::kNeutral
                                                         : Tone::kGood,
               t.headline(), text);
  page.section("What would be seen");
  add_power_chart(page, t);
  add_table(page, t);
  add_never(page, t);
  add_sets(page, t);
  add_checks(page, t);
  if (!t.notes.empty()) {
    page.section("Notes");
    for (const std::string& note : t.notes) page.paragraph(note + ".");
  }
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", machine.name);
  return page;
}

}  // namespace sparflow
