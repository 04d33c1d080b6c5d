#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnosis/verdict/diagnose.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

std::string with_interval(const ParameterEstimate& p) {
  const std::string unit = p.unit.empty() || p.unit == "-" ? "" : " " + p.unit;
  if (!p.determined) return p.name + " is not determined by these logs";
  if (p.lower95 == p.upper95)
    return fmt::format("{} = {:g}{}{}", p.name, p.value, unit,
                       p.variant.empty() ? "" : " (" + p.variant + ")");
  return fmt::format("{} = {}{} ({} .. {})", p.name, plain_number(p.value, 4), unit,
                     plain_number(p.lower95, 4), plain_number(p.upper95, 4));
}

std::string title_of(const DiagnosedEffect& e) {
  const std::string& title = e.effect.effect->info().title;
  return e.at.empty() ? title : title + ", " + e.at;
}

/// JSON has no NaN.
nlohmann::json json_of(const DiagnosedEffect& e, const Evidence& evidence) {
  nlohmann::json j = {
      {"id", e.id},
      {"at", e.at},
      {"stage", e.stage},
      {"change", e.change},
      {"probability", e.probability},
      {"probability_percent", e.shown_probability()},
      {"set_probability", e.set_probability},
      {"p_value", e.p_value},
      {"log_likelihood_gain", e.gain},
      {"held_out_gain", {{"value", e.held_out_gain}, {"standard_error", e.held_out_error}}},
      {"absorbed", e.absorbed},
      {"partial_law", !partial_law(e).empty()},
      {"evidence", e.evidence}};
  j["parameters"] = nlohmann::json::array();
  for (const ParameterEstimate& p : e.parameters) {
    j["parameters"].push_back({{"name", p.name},
                               {"value", json_number(p.value)},
                               {"unit", p.unit},
                               {"determined", p.determined},
                               {"ci95", {json_number(p.lower95), json_number(p.upper95)}}});
    if (!p.variant.empty()) j["parameters"].back()["variant"] = p.variant;
  }
  j["channels"] = nlohmann::json::array();
  for (const ChannelGain& g : e.channels) {
    const EvidenceChannel& c = evidence.channels[g.channel];
    j["channels"].push_back({{"what", c.text},
                             {"unit", c.unit.name},
                             {"rmse_before", g.rmse_before / c.unit.si},
                             {"rmse_after", g.rmse_after / c.unit.si},
                             {"noise_floor", json_number(g.noise_floor / c.unit.si)}});
    if (std::isfinite(g.in_references))
      j["channels"].back()["rmse_references"] = g.in_references / c.unit.si;
    if (!g.weighed()) continue;
    j["channels"].back()["rmse_weighed_before"] = g.weighed_before / c.unit.si;
    j["channels"].back()["rmse_weighed_after"] = g.weighed_after / c.unit.si;
  }
  if (!e.channels.empty()) {
    const ChannelGain& g = e.channels.front();
    const FieldUnit& unit = evidence.channels[g.channel].unit;
    j["rmse_before"] = g.rmse_before / unit.si;
    j["rmse_after"] = g.rmse_after / unit.si;
    j["rmse_noise_floor"] = json_number(g.noise_floor / unit.si);
    j["rmse_unit"] = unit.name;
  }
  j["rivals"] = nlohmann::json::array();
  for (const auto& [key, worse] : e.rivals)
    j["rivals"].push_back({{"effect", key}, {"worse_by", worse}});
  return j;
}

}  // namespace

std::string Diagnosis::headline() const {
  switch (verdict) {
    case Verdict::kBadData:
      return fmt::format("Bad data: {}{}", bad_channel_sentence(set_aside.front()),
                         set_aside.size() > 1
                             ? fmt::format(" And {} more channel(s).", set_aside.size() - 1)
                             : "");
    case Verdict::kNone:
      if (evidence.has_reference())
        return fmt::format("No difference to the references, as far as these logs can show{}.",
                           lacking.empty() && shared_structure.empty()
                               ? ""
                               : "; what the model lacks, it lacks in both");
      return "Nothing is missing: the residual is noise, as far as these logs can show.";
    case Verdict::kUnknown:
      if (evidence.channels.empty())
        return "Nothing can be judged: no stage of the model shows in these logs; the notes say "
               "what "
               "each lacks.";
      if (unexplained && unexplained->few_places)
        return fmt::format("Isolated event, on which no law can be tested: {}.",
                           unexplained->sentence);
      return fmt::format("Unmodelled structure in the residual, not in the catalogue{}.",
                         unexplained ? ": " + unexplained->sentence : "");
    case Verdict::kMissing:
      break;
  }
  std::vector<std::string> parts;
  for (const DiagnosedEffect& e : effects) {
    if (!named(e)) continue;
    std::string part = title_of(e);
    if (!e.rivals.empty()) {
      std::vector<std::string> rivals;
      for (const auto& [key, worse] : e.rivals) rivals.push_back(key);
      part += fmt::format(" (or {})", fmt::join(rivals, ", "));
    }
    parts.push_back(part);
  }
  if (parts.empty()) {  // none of a set is probable enough by itself
    for (const DiagnosedEffect& e : effects) parts.push_back(title_of(e));
    return fmt::format("Missing, but none of these is probable by itself: {}.",
                       fmt::join(parts, "; "));
  }
  return fmt::format("Missing: {}.", fmt::join(parts, "; "));
}

bool Diagnosis::named(const DiagnosedEffect& e) const {
  return verdict == Verdict::kMissing && probable(e);
}

const char* Diagnosis::standing(const DiagnosedEffect& e) const {
  return named(e) ? "named"
         : verdict == Verdict::kMissing
             ? "one of a set that is less probable than chance and rivals"
             : "not proven, because too much stays unexplained";
}

std::string Diagnosis::table(const std::string& first_line) const {
  std::string out = (first_line.empty() ? headline() : first_line) + "\n\n";
  if (verdict == Verdict::kBadData) {
    for (std::size_t i = 1; i < set_aside.size(); ++i)  // the headline has the first
      out += fmt::format("  {}\n", bad_channel_sentence(set_aside[i]));
    return out;
  }
  for (const BadChannel& b : set_aside)
    out += fmt::format("  Set aside: {}{}\n", b.file.empty() ? "" : b.file + ": ",
                       bad_channel_sentence(b));
  for (const ReferenceFault& f : reference_faults)
    out += fmt::format("  Check the references: {}\n", f.sentence());
  for (const DiagnosedEffect& e : effects) {
    out += fmt::format("  {:32s} probability {:>3.0f} %   stage {}{}\n", e.key(),
                       e.shown_probability(), e.stage,
                       e.change ? "   a change of what the references have" : "");
    if (!named(e)) out += fmt::format("      {}\n", standing(e));
    for (const ParameterEstimate& p : e.parameters)
      out += fmt::format("      {}\n", with_interval(p));
    for (std::size_t i = 0; i < std::min<std::size_t>(4, e.evidence.size()); ++i) {
      out += fmt::format("      {}\n", e.evidence[i]);
    }
    if (e.absorbed > thresholds.least_absorbed_stated) {
      out += fmt::format(
          "      absorbed share {:.0f} %: learning the pressure models again would take it over\n",
          100.0 * e.absorbed);
    }
  }
  if (!indistinguishable.empty()) {
    out += "\n  Indistinguishable on these logs:\n";
    for (std::size_t i = 0; i < indistinguishable.size(); ++i) {
      out += fmt::format("      {}\n", fmt::join(indistinguishable[i], "  or  "));
      if (i < experiments.size()) out += fmt::format("        {}\n", experiments[i].sentence());
    }
  }
  if (!lacking.empty() || !shared_structure.empty())
    out += "\n  The model lacks this in the references as well, so that it is no change:\n";
  for (const DiagnosedEffect& e : lacking) {
    std::vector<std::string> values;
    for (const ParameterEstimate& p : e.parameters) values.push_back(with_interval(p));
    out += fmt::format("      {:28s} {}\n", e.key(), fmt::join(values, ", "));
  }
  for (const Unexplained& u : shared_structure) out += fmt::format("      {}\n", u.sentence);
  if (unexplained && verdict != Verdict::kUnknown)  // else the headline has it
    out += fmt::format("\n  Not explained: {}\n", unexplained->sentence);
  if (effects.empty() && !ranking.empty()) {
    out += "  Best candidates (penalised gain in nats; its threshold is ";
    out += fmt::format("{:.1f}):\n", search.threshold);
    for (std::size_t i = 0; i < std::min<std::size_t>(3, ranking.size()); ++i) {
      out += fmt::format("      {:32s} {:8.1f}\n", ranking[i].first, ranking[i].second);
    }
  }
  if (verdict == Verdict::kNone)
    out += fmt::format("\n  {}\n", none_text());
  else if (verdict != Verdict::kUnknown || !evidence.channels.empty())
    out += fmt::format("\n  Probability of this evidence if nothing were missing: {}\n",
                       p_value_text());
  for (const std::string& note : notes) out += fmt::format("  note: {}\n", note);
  return out;
}

std::string Diagnosis::p_value_text() const {
  // The smallest value that so many simulations can give bounds the true one from above.
  const bool at_resolution = p_value * (search.simulations + 1.0) < 1.5;
  return fmt::format("{}{:.2g}", at_resolution ? "below " : "", p_value);
}

std::string Diagnosis::weighing_text() const {
  if (!stretches_weighed) return "";
  return "with one variance of the noise for all stretches of motion nothing is named: a few "
         "motions that the laws do not explain hide it, which have less weight here";
}

std::string Diagnosis::none_text() const {
  if (p_value >= SearchOptions().false_alarm)
    return fmt::format(
        "The residuals contain no more than noise would (probability by chance: {}).",
        p_value_text());
  return fmt::format(
      "The residuals contain more than noise would (probability by chance: {}), but {}.",
      p_value_text(),
      evidence.has_reference() ? "the references show it as well"
                               : "no effect passes the acceptance tests");
}

std::string Diagnosis::json() const {
  nlohmann::json j = {
      {"verdict", verdict_name(verdict)}, {"p_value", p_value}, {"headline", headline()}};
  j["effects"] = nlohmann::json::array();
  for (const DiagnosedEffect& e : effects) {
    if (named(e)) j["effects"].push_back(json_of(e, evidence));
  }
  j["not_proven"] = nlohmann::json::array();  // found, and withheld by the verdict
  for (const DiagnosedEffect& e : effects) {
    if (verdict != Verdict::kMissing) j["not_proven"].push_back(json_of(e, evidence));
  }
  j["lacking"] = nlohmann::json::array();
  for (const DiagnosedEffect& e : lacking) j["lacking"].push_back(json_of(e, evidence));
  j["unexplained_in_references_too"] = nlohmann::json::array();
  for (const Unexplained& u : shared_structure)
    j["unexplained_in_references_too"].push_back(
        {{"stage", u.stage}, {"at", u.at}, {"sentence", u.sentence}});
  j["reference_faults"] = nlohmann::json::array();
  for (const ReferenceFault& f : reference_faults)
    j["reference_faults"].push_back({{"channel", f.text},
                                     {"rmse_references", f.in_references / f.unit.si},
                                     {"rmse_log", f.in_log / f.unit.si},
                                     {"unit", f.unit.name},
                                     {"sentence", f.sentence()}});
  // members of an indistinguishable set, none of which is probable enough by itself
  if (verdict == Verdict::kMissing) {
    for (const DiagnosedEffect& e : effects) {
      if (probable(e)) continue;
      nlohmann::json one = json_of(e, evidence);
      j["one_of_a_set"].push_back(one);
    }
  }
  j["indistinguishable"] = indistinguishable;
  nlohmann::json experiment_list = nlohmann::json::array();
  for (const Experiment& e : experiments) {
    nlohmann::json one = {{"reason", e.reason}, {"motion", e.motion}};
    if (e.nats_per_minute > 0.0) {
      one["nats_per_minute"] = e.nats_per_minute;
      one["nats_per_minute_of_these_logs"] = e.nats_here;
    }
    experiment_list.push_back(std::move(one));
  }
  j["experiment"] = experiment_list.empty() ? nlohmann::json(nullptr) : experiment_list.front();
  j["experiments"] = std::move(experiment_list);
  j["unexplained"] = nullptr;
  if (unexplained) {
    const Unexplained& u = *unexplained;
    j["unexplained"] = {{"stage", u.stage},           {"at", u.at},
                        {"depends_on", u.depends_on}, {"share", u.share},
                        {"rmse", u.rmse / u.unit.si}, {"unit", u.unit.name},
                        {"sentence", u.sentence}};
  }
  j["set_aside"] = nlohmann::json::array();
  for (const BadChannel& b : set_aside) {
    j["set_aside"].push_back({{"file", b.file},
                              {"channel", b.channel},
                              {"kind", bad_data_word(b.kind)},
                              {"from_s", b.from_s},
                              {"to_s", b.to_s},
                              {"share", b.share},
                              {"evidence", b.evidence},
                              {"remedy", b.remedy}});
  }
  j["ranking"] = nlohmann::json::array();
  for (const auto& [key, gain] : ranking) j["ranking"].push_back({{"effect", key}, {"gain", gain}});
  j["gate"] = {{"threshold", search.threshold}};
  j["notes"] = notes;
  j["stretches_weighed"] = stretches_weighed;
  j["seconds"] = seconds;
  return j.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace sparflow
