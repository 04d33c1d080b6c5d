#include "apps/report/model_pages/diagnose_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/model_pages/compare_charts.h"
#include "apps/report/model_pages/diagnose_charts.h"
#include "apps/report/model_pages/effect_text.h"
#include "apps/report/model_pages/improve_page.h"
#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

constexpr std::size_t kMostBadPictures = 4;  // of the first channels; the table has all

Tone tone_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNone:
      return Tone::kGood;
    case Verdict::kMissing:
    case Verdict::kUnknown:
      return Tone::kWarning;
    case Verdict::kBadData:
      return Tone::kBad;
  }
  return Tone::kNeutral;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& w : words) text += (text.empty() ? "" : between) + w;
  return text;
}

std::string sentence(std::string text) {
  if (!text.empty() && !text.ends_with('.')) text += ".";
  return capitalised(std::move(text));
}

std::string title_of(const Machine& machine, const DiagnosedEffect& e) {
  return effect_title(e.effect.effect->info(), machine, e.effect.at);
}

std::string channel_words(const Diagnosis& d, const ChannelGain& g) {
  return d.evidence.channels[g.channel].text;
}

/// "force of boom 4.1 -> 0.62 kN, sensor noise 0.55"
std::string gain_text(const Diagnosis& d, const ChannelGain& g) {
  const FieldUnit& unit = d.evidence.channels[g.channel].unit;
  const auto [before, name] = readable_error(g.before(), unit);
  const double scale = before / g.before();
  std::string text =
      fmt::format("{} {} \u2192 {} {}", channel_words(d, g), display_number(before, 3),
                  display_number(g.after() * scale, 3), name);
  if (g.weighed()) text += " (weighed by the variance of each stretch of motion)";
  if (std::isfinite(g.noise_floor))
    text += fmt::format(", sensor noise {}", display_number(g.noise_floor * scale, 2));
  if (std::isfinite(g.in_references))
    text += fmt::format(", in the references {}", display_number(g.in_references * scale, 2));
  return text;
}

void set_verdict(Page& page, const Machine& machine, const Diagnosis& d,
                 const ExtendResult* tested) {
  std::string text;
  for (const DiagnosedEffect& e : d.effects) {
    if (!d.named(e)) continue;
    text += fmt::format("{}: {}", capitalised(title_of(machine, e)), parameters_text(e.parameters));
    if (!e.channels.empty())
      text += fmt::format("; error of the {}", gain_text(d, e.channels.front()));
    text += ". ";
  }
  for (std::size_t i = 0; i < d.set_aside.size(); ++i) {  // the headline names the first
    if (i > 0) text += sentence(bad_channel_sentence(d.set_aside[i])) + " ";
  }
  for (const ReferenceFault& f : d.reference_faults)
    text += "Check the references: " + f.sentence() + " ";
  if (d.verdict == Verdict::kUnknown && d.evidence.channels.empty())
    text += "Record motions of each cylinder with its command, position and pressures.";
  else if (d.verdict == Verdict::kUnknown)
    text +=
        "Do not add anything to the model before the cause is known; the signals on which the "
        "residual depends are shown below.";
  if (d.verdict == Verdict::kNone) {
    text += d.none_text() + " ";
  } else if (d.verdict == Verdict::kMissing) {
    if (d.stretches_weighed) text += sentence(d.weighing_text()) + " ";
    text += fmt::format("Chance of such evidence if no effect were missing: {}.", d.p_value_text());
  }
  Tone tone = tone_of(d.verdict);
  if (tested != nullptr && !tested->steps.empty()) tone = std::max(tone, tone_of(tested->grade()));
  page.verdict(tone, sentence(headline_on_tests(d, tested)), text);
}

void add_effects(Page& page, const Machine& machine, const Diagnosis& d) {
  if (d.effects.empty()) return;
  page.section(d.verdict == Verdict::kMissing ? "What is missing" : "Found, but not proven");
  Table table;
  table.title = "Effects, most probable first";
  table.columns = {{"effect"},
                   {"stage"},
                   {"parameters, 95 % interval"},
                   {"probability", "%", 3},
                   {"gain", "nats", 3},
                   {"motions left out", "standard errors", 2},
                   {"absorbed", "%", 2},
                   {"standing"}};
  for (const DiagnosedEffect& e : d.effects) {
    table.rows.push_back({title_of(machine, e), e.stage, parameters_text(e.parameters),
                          e.shown_probability(), e.gain,
                          e.held_out_error > 0.0 ? e.held_out_gain / e.held_out_error : kNaN,
                          std::round(100.0 * e.absorbed), std::string(d.standing(e))});
  }
  table.note =
      "Probability: that it is this effect, and neither chance nor a rival. Gain: increase of the "
      "log-likelihood of these logs by the effect. Motions left out: gain on motions that took no "
      "part in the estimate, in its standard errors. Absorbed: the share of the signature that "
      "pressure models fitted again on these logs would take over.";
  page.table(std::move(table));

  Table errors;
  errors.title = "Error on these logs, without and with it";
  errors.columns = {
      {"effect"}, {"quantity"}, {"without it", "", 3}, {"with it", "", 3}, {"sensor noise", "", 3},
      {"unit"}};
  const bool references = d.evidence.has_reference() && !d.stretches_weighed;
  if (references) errors.columns.insert(errors.columns.end() - 1, {"references leave", "", 3});
  if (d.stretches_weighed)
    errors.columns.insert(errors.columns.begin() + 2,
                          {{"weighed, without it", "", 3}, {"weighed, with it", "", 3}});
  for (const DiagnosedEffect& e : d.effects) {
    for (const ChannelGain& g : e.channels) {
      const FieldUnit& unit = d.evidence.channels[g.channel].unit;
      const auto [before, name] = readable_error(g.rmse_before, unit);
      const double scale = g.rmse_before > 0.0 ? before / g.rmse_before : 1.0 / unit.si;
      std::vector<TableCell> row = {e.key(),
                                    channel_words(d, g),
                                    before,
                                    g.rmse_after * scale,
                                    std::isfinite(g.noise_floor) ? g.noise_floor * scale : kNaN,
                                    name};
      if (references) row.insert(row.end() - 1, g.in_references * scale);
      if (d.stretches_weighed)
        row.insert(row.begin() + 2, {g.weighed_before * scale, g.weighed_after * scale});
      errors.rows.push_back(std::move(row));
    }
  }
  errors.note = "RMS. All other effects found are in the model in both columns.";
  if (references) errors.note += " The references' residual is taken at the same loads and speeds.";
  if (d.stretches_weighed)
    errors.note +=
        " Weighed: with the squares of each stretch of motion over its own variance, as the search "
        "weighed them.";
  if (!errors.rows.empty()) page.table(std::move(errors));
}

void add_evidence(Page& page, const Machine& machine, const Diagnosis& d) {
  for (std::size_t i = 0; i < d.effects.size(); ++i) {
    const DiagnosedEffect& e = d.effects[i];
    page.section(capitalised(title_of(machine, e)));
    const EffectInfo& info = e.effect.effect->info();
    page.paragraph(fmt::format("Law: {}. {}", info.equation, info.citation));
    for (const std::string& s : e.evidence) page.paragraph(sentence(s));
    add_effect_pictures(page, d, i);
    if (e.rivals.empty()) continue;
    std::string rivals;
    for (const auto& [key, worse] : e.rivals)
      rivals += fmt::format("{}{} ({:.1f} nats less gain)", rivals.empty() ? "" : ", ", key, worse);
    page.paragraph("Rivals that explain the residuals in its place: " + rivals + ".");
  }
}

void add_sets(Page& page, const Diagnosis& d) {
  if (d.indistinguishable.empty()) return;
  page.section("Indistinguishable sets");
  for (std::size_t i = 0; i < d.indistinguishable.size(); ++i) {
    page.paragraph("One of: " + joined(d.indistinguishable[i], ", ") +
                   ". All of them explain these logs equally well.");
    if (i >= d.experiments.size()) continue;
    const Experiment& e = d.experiments[i];
    page.paragraph(capitalised(sentence(e.sentence())));
    if (!(e.nats_per_minute > 0.0)) continue;
    page.paragraph(fmt::format(
        "A minute of that motion lowers the log-likelihood of the wrong effects of the set by "
        "{:.2g} "
        "nats, a minute of these logs by {:.2g}. Effects count as distinguished from 4 nats on.",
        e.nats_per_minute, e.nats_here));
  }
}

void add_unexplained(Page& page, const Diagnosis& d) {
  if (!d.unexplained) return;
  const Unexplained& u = *d.unexplained;
  page.section(u.few_places ? "Isolated event" : "Unmodelled structure in the residual");
  page.paragraph(sentence(u.sentence));
  if (u.rmse > 0.0 && u.unit.si > 0.0) {
    const auto [rmse, name] = readable_error(u.rmse, u.unit);
    std::string text =
        fmt::format("At the {} stage of {} the residual is {} {} RMS", u.stage,
                    u.at.empty() ? "the machine" : u.at, display_number(rmse, 3), name);
    if (std::isfinite(u.noise_floor))
      text +=
          fmt::format(", the sensors' noise {}", display_number(u.noise_floor * rmse / u.rmse, 2));
    page.paragraph(text + ".");
  }
  if (!u.depends_on.empty() && !u.few_places)
    page.paragraph("It depends on: " + joined(u.depends_on, ", ") + " (strongest first).");
  const bool swings =
      std::any_of(u.depends_on.begin(), u.depends_on.end(),
                  [](const std::string& s) { return s.find("Hz") != std::string::npos; });
  add_unexplained_residual(page, d, u.stage, u.at, swings);
}

void add_bad_data(Page& page, const Diagnosis& d) {
  if (d.set_aside.empty()) return;
  page.section("Bad data");
  Table table;
  table.title = "Channels with faults of sensor or recording";
  table.columns = {{"log"},          {"channel"},    {"kind"},
                   {"from", "s", 4}, {"to", "s", 4}, {"of the log", "%", 2},
                   {"evidence"},     {"what to do"}};
  for (const BadChannel& b : d.set_aside) {
    table.rows.push_back({b.file, b.channel, std::string(bad_data_word(b.kind)), b.from_s, b.to_s,
                          100.0 * b.share, b.evidence, b.remedy});
  }
  page.table(std::move(table));
  for (std::size_t i = 0; i < std::min(kMostBadPictures, d.set_aside.size()); ++i) {
    if (d.set_aside[i].time.size() > 1) page.plot(bad_channel_chart(d.set_aside[i]));
  }
}

/// What the references show as the suspect logs do.
void add_lacking(Page& page, const Machine& machine, const Diagnosis& d) {
  if (d.lacking.empty() && d.shared_structure.empty()) return;
  page.section("What the model lacks in the references, too");
  page.paragraph(
      "References and suspect logs show this alike, so that it is no change between them.");
  if (!d.lacking.empty()) {
    Table table;
    table.columns = {{"effect"}, {"parameters, 95 % interval"}};
    for (const DiagnosedEffect& e : d.lacking)
      table.rows.push_back({title_of(machine, e), parameters_text(e.parameters)});
    page.table(std::move(table));
  }
  for (const Unexplained& u : d.shared_structure) page.paragraph(sentence(u.sentence));
}

}  // namespace

Page diagnose_page(const CraneModel& model, const Diagnosis& d, const ExtendResult* tested) {
  const Machine& machine = model.machine;
  Page page("Diagnosis: " + machine.name);
  Eigen::Index samples = 0;
  for (std::size_t i = 0; i < d.evidence.suspects; ++i) samples += d.evidence.series[i].samples();
  page.subtitle(fmt::format(
      "{} samples in {} log{}{}", samples, d.evidence.suspects, d.evidence.suspects == 1 ? "" : "s",
      d.evidence.has_reference()
          ? fmt::format(", {} of reference", d.evidence.series.size() - d.evidence.suspects)
          : ", no reference"));
  set_verdict(page, machine, d, tested);
  add_bad_data(page, d);
  add_effects(page, machine, d);
  add_sets(page, d);
  add_evidence(page, machine, d);
  add_unexplained(page, d);
  add_lacking(page, machine, d);
  if (d.verdict == Verdict::kNone) add_remaining_residuals(page, d);
  if (!d.ranking.empty()) {
    page.section("Ranking");
    add_ranking(page, d);
  }
  if (tested != nullptr) add_steps(page, *tested, "Test logs: ");
  if (!d.notes.empty()) {
    page.section("Notes");
    for (const std::string& note : d.notes) page.paragraph(sentence(note));
  }
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", machine.name);
  for (const DataSource& s : model.data) {
    page.provenance("model's " + s.use + " log",
                    fmt::format("{}, {} rows, sha256 {}", s.file, s.rows, s.sha256.substr(0, 16)));
  }
  return page;
}

}  // namespace sparflow
