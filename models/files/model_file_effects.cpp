#include "models/files/model_file_effects.h"

#include <algorithm>
#include <set>

#include "models/effects/formula/user_effect.h"
#include "models/effects/registry.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Json = ModelJson;
using Cursor = ModelCursor;
const char* const kWhole = "a whole number that is not negative";

Json source_json(const DataSource& d) {
  return {{"file", d.file}, {"sha256", d.sha256}, {"rows", d.rows}, {"use", d.use}};
}

Json quality_json(const StageQuality& q) {
  return {{"stage", q.stage}, {"at", q.at},     {"data", q.data},
          {"rmse", q.rmse},   {"unit", q.unit}, {"fit_percent", q.fit_percent},  // NaN becomes null
          {"n", q.n}};
}

template <class Row, class ToJson>
Json rows_json(const std::vector<Row>& rows, ToJson to_json) {
  Json list = Json::array();
  for (const Row& row : rows) list.push_back(to_json(row));
  return list;
}

Json interval_json(double lower, double upper) {
  if (std::isnan(lower) || std::isnan(upper)) return nullptr;
  return {lower, upper};
}

std::string place_name(const AppliedEffect& effect, const Machine& machine) {
  const std::string key = effect.key(machine);
  const std::size_t colon = key.find(':');
  return colon == std::string::npos ? "" : key.substr(colon + 1);
}

Json effect_json(const AppliedEffect& effect, const Machine& machine) {
  const EffectInfo& info = effect.effect->info();
  SPARFLOW_CHECK(effect.values.size() == info.parameters.size(), "one value for each parameter");
  Json parameters = Json::array();
  for (std::size_t p = 0; p < info.parameters.size(); ++p) {
    const bool known = effect.lower95.size() > p && effect.upper95.size() > p;
    parameters.push_back(
        {{"name", info.parameters[p].name},
         {"value", effect.values[p]},
         {"ci95", known ? interval_json(effect.lower95[p], effect.upper95[p]) : Json(nullptr)}});
  }
  return {{"id", info.id}, {"at", place_name(effect, machine)}, {"parameters", parameters}};
}

Json step_json(const ModelStep& s) {
  const auto parameter = [](const StepParameter& p) {
    return Json{{"name", p.name},
                {"value", p.value},
                {"unit", p.unit},
                {"ci95", interval_json(p.lower95, p.upper95)}};
  };
  return {{"added", s.added},
          {"removed", s.removed},
          {"date", s.date},
          {"data", rows_json(s.data, source_json)},
          {"parameters", rows_json(s.parameters, parameter)},
          {"before", rows_json(s.before, quality_json)},
          {"after", rows_json(s.after, quality_json)},
          {"stopped_because", s.stopped_because}};
}

DataSource read_source(const Cursor& d) {
  d.keys({"file", "sha256", "rows", "use"});
  DataSource source;
  source.file = d.at("file", "a file name").text("a file name");
  const Cursor hash = d.at("sha256", "64 hexadecimal digits");
  source.sha256 = hash.text("64 hexadecimal digits");
  if (source.sha256.size() != 64 ||
      source.sha256.find_first_not_of("0123456789abcdef") != std::string::npos) {
    hash.fail_expected("64 hexadecimal digits");
  }
  source.rows = d.at("rows", kWhole).whole(kWhole);
  source.use = d.at("use", "\"train\" or \"test\"").text("\"train\" or \"test\"");
  if (source.use != "train" && source.use != "test") {
    d.at("use", "").fail_expected("\"train\" or \"test\"");
  }
  return source;
}

StageQuality read_quality(const Cursor& q) {
  q.keys({"stage", "at", "data", "rmse", "unit", "fit_percent", "n"});
  StageQuality quality;
  quality.stage = q.at("stage", "a stage").text("a stage");
  quality.at = q.at("at", "a name").text("a name");
  quality.data = q.at("data", "which data").text("which data");
  quality.rmse = q.at("rmse", "a number").non_negative("a number >= 0");
  quality.unit = q.at("unit", "a unit").text("a unit");
  const Cursor fit = q.at("fit_percent", "a number or null");
  quality.fit_percent = fit.is_null() ? kNaN : fit.number("a number or null");
  quality.n = q.at("n", kWhole).whole(kWhole);
  return quality;
}

template <class Row>
std::vector<Row> read_rows(const Cursor& parent, const std::string& key,
                           const std::string& expected, Row (*read)(const Cursor&)) {
  std::vector<Row> rows;
  for (const Cursor& element : parent.at(key, expected).list(expected)) {
    rows.push_back(read(element));
  }
  return rows;
}

/// Reads [lower, upper]; null gives NaN.
Range read_interval(const Cursor& parent) {
  const char* expected = "[lower, upper] or null";
  const Cursor c = parent.at("ci95", expected);
  return c.is_null() ? Range{kNaN, kNaN} : c.range(expected);
}

/// The effect that an element names; one that this program cannot evaluate is an error and never left out silently.
const Effect& named_effect(const Cursor& element) {
  const Cursor name = element.at("id", "an effect's id");
  const std::string id = name.text("an effect's id");
  const Effect* effect = find_effect(id);
  if (effect == nullptr) {
    std::vector<std::string> known;
    for (const auto& e : effect_catalogue()) known.push_back(e->info().id);
    name.fail(
        fmt::format("this program does not know the physical effect \"{}\"{}; without it the model "
                    "would be wrong. Update the program, or fit the model again",
                    id, suggestion(id, known)));
  }
  return *effect;
}

int read_place(const Cursor& element, const Effect& effect, const Machine& machine) {
  std::vector<std::string> names;
  const char* expected = "a joint, cylinder or pump name, \"\" for the whole machine";
  const Cursor c = element.at("at", expected);
  const std::string at = c.text(expected);
  for (const int place : effect.places(machine)) {
    names.push_back(place_name({&effect, place, {}, {}, {}}, machine));
    if (names.back() == at) return place;
  }
  if (names.empty()) c.fail("this effect has no place on this machine");
  c.fail_expected("one of: " + (names.front().empty() ? "\"\"" : listed(names)));
}

AppliedEffect read_effect(const Cursor& element, const Machine& machine) {
  element.keys({"id", "at", "parameters"});
  AppliedEffect applied;
  const Effect& effect = named_effect(element);
  applied.effect = &effect;
  applied.at = read_place(element, effect, machine);
  const std::vector<EffectParameter>& parameters = effect.info().parameters;
  std::vector<std::string> names;
  names.reserve(parameters.size());
  for (const EffectParameter& p : parameters) names.push_back(p.name);
  const std::string expected =
      fmt::format("a list, one element for each parameter: {}", listed(names));
  const Cursor list = element.at("parameters", expected);
  const std::vector<Cursor> values = list.list(expected);
  // a file of an earlier version lacks optional parameters that have come to an effect since
  const auto may_lack = [&] {
    return std::all_of(parameters.begin() + static_cast<std::ptrdiff_t>(values.size()),
                       parameters.end(), [](const EffectParameter& p) { return p.optional; });
  };
  if (values.size() > parameters.size() || !may_lack()) list.fail_expected(expected);
  bool intervals = !values.empty();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Cursor& p = values[i].keys({"name", "value", "ci95"});
    const Cursor name = p.at("name", names[i]);
    if (name.text(names[i]) != names[i]) name.fail_expected(fmt::format("\"{}\"", names[i]));
    applied.values.push_back(p.at("value", "a number [SI]").number("a finite number [SI]"));
    const Range interval = read_interval(p);
    applied.lower95.push_back(interval.lo);
    applied.upper95.push_back(interval.hi);
    intervals = intervals && !std::isnan(interval.lo);
  }
  for (auto* numbers : {&applied.values, &applied.lower95, &applied.upper95})
    numbers->resize(parameters.size(), 0.0);
  if (!intervals) {
    applied.lower95.clear();
    applied.upper95.clear();
  }
  return applied;
}

StepParameter read_step_parameter(const Cursor& p) {
  p.keys({"name", "value", "unit", "ci95"});
  StepParameter out;
  out.name = p.at("name", "a name").text("a name");
  out.value = p.at("value", "a number [SI]").number("a finite number [SI]");
  out.unit = p.at("unit", "a unit").text("a unit");
  const Range interval = read_interval(p);
  out.lower95 = interval.lo;
  out.upper95 = interval.hi;
  return out;
}

ModelStep read_step(const Cursor& s) {
  s.keys({"added", "removed", "date", "data", "parameters", "before", "after", "stopped_because"});
  ModelStep step;
  step.added = s.at("added", "\"<id:at>\" or \"\"").text("\"<id:at>\" or \"\"");
  step.removed = s.at("removed", "\"<id:at>\" or \"\"").text("\"<id:at>\" or \"\"");
  step.date = s.at("date", "a date or \"\"").text("a date or \"\"");
  step.data = read_rows<DataSource>(s, "data", "a list of logs", read_source);
  step.parameters =
      read_rows<StepParameter>(s, "parameters", "a list of parameters", read_step_parameter);
  step.before = read_rows<StageQuality>(s, "before", "a list of stages", read_quality);
  step.after = read_rows<StageQuality>(s, "after", "a list of stages", read_quality);
  step.stopped_because = s.at("stopped_because", "a text").text("a text");
  return step;
}

}  // namespace

void write_provenance(const CraneModel& model, ModelJson& root) {
  root["data"] = rows_json(model.data, source_json);
  root["quality"] = rows_json(model.quality, quality_json);
  Json definitions = Json::array();
  std::set<std::string> written;
  const auto carry = [&](const Effect& effect) {
    const std::string text = effect.definition();
    if (!text.empty() && written.insert(text).second) definitions.push_back(text);
  };
  for (const Effect* e : model.user_effects) carry(*e);
  for (const AppliedEffect& e : model.effects) carry(*e.effect);
  if (!definitions.empty()) root["user_effects"] = std::move(definitions);
  root["effects"] = rows_json(
      model.effects, [&](const AppliedEffect& e) { return effect_json(e, model.machine); });
  root["steps"] = rows_json(model.steps, step_json);
}

void read_provenance(const ModelCursor& root, CraneModel& model) {
  model.data = read_rows<DataSource>(root, "data", "a list of logs", read_source);
  model.quality = read_rows<StageQuality>(root, "quality", "a list of stages", read_quality);
  if (root.has("user_effects")) {
    const char* expected = "a list of YAML texts that define effects";
    for (const Cursor& d : root.at("user_effects", expected).list(expected)) {
      const std::string text = d.text("a YAML text that defines effects");
      try {
        for (const Effect* e : register_user_effects(text, "its YAML", model.machine)) {
          model.user_effects.push_back(e);
        }
      } catch (const InputError& error) {
        d.fail(error.what());
      }
    }
  }
  for (const Cursor& e :
       root.at("effects", "a list of physical effects").list("a list of physical effects")) {
    model.effects.push_back(read_effect(e, model.machine));
  }
  model.steps = read_rows<ModelStep>(root, "steps", "a list of steps", read_step);
}

}  // namespace sparflow
