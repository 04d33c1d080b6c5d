#include "models/effects/effect_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "models/effects/registry.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

// no threshold: layout of the text
constexpr std::size_t kWidth = 100;
constexpr std::size_t kIndent = 15;  // columns before an entry's text

/// This is not an effect but a channel that does not measure what the machine does; it is in the catalogue because users
/// look for it there.
constexpr const char* kFault = "sensor_fault";
constexpr const char* kFaultTitle = "sensor fault: excess noise, stuck or jumping values";
constexpr const char* kFaultText =
    "Such values are bad data, not missing physics: `compare` and `diagnose` look for them first, "
    "name the channel and the time (verdict \"bad_data\") and exclude those rows. No effect is "
    "added to the model.";

const char* place_word(EffectPlace place) {
  switch (place) {
    case EffectPlace::kMachine:
      return "";
    case EffectPlace::kJoint:
      return "<joint>";
    case EffectPlace::kCylinder:
      return "<cyl>";
    case EffectPlace::kPump:
      return "<pump>";
  }
  return "";
}

const char* evidence_words(EvidenceKind kind) {
  switch (kind) {
    case EvidenceKind::kForce:
      return "force";
    case EvidenceKind::kFlow:
      return "rod speed at a given command";
    case EvidenceKind::kReturnExtend:
      return "return pressure extending";
    case EvidenceKind::kReturnRetract:
      return "return pressure retracting";
    case EvidenceKind::kSupplyExtend:
      return "supply pressure extending";
    case EvidenceKind::kSupplyRetract:
      return "supply pressure retracting";
    case EvidenceKind::kPump:
      return "pump pressure";
    case EvidenceKind::kReturnLine:
      return "pressure of the return line";
  }
  return "";
}

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

std::vector<std::string> shown_in(const Effect& effect) {
  std::vector<std::string> words;
  for (const EvidenceKind kind : effect.shows_in()) words.emplace_back(evidence_words(kind));
  return words;
}

/// Text wrapped at spaces to kWidth; every line but the first begins with `indent` blanks.
std::string wrapped(const std::string& text, std::size_t indent) {
  std::istringstream words(text);
  std::string result, word;
  std::size_t column = indent;
  while (words >> word) {
    if (column > indent && column + 1 + word.size() > kWidth) {
      result += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      result += ' ';
      ++column;
    }
    result += word;
    column += word.size();
  }
  return result;
}

std::string line(const char* heading, const std::string& text) {
  if (text.empty()) return {};
  return fmt::format("{:<{}}{}\n", heading, kIndent, wrapped(text, kIndent));
}

double shown(const EffectParameter& p, double si) { return si / p.si; }

std::string parameter_words(const EffectParameter& p) {
  const std::string unit = p.unit == "-" || p.unit.empty() ? "" : " " + p.unit;
  std::string text =
      fmt::format("{}: {}{}{:.3g} to {:.3g}{}", p.name, p.meaning, p.meaning.empty() ? "" : ". ",
                  shown(p, p.lower), shown(p, p.upper), unit);
  text += fmt::format(", typical {:.3g}{}", shown(p, p.typical), unit);
  if (p.linear) return text;
  std::vector<std::string> values;
  for (const double v : p.grid) {
    const std::string variant = variant_text(p, v);
    values.push_back(
        fmt::format("{:.3g}{}", shown(p, v), variant.empty() ? "" : " (" + variant + ")"));
  }
  if (p.choice) return text + "; one of " + joined(values);
  text += values.empty() ? "; searched" : fmt::format("; searched from {}", joined(values));
  return text;
}

std::string row(const std::string& signature, const std::string& title,
                const std::string& parameters) {
  return fmt::format("  {:<29} {:<58} {}\n", signature, title, parameters);
}

nlohmann::json fault_json() {
  return {{"id", kFault},
          {"title", kFaultTitle},
          {"stage", "sensor"},
          {"place", "channel"},
          {"parameters", nlohmann::json::array()},
          {"text", kFaultText}};
}

nlohmann::json as_json(const Effect& effect) {
  const EffectInfo& info = effect.info();
  static constexpr const char* kPlaces[] = {"machine", "joint", "cylinder", "pump"};
  nlohmann::json parameters = nlohmann::json::array();
  for (const EffectParameter& p : info.parameters) {
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"lower", shown(p, p.lower)},
                          {"upper", shown(p, p.upper)},
                          {"typical", shown(p, p.typical)},
                          {"linear", p.linear},
                          {"meaning", p.meaning}});
  }
  return {{"id", info.id},
          {"title", info.title},
          {"stage", effect_stage_name(info.stage)},
          {"place", kPlaces[static_cast<int>(info.place)]},
          {"equation", info.equation},
          {"parameters", parameters},
          {"signals", info.signals},
          {"shows_in", shown_in(effect)},
          {"confused_with", info.confused_with},
          {"separated_by", info.separated_by},
          {"citation", info.citation},
          {"in_motion", info.in_motion},
          {"built_in", effect.definition().empty()}};
}

/// nullptr for sensor_fault.
const Effect* known(const std::string& key) {
  const std::string id = key.substr(0, key.find(':'));
  if (id == kFault) return nullptr;
  if (const Effect* effect = find_effect(id)) return effect;
  std::vector<std::string> ids = {kFault};
  for (const auto& effect : effect_catalogue()) ids.push_back(effect->info().id);
  const std::string near = nearest_word(id, ids);
  throw UsageError(fmt::format("there is no effect \"{}\"{}; `sparflow effects` lists them", id,
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
}

}  // namespace

std::string effect_signature(const EffectInfo& info) {
  const std::string place = place_word(info.place);
  return place.empty() ? info.id : info.id + ":" + place;
}

std::string effect_table() {
  std::string text;
  for (const EffectStage stage : {EffectStage::kForce, EffectStage::kFlow, EffectStage::kPressure,
                                  EffectStage::kPump, EffectStage::kSensor}) {
    std::string rows;
    for (const auto& effect : effect_catalogue()) {
      const EffectInfo& info = effect->info();
      if (info.stage != stage) continue;
      std::vector<std::string> names;
      for (const EffectParameter& p : info.parameters) {
        names.push_back(p.name);
      }
      rows += row(effect_signature(info), info.title, joined(names));
    }
    if (stage == EffectStage::kSensor)
      rows += row("sensor_fault:<channel>", kFaultTitle, "bad data");
    if (!rows.empty()) text += fmt::format("{}\n{}", effect_stage_name(stage), rows);
  }
  return text + "`sparflow effects ID` prints the complete entry.\n";
}

std::string effect_entry(const Effect& effect) {
  const EffectInfo& info = effect.info();
  std::string text = fmt::format("{}: {}\n\n", effect_signature(info), info.title);
  text += line("stage", effect_stage_name(info.stage));
  text += line("equation", info.equation);
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    text += line(i == 0 ? "parameters" : "", parameter_words(info.parameters[i]));
  }
  text += line("needs", joined(info.signals));
  text += line("shows in", joined(shown_in(effect)));
  text += line("confused with", joined(info.confused_with));
  text += line("separated by", info.separated_by);
  text += line("in a motion", info.in_motion);
  text += line("source", info.citation);
  return text;
}

std::string effect_entry(const std::string& id) {
  if (const Effect* effect = known(id)) return effect_entry(*effect);
  return fmt::format("sensor_fault:<channel>: {}\n\n{}{}", kFaultTitle, line("stage", "sensor"),
                     line("verdict", kFaultText));
}

std::string effects_json(const std::string& id) {
  nlohmann::json list = nlohmann::json::array();
  if (!id.empty()) {
    const Effect* effect = known(id);
    list.push_back(effect == nullptr ? fault_json() : as_json(*effect));
  } else {
    for (const auto& effect : effect_catalogue()) list.push_back(as_json(*effect));
    list.push_back(fault_json());
  }
  return nlohmann::json{{"effects", list}}.dump(1, ' ', false,
                                                nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace sparflow
