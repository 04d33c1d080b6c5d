// Writes the result of a comparison as JSON and as a table, and lists the signals on which a residual may depend.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "identification/comparison/compare.h"
#include "identification/comparison/report_numbers.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

Json score_json(const StageScore& s, const ErrorRanking& ranking) {
  Json out = {{"rmse", s.rmse / s.unit.si},
              {"unit", s.unit.name},
              {"fit_percent", s.fit_percent},
              {"bias", s.bias / s.unit.si},
              {"within_95_percent", s.within_95_percent},
              {"n", s.n}};
  if (const RankedError* r = ranking.find(s.stage, s.at, s.regime)) {
    out["grade"] = grade_word(r->grade);
    out["explained_percent"] = r->explained_percent();
  }
  if (s.stage == "pressure") {
    out["extrapolated_percent"] = s.extrapolated_percent;
    out["extrapolated_error_percent"] = s.extrapolated_error_percent;
  }
  return out;
}

using VisitSignal = std::function<void(RegimeSignal&&)>;

void visit_cylinder(const Machine& machine, const MachineSignals& signals, int index,
                    const VisitSignal& visit) {
  const std::string& name = machine.cylinders[static_cast<std::size_t>(index)].name;
  const CylinderSignals& c = signals.cylinders[static_cast<std::size_t>(index)];
  visit({"speed_" + name + "_mm_s", name + " speed", "mm/s", 1e-3, c.speed.cwiseAbs()});
  visit({"acceleration_" + name + "_m_s2", name + " acceleration", "m/s2", 1.0, c.acceleration});
  visit({"load_" + name + "_kN", name + " load", "kN", 1e3, c.statics()});
  if (c.has_command()) {
    visit({"u_" + name, name + " command", "", 1.0, c.command.cwiseAbs()});
  }
}

/// A column without a known meaning, with display units where its own unit is SI.
RegimeSignal candidate_signal(const CandidateSignal& c) {
  if (c.unit == "Pa") return {c.name + "_bar", c.name, "bar", units::kBar, c.values};
  if (c.unit == "m^3/s")
    return {c.name + "_lpm", c.name, "l/min", units::kLitrePerMinute, c.values};
  if (c.unit == "rad") return {c.name + "_deg", c.name, "deg", units::kDegree, c.values};
  return {c.name, c.name, c.unit, 1.0, c.values};
}

const char* bad_words(BadDataKind kind) {
  switch (kind) {
    case BadDataKind::kStuck:
      return "is stuck";
    case BadDataKind::kJumping:
      return "jumps";
    case BadDataKind::kNoisy:
      return "is noisy";
    case BadDataKind::kDropOut:
      return "drops out";
    case BadDataKind::kSaturated:
      return "is cut off";
    case BadDataKind::kWild:
      return "has single samples far off";
    case BadDataKind::kRippling:
      return "ripples";
  }
  return "";
}

std::string lower_case_first(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

/// Wraps text into indented lines of at most about 110 characters.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 110;
  std::string out, line = " ";
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::string word = text.substr(start, end - start);
    if (line.size() + 1 + word.size() > kWidth) {
      out += line + "\n";
      line = "   ";
    }
    line += " " + word;
    start = end + 1;
  }
  return out + line + "\n";
}

/// @return [samples] flow to the pump's other cylinders, positive in simultaneous motions
VectorXd other_flow(const Machine& machine, const MachineSignals& signals, int pump, int cylinder) {
  VectorXd sum = VectorXd::Zero(signals.samples());
  if (pump < 0) return sum;
  for (const int i : machine.pumps[static_cast<std::size_t>(pump)].feeds) {
    if (i != cylinder) sum += signals.cylinders[static_cast<std::size_t>(i)].flow;
  }
  return sum;
}

Json range_json(const Range& r) {
  if (!std::isfinite(r.lo)) return nullptr;
  return {r.lo, r.hi};
}

Json slips_json(const CompareResult& result) {
  Json list = Json::array();
  for (const SlipOfLog& s : result.slips) {
    list.push_back({{"file", s.file},
                    {"kind", s.slip.kind},
                    {"channels", s.slip.channels},
                    {"sentence", s.slip.sentence}});
  }
  return list;
}

/// Adds residual tests, stage at fault, errors by regime, worst motions and bad channels.
void causes_json(const CompareResult& result, Json& root) {
  Json& tests = root["residual_tests"];
  tests = {{"blocks", result.tests.blocks},
           {"tested", result.tests.tested},
           {"p_value", result.tests.smallest_p()},
           {"tests", Json::array()}};
  for (const ResidualTest& t : result.tests.tests) {
    Json test = {{"stage", t.stage},      {"at", t.at},
                 {"regime", t.regime},    {"depends_on", t.depends_on},
                 {"p_value", t.p_value},  {"size", t.size},
                 {"unit", t.unit},        {"share_explained", t.share_explained},
                 {"samples", t.samples},  {"effective_samples", t.effective_samples},
                 {"blocks", t.blocks},    {"least_p_value", t.least_p},
                 {"sentence", t.sentence}};
    if (t.depends_on.empty()) test["ci95"] = range_json(t.ci95);
    tests["tests"].push_back(std::move(test));
  }
  Json& fault = root["stage_at_fault"];
  fault = {{"stage", nullptr}, {"at", nullptr}, {"sentence", result.fault.sentence}};
  if (result.fault.fault >= 0) {
    const StageSplit& f = result.fault.stages[static_cast<std::size_t>(result.fault.fault)];
    fault["stage"] = f.stage;
    fault["at"] = f.at;
    fault["regime"] = f.regime;
  }
  fault["stages"] = Json::array();
  for (const StageSplit& s : result.fault.stages) {
    fault["stages"].push_back({{"stage", s.stage},
                               {"at", s.at},
                               {"regime", s.regime},
                               {"error", s.error},
                               {"own", s.own},
                               {"inherited", s.inherited},
                               {"noise", s.noise},
                               {"unit", s.unit},
                               {"n", s.n}});
  }
  root["regimes"] = Json::array();
  for (const RegimeError& r : result.regimes) {
    root["regimes"].push_back({{"stage", r.stage},
                               {"at", r.at},
                               {"regime", r.regime},
                               {"factor", r.factor},
                               {"level", r.level},
                               {"rmse", r.rmse},
                               {"rmse_ci95", range_json(r.rmse_ci95)},
                               {"bias", r.bias},
                               {"bias_ci95", range_json(r.bias_ci95)},
                               {"unit", r.unit},
                               {"samples", r.samples},
                               {"blocks", r.blocks}});
  }
  root["worst_segments"] = Json::array();
  for (const WorstSegment& w : result.segments) {
    root["worst_segments"].push_back({{"stage", w.stage},
                                      {"at", w.at},
                                      {"regime", w.regime},
                                      {"file", w.file},
                                      {"from_s", w.from_s},
                                      {"to_s", w.to_s},
                                      {"moved", w.moved},
                                      {"rmse", w.rmse},
                                      {"bias", w.bias},
                                      {"unit", w.unit},
                                      {"share_of_error", w.share_of_error},
                                      {"share_of_samples", w.share_of_samples},
                                      {"sentence", w.sentence}});
  }
  root["bad_data"] = Json::array();
  for (const BadChannelOfLog& b : result.bad_data) {
    root["bad_data"].push_back({{"file", b.file},
                                {"channel", b.bad.channel},
                                {"kind", bad_data_word(b.bad.kind)},
                                {"from_s", b.bad.from_s},
                                {"to_s", b.bad.to_s},
                                {"share", b.bad.share},
                                {"in_errors", b.in_errors},
                                {"evidence", b.bad.evidence},
                                {"remedy", b.bad.remedy}});
  }
}

Json ranking_json(const ErrorRanking& ranking) {
  Json out = Json::array();
  for (const RankedError& r : ranking.errors) {
    Json one = {{"stage", r.stage},
                {"at", r.at},
                {"regime", r.regime},
                {"words", r.words},
                {"error", r.amount},
                {"grade", grade_word(r.grade)},
                {"explained_percent", r.explained_percent()},
                {"inherited_from", nullptr}};
    if (r.source >= 0)
      one["inherited_from"] = ranking.errors[static_cast<std::size_t>(r.source)].words;
    out.push_back(std::move(one));
  }
  return out;
}

std::string duration_text(double seconds) {
  return seconds < 120.0 ? fmt::format("{:.1f} s", seconds)
                         : fmt::format("{:.1f} min", seconds / 60.0);
}

std::string systematic_errors_text(const CompareResult& result) {
  constexpr std::size_t kMost = 6;
  const ResidualTests& tests = result.tests;
  if (tests.tests.empty()) return "";
  std::string text = "\nsystematic errors";
  text += fmt::format(" ({} tests on {} blocks of motion; chance of any false alarm {:.0f} %)\n",
                      tests.tested, tests.blocks, 100.0 * tests.alarm);
  const std::vector<std::string> undecided = tests.undecided();
  if (tests.smallest_p() > tests.alarm) {
    text += undecided.empty()
                ? "  none: no significant bias, no significant dependence on a signal\n"
                : "  none that is significant\n";
  }
  std::size_t shown = 0, alarms = 0;
  for (const ResidualTest& t : tests.tests) {
    if (t.p_value > tests.alarm) continue;
    ++alarms;
    if (shown < kMost) text += wrapped(t.stage + ": " + t.sentence);
    shown += shown < kMost ? 1 : 0;
  }
  if (alarms > shown) text += fmt::format("  and {} more, in --json\n", alarms - shown);
  for (std::size_t i = 0; i < std::min(undecided.size(), kMost); ++i) text += wrapped(undecided[i]);
  return text;
}

}  // namespace

std::vector<RegimeSignal> regime_signals(const Machine& machine, const MachineSignals& signals,
                                         const ComparedSeries& series) {
  std::vector<RegimeSignal> out;
  for_each_regime_signal(machine, signals, series,
                         [&out](RegimeSignal&& s) { out.push_back(std::move(s)); });
  return out;
}

void for_each_regime_signal(const Machine& machine, const MachineSignals& signals,
                            const ComparedSeries& series, const VisitSignal& visit) {
  const int cylinder = series.stage == "pump" ? -1 : machine.cylinder_index(series.at);
  const int pump =
      series.stage == "pump" ? machine.pump_index(series.at) : machine.pump_of_cylinder(cylinder);
  for (int j = 0; j < machine.joint_count(); ++j) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(j)];
    if (joint.type == JointType::kRevolute) {
      visit({"q_" + joint.name + "_deg", joint.name + " angle", "deg", units::kDegree,
             signals.q.col(j)});
    } else {
      visit({"q_" + joint.name + "_m", joint.name + " position", "m", 1.0, signals.q.col(j)});
    }
  }
  if (cylinder >= 0) visit_cylinder(machine, signals, cylinder, visit);
  if (pump >= 0) {
    visit({cylinder >= 0 ? "other_flow_lpm" : "flow_lpm",
           cylinder >= 0 ? "flow to the other cylinders" : "total flow", "l/min",
           units::kLitrePerMinute, other_flow(machine, signals, pump, cylinder)});
  }
  if (series.stage == "pump") {
    visit({"predicted_bar", "predicted pressure", "bar", units::kBar, series.predicted});
  }
  if (signals.payload_measured) visit({"payload_kg", "payload", "kg", 1.0, signals.payload});
  if (signals.oil.size() > 0) visit({"oil_C", "oil temperature", "degC", 1.0, signals.oil});
  if (signals.return_pressure.size() > 0) {
    visit({"p_return_bar", "return pressure", "bar", units::kBar, signals.return_pressure});
  }
  for (const CandidateSignal& c : signals.candidates) visit(candidate_signal(c));
}

std::string compare_json(const CompareResult& result) {
  Json stages = Json::object();
  for (const char* stage : {"force", "flow", "pressure", "pump", "energy"})
    stages[stage] = Json::object();
  for (const StageScore& s : result.scores) {
    if (s.regime.empty()) {
      stages[s.stage][s.at] = score_json(s, result.ranking);
    } else {
      stages[s.stage][s.at][s.regime] = score_json(s, result.ranking);
    }
  }
  for (const EnergyScore& e : result.energy) {
    Json& at = stages["energy"][e.pump];
    at = {{"measured_J", e.measured},
          {"predicted_J", e.predicted},
          {"relative_error", e.relative_error},
          {"duration_s", e.duration}};
    if (const RankedError* r = result.ranking.find("energy", e.pump))
      at["grade"] = grade_word(r->grade);
    if (e.from_commands) at["predicted_from_commands_J"] = *e.from_commands;
  }
  Json worst = Json::array();
  for (const WorstRegion& w : result.worst) {
    Json where = Json::object();
    for (const RegionBound& b : w.where) where[b.key] = {b.lo, b.hi};
    worst.push_back({{"stage", w.stage},
                     {"at", w.at},
                     {"regime", w.regime},
                     {"where", where},
                     {"rmse", w.rmse},
                     {"unit", w.unit},
                     {"share_of_error", w.share_of_error},
                     {"share_of_samples", w.share_of_samples},
                     {"sentence", w.sentence}});
  }
  Json logs = Json::array();
  for (const LogComparison& log : result.logs) {
    logs.push_back({{"file", log.signals.file},
                    {"samples", log.signals.samples()},
                    {"filter_window_s", log.signals.window}});
  }
  Json root = {{"samples", result.samples},
               {"headline", compare_headline(result)},
               {"grade", grade_word(result.ranking.grade())},
               {"ranking", ranking_json(result.ranking)},
               {"stages", stages},
               {"worst", worst},
               {"notes", result.notes},
               {"logs", logs}};
  root["slips"] = slips_json(result);
  causes_json(result, root);
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string compare_headline(const CompareResult& result) {
  std::string text = result.ranking.headline;
  if (!result.bad_data.empty()) {
    const BadChannel& bad = result.bad_data.front().bad;
    text = fmt::format("Bad data: {} {}; {}", bad.channel, bad_words(bad.kind),
                       lower_case_first(text));
  }
  if (!result.slips.empty())
    text = fmt::format("Check the sensors: {}; {}",
                       fmt::join(result.slips.front().slip.channels, ", "), lower_case_first(text));
  return text;
}

std::string compare_table(const CompareResult& result) {
  std::string text = fmt::format("{} samples in {} log{}\n", result.samples, result.logs.size(),
                                 result.logs.size() == 1 ? "" : "s");
  text += compare_headline(result) + ".\n";
  std::size_t width = 12;
  for (const StageScore& s : result.scores)
    width = std::max(width, s.at.size() + s.regime.size() + 1);
  if (!result.scores.empty()) {
    text += fmt::format("{:<12}{:<{}}  {:>9}  {:>9}  {:<6}{:>11}  {:<5}{:>8}\n", "stage", "at",
                        width, "RMSE", "bias", "unit", "explained %", "grade", "n");
  }
  for (const StageScore& s : result.scores) {
    const RankedError* r = result.ranking.find(s.stage, s.at, s.regime);
    text +=
        fmt::format("{:<12}{:<{}}  {:>9}  {:>9}  {:<6}{:>11}  {:<5}{:>8}\n", s.stage,
                    s.regime.empty() ? s.at : s.at + " " + s.regime, width,
                    short_number(s.rmse / s.unit.si), short_number(s.bias / s.unit.si), s.unit.name,
                    r != nullptr ? fmt::format("{:.0f}", r->explained_percent()) : "-",
                    r != nullptr ? grade_word(r->grade) : "-", s.n);
  }
  for (const EnergyScore& e : result.energy) {
    if (!std::isfinite(e.relative_error)) continue;  // a note tells it
    text += fmt::format("{:<12}{:<{}}  measured {} kJ, predicted {} kJ ({:+.2f} %)", "energy",
                        e.pump, width, short_number(e.measured / 1e3),
                        short_number(e.predicted / 1e3), 100.0 * e.relative_error);
    if (e.from_commands)
      text += fmt::format(", from commands {} kJ", short_number(*e.from_commands / 1e3));
    const RankedError* r = result.ranking.find("energy", e.pump);
    text += fmt::format(" in {}{}\n", duration_text(e.duration),
                        r != nullptr ? std::string(", ") + grade_word(r->grade) : "");
  }
  text +=
      "explained % = 100 (1 - error beyond the sensor's noise / standard deviation of the "
      "measured, "
      "at least a\nthird of its RMS); bias = predicted - measured\n";
  if (!result.slips.empty()) text += "\nsensors that seem to be connected or named wrongly\n";
  for (const SlipOfLog& s : result.slips) text += wrapped(s.file + ": " + s.slip.sentence);
  if (!result.bad_data.empty()) text += "\nbad data; none of it takes part in what is learned\n";
  for (const BadChannelOfLog& b : result.bad_data)
    text += wrapped(fmt::format("{}: {}: {}", b.in_errors ? "in the errors" : "set aside", b.file,
                                bad_channel_sentence(b.bad)));
  if (!result.fault.sentence.empty()) text += "\nstage at fault\n" + wrapped(result.fault.sentence);
  if (!result.worst.empty()) text += "\nregions with the largest errors\n";
  for (const WorstRegion& w : result.worst) text += wrapped(w.stage + ": " + w.sentence);
  if (!result.segments.empty()) text += "\nmotions with the largest errors\n";
  for (const WorstSegment& w : result.segments) text += wrapped(w.stage + ": " + w.sentence);
  text += systematic_errors_text(result);
  if (!result.notes.empty()) text += "\nnotes\n";
  for (const std::string& note : result.notes) text += wrapped(note);
  return text;
}

}  // namespace sparflow
