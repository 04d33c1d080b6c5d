// The result of extending a model in words, as a table and as JSON.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_intervals.h"
#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

using Json = nlohmann::ordered_json;

/// Value and unit in which the number is short: kN from 10 kN on.
std::pair<double, std::string> readable(double value, const FieldUnit& unit) {
  if (unit.name == "N" && std::abs(value) >= 1e4) return {value / 1e3, "kN"};
  return {value / unit.si, unit.name};
}

std::string place(const StageScore& s) { return s.regime.empty() ? s.at : s.at + " " + s.regime; }

std::string signed_percent(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:+.1f} %", 100.0 * (ratio - 1.0)) : "-";
}

/// "force 4100 N (3850 .. 4350)" for each parameter, separated by commas
std::string parameters_text(const AppliedEffect& e) {
  std::string text;
  const auto& parameters = e.effect->info().parameters;
  for (std::size_t p = 0; p < e.values.size(); ++p) {
    const EffectParameter& q = parameters[p];
    if (is_absent(q, e.values[p])) continue;
    const std::string unit = q.unit.empty() || q.unit == "-" ? "" : " " + q.unit;
    const bool choice = q.choice || p >= e.lower95.size();
    if (!choice && !value_is_determined(e, p)) {
      text += fmt::format("{}{} is not determined by these logs", text.empty() ? "" : ", ", q.name);
      continue;
    }
    text += fmt::format(
        "{}{} {}{}", text.empty() ? "" : ", ", q.name,
        choice ? fmt::format("{:g}", e.values[p] / q.si) : plain_number(e.values[p] / q.si, 4),
        unit);
    if (const std::string variant = variant_text(q, e.values[p]); !variant.empty())
      text += " (" + variant + ")";
    if (!choice && std::isfinite(e.lower95[p])) {
      text += fmt::format(" ({} .. {})", plain_number(e.lower95[p] / q.si, 4),
                          plain_number(e.upper95[p] / q.si, 4));
    }
  }
  return text;
}

/// Whether a pressure error comes mostly from extrapolation beyond the training logs.
bool mostly_extrapolated(const StageScore& s) {
  // ExtendResult::table() should pass them, from options that the result does not carry
  static const CompareNoteOptions options;
  constexpr double kMostly = 50.0;  // [%] the larger part
  return s.extrapolated_percent >= options.extrapolated_percent &&
         s.extrapolated_error_percent > kMostly &&
         s.extrapolated_error_percent > options.extrapolated_ratio * s.extrapolated_percent;
}

/// Rows of one step: the scores that changed by more than 1 %, the largest change first.
std::string step_table(const ExtendStep& step) {
  constexpr double kMoved = 0.01;  // a smaller change is not shown
  struct Row {
    const StageScore* before;
    const StageScore* after;
    double change;  // of the logarithm
  };
  std::vector<Row> rows;
  long still = 0;
  for (const StageScore& b : step.before.scores) {
    const StageScore* a = step.after.find(b.stage, b.at, b.regime);
    if (a == nullptr) continue;
    const double change = std::log(std::max(a->rmse, 1e-300) / std::max(b.rmse, 1e-300));
    if (std::abs(change) > kMoved) {
      rows.push_back({&b, a, change});
    } else {
      ++still;
    }
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& x, const Row& y) {
    return std::abs(x.change) > std::abs(y.change);
  });
  std::string text;
  int beyond = 0;
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < std::min(kMost, rows.size()); ++i) {
    const auto [before, unit] = readable(rows[i].before->rmse, rows[i].before->unit);
    const double si = unit == "kN" ? 1e3 : rows[i].before->unit.si;
    const bool asked_too_much = mostly_extrapolated(*rows[i].after);
    beyond += asked_too_much ? 1 : 0;
    text += fmt::format("   {:<12}{:<22}{:>9} -> {:>9} {:<6}{:>9}{}\n", rows[i].before->stage,
                        place(*rows[i].before), short_number(before),
                        short_number(rows[i].after->rmse / si), unit,
                        signed_percent(std::exp(rows[i].change)), asked_too_much ? " *" : "");
  }
  if (beyond > 0) {
    text +=
        "   * most of this error is extrapolation of the pressure models to other flows or loads "
        "and says little about the effect\n";
  }
  const auto rest = still + static_cast<long>(rows.size() - std::min(kMost, rows.size()));
  if (rest > 0) text += fmt::format("   {} other errors moved less\n", rest);
  for (const EnergyScore& b : step.before.energy) {
    for (const EnergyScore& a : step.after.energy) {
      if (a.pump != b.pump || !std::isfinite(b.relative_error)) continue;
      text += fmt::format("   {:<12}{:<22}{:>+8.2f} % -> {:>+7.2f} % off\n", "energy", a.pump,
                          100.0 * b.relative_error, 100.0 * a.relative_error);
    }
  }
  return text;
}

Json value_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json score_json(const StageScore* s) {
  if (s == nullptr) return nullptr;
  return {{"rmse", value_or_null(s->rmse / s->unit.si)},
          {"unit", s->unit.name},
          {"fit_percent", value_or_null(s->fit_percent)},
          {"bias", value_or_null(s->bias / s->unit.si)},
          {"n", s->n}};
}

Json energy_json(const EnergyScore& e) {
  return {{"measured_J", e.measured},
          {"predicted_J", e.predicted},
          {"relative_error", value_or_null(e.relative_error)}};
}

Json stages_json(const ExtendStep& step) {
  Json stages = Json::object();
  for (const char* stage : {"force", "flow", "pressure", "pump", "energy"})
    stages[stage] = Json::object();
  const auto put = [&](const StageScore& s) {
    Json both = {{"before", score_json(step.before.find(s.stage, s.at, s.regime))},
                 {"after", score_json(step.after.find(s.stage, s.at, s.regime))}};
    if (s.regime.empty()) {
      stages[s.stage][s.at] = std::move(both);
    } else {
      stages[s.stage][s.at][s.regime] = std::move(both);
    }
  };
  for (const StageScore& s : step.before.scores) put(s);
  for (const StageScore& s : step.after.scores) put(s);
  for (const EnergyScore& e : step.before.energy)
    stages["energy"][e.pump]["before"] = energy_json(e);
  for (const EnergyScore& e : step.after.energy) stages["energy"][e.pump]["after"] = energy_json(e);
  return stages;
}

Json parameters_json(const AppliedEffect& e) {
  Json parameters = Json::array();
  for (std::size_t p = 0; p < e.values.size(); ++p) {
    const EffectParameter& q = e.effect->info().parameters[p];
    if (is_absent(q, e.values[p])) continue;
    Json ci = nullptr;
    if (p < e.lower95.size())
      ci = {value_or_null(e.lower95[p] / q.si), value_or_null(e.upper95[p] / q.si)};
    parameters.push_back({{"name", q.name},
                          {"value", e.values[p] / q.si},
                          {"unit", q.unit},
                          {"determined", value_is_determined(e, p)},
                          {"ci95", ci}});
  }
  return parameters;
}

Json changes_json(const ModelChange& change) {
  Json out = Json::array();
  for (const QuantityChange& q : change.quantities) {
    out.push_back({{"stage", q.before.stage},
                   {"at", q.before.at},
                   {"regime", q.before.regime},
                   {"change", change_word(q.kind)},
                   {"text", q.text}});
  }
  return out;
}

Json step_json(const ExtendStep& step) {
  Json out = {{"added", step.added}};
  if (!step.removed.empty()) out["removed"] = step.removed;
  out["title"] = step.title;
  out["stage"] = step.stage;
  out["parameters"] = parameters_json(step.effect);
  out["judged_on"] = step.judged_on;
  out["error_ratio"] = {{"overall", step.change.overall},
                        {"own", step.change.own},
                        {"own_steady", step.change.own_steady}};
  Json harmed = Json::array();
  for (const HarmedError& h : step.change.harmed) harmed.push_back(h.sentence);
  out["harmed"] = std::move(harmed);
  out["stages"] = stages_json(step);
  return out;
}

}  // namespace

ModelChange ExtendResult::change() const {
  if (steps.empty()) return {};
  return model_change(model.machine, steps.front().before, steps.back().after);
}

Grade ExtendResult::grade() const {
  if (steps.empty()) return rejected.empty() ? Grade::kGood : Grade::kFair;
  const Grade grade = change().grade();
  return steps.front().judged_on == "training logs" ? std::max(grade, Grade::kFair) : grade;
}

std::string ExtendResult::brief() const {
  if (steps.empty()) return "Nothing was added: " + stopped_because;
  std::string names;
  for (const ExtendStep& s : steps)
    names += (names.empty() ? "" : ", then ") + (s.added.empty() ? "minus " + s.removed : s.title);
  return fmt::format("{}{}: error on the {} {}", interrupted ? "Interrupted: " : "", names,
                     steps.front().judged_on, change().sentence());
}

std::string headline_on_tests(const Diagnosis& diagnosis, const ExtendResult* tested) {
  if (tested == nullptr || tested->steps.empty()) return diagnosis.headline();
  return fmt::format("{} On the {}, with that in the model: error {}.", diagnosis.headline(),
                     tested->steps.front().judged_on, tested->change().sentence());
}

std::string ExtendResult::table() const {
  std::string text;
  int number_of = 0;
  for (const ExtendStep& s : steps) {
    text += fmt::format("{}. {}\n   {}\n", ++number_of, s.title, parameters_text(s.effect));
    text += fmt::format("   RMS error on the {}:\n{}", s.judged_on, step_table(s));
    if (s.change.own_steady < 0.9 * s.change.own)  // no threshold: from there on it says more
      text += fmt::format("   without starts and stops the force error where it acts is {}\n",
                          signed_percent(s.change.own_steady));
  }
  if (steps.size() > 1) {  // a joint estimate changes the values of former steps
    text += "in the model now:\n";
    for (const AppliedEffect& e : model.effects)
      text += fmt::format("   {:<28}{}\n", e.key(model.machine), parameters_text(e));
  }
  for (const ExtendStep& s : rejected) {
    text += fmt::format("not kept: {} ({}); error on the {} {} where it acts, {} overall\n",
                        s.title, parameters_text(s.effect), s.judged_on,
                        signed_percent(s.change.own), signed_percent(s.change.overall));
  }
  for (const std::string& n : notes) text += "note: " + n + "\n";
  text += "stopped because " + stopped_because + "\n";
  text += fmt::format("{} ({:.1f} s)\n", brief(), seconds);
  return text;
}

std::string ExtendResult::json() const {
  Json list = Json::array(), tried = Json::array(), effects = Json::array();
  for (const ExtendStep& s : steps) list.push_back(step_json(s));
  for (const ExtendStep& s : rejected) tried.push_back(step_json(s));
  Json now = Json::array();
  for (const AppliedEffect& e : model.effects) {
    effects.push_back(e.key(model.machine));
    now.push_back({{"effect", e.key(model.machine)}, {"parameters", parameters_json(e)}});
  }
  Json root = {{"steps", list},
               {"stopped_because", stopped_because},
               {"not_kept", tried},
               {"effects", effects},
               {"in_the_model", now},
               {"headline", brief()},
               {"grade", grade_word(grade())},
               {"changes", changes_json(change())},
               {"notes", notes},
               {"interrupted", interrupted},
               {"seconds", seconds}};
  if (last) root["last_diagnosis"] = Json::parse(last->json());
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace sparflow
