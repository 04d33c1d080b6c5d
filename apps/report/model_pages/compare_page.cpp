#include "apps/report/model_pages/compare_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report/model_pages/compare_causes.h"
#include "apps/report/model_pages/compare_charts.h"
#include "apps/report/model_pages/score_judgement.h"
#include "models/files/model_file.h"

namespace sparflow {
namespace {

/// RMSE in the unit that keeps it short: {"20.3", "kN"}.
std::pair<std::string, std::string> error_text(const StageScore& s) {
  if (s.unit.name == "N" && s.rmse >= 1e3) return {display_number(s.rmse / 1e3, 3), "kN"};
  return {display_number(s.rmse / s.unit.si, 3), s.unit.name};
}

std::string place_words(const StageScore& s) {
  if (s.stage == "pump") return "pump " + s.at;
  if (s.regime.empty()) return s.at;
  return s.at + (s.regime == "extend" ? " extending" : " retracting");
}

std::string stage_words(const std::string& stage) {
  if (stage == "pressure") return "working pressure";
  if (stage == "pump") return "pump pressure";
  if (stage == "flow") return "flow from command";
  if (stage == "flow_sensor") return "flow at its sensor";
  return stage;
}

/// Rounds to a multiple of `step`, so that rounding errors are shown as 0.
double rounded(double value, double step) { return std::round(value / step) * step; }

std::string signed_percent(double share) {
  if (!std::isfinite(share)) return "\u2013";
  const double percent = rounded(100.0 * share, 0.01);
  return percent == 0.0 ? "0.00" : fmt::format("{:+.2f}", percent);
}

void add_tiles(Page& page, const CompareResult& result, const std::vector<JudgedScore>& judged) {
  std::vector<Tile> tiles;
  for (const JudgedScore& j : worst_of_stages(judged)) {
    const StageScore& s = j.score;
    const auto [value, unit] = error_text(s);
    const auto of_stage = std::count_if(result.scores.begin(), result.scores.end(),
                                        [&](const StageScore& o) { return o.stage == s.stage; });
    std::string note = of_stage > 1 ? "worst: " + place_words(s) : place_words(s);
    if (s.fit_percent >= 0.05) note += fmt::format(", fit {:.0f} %", s.fit_percent);
    tiles.push_back({value, unit, stage_words(s.stage) + ", RMS error", note, j.tone});
  }
  for (const EnergyScore& e : result.energy) {
    tiles.push_back(
        {signed_percent(e.relative_error), "%", "energy of pump " + e.pump,
         std::isfinite(e.relative_error)
             ? fmt::format("{} kJ predicted, {} kJ measured", display_number(e.predicted / 1e3, 4),
                           display_number(e.measured / 1e3, 4))
             : fmt::format("the pump delivered nothing in {:.1f} s: no cylinder is driven",
                           e.duration),
         judge_energy(e)});
  }
  if (!tiles.empty()) page.tiles(std::move(tiles));
}

void add_scores(Page& page, const std::vector<JudgedScore>& judged) {
  Table table;
  table.title = "Predicted against measured";
  table.columns = {{"stage"},       {"at"},   {"RMSE", "", 4}, {"sensor noise", "", 3},
                   {"bias", "", 2}, {"unit"}, {"fit", "%", 3}, {"inside 95 % interval", "%", 3},
                   {"samples"},     {""}};
  bool intervals = false;
  for (const JudgedScore& j : judged) {
    const StageScore& s = j.score;
    const double rmse = s.rmse / s.unit.si;
    const double step = rmse > 0.0 ? std::pow(10.0, std::floor(std::log10(rmse)) - 2.0) : 1.0;
    intervals = intervals || std::isfinite(s.within_95_percent);
    table.rows.push_back({stage_words(s.stage), place_words(s), rmse, j.noise / s.unit.si,
                          rounded(s.bias / s.unit.si, step), s.unit.name,
                          rounded(s.fit_percent, 0.1), s.within_95_percent,
                          static_cast<double>(s.n), std::string(tone_word(j.tone))});
  }
  table.note =
      "Only samples in which the cylinder moves (for a pump: any of its cylinders). Bias: mean of "
      "predicted \u2212 measured. "
      "Fit: 100 % when there is no error, 0 % when a constant would predict as well; noise alone "
      "keeps it below 100 %. ";
  if (intervals) table.note += "Inside: share of samples within the model's own 95 % interval. ";
  table.note += kJudgementRule;
  if (!table.rows.empty()) page.table(std::move(table));
}

void add_energy(Page& page, const CompareResult& result) {
  if (result.energy.empty()) return;
  Table table;
  table.title = "Pump energy";
  table.columns = {{"pump"},          {"measured", "kJ", 5},           {"predicted", "kJ", 5},
                   {"error", "%", 3}, {"from commands only", "kJ", 5}, {"time", "s", 4}};
  for (const EnergyScore& e : result.energy) {
    table.rows.push_back(
        {e.pump, e.measured / 1e3, e.predicted / 1e3, rounded(100.0 * e.relative_error, 0.01),
         e.from_commands ? *e.from_commands / 1e3 : std::numeric_limits<double>::quiet_NaN(),
         e.duration});
  }
  table.note =
      "Integral of pressure times flow. Measured and predicted use the flow of the measured "
      "speeds; "
      "\"from commands only\" uses commands and valve gains instead.";
  page.table(std::move(table));
}

void add_worst_regions(Page& page, const CompareResult& result, const std::string& prefix) {
  page.section(prefix + "Where it fails");
  if (result.worst.empty()) {
    page.paragraph(
        "No region stands out: the error is spread evenly over postures, speeds and loads, as "
        "noise "
        "is.");
    return;
  }
  Table table;
  table.title = "Regions with the largest error for their size";
  table.columns = {{"stage"},       {"where"}, {"of the error", "%", 2}, {"of the samples", "%", 2},
                   {"RMSE", "", 3}, {"unit"}};
  for (const WorstRegion& w : result.worst) {
    table.rows.push_back({stage_words(w.stage), w.sentence, 100.0 * w.share_of_error,
                          100.0 * w.share_of_samples, w.rmse, w.unit});
  }
  table.note =
      "Shares are of the squared error. There is at most one region for each cylinder and "
      "direction; "
      "the curves below are shaded where the log passes through one.";
  page.table(std::move(table));
}

/// "force 2.3 kN, working pressure 0.9 bar, energy of main +0.40 %"
std::string worst_errors(const CompareResult& result, const std::vector<JudgedScore>& judged) {
  std::string text;
  for (const JudgedScore& j : worst_of_stages(judged)) {
    const auto [value, unit] = error_text(j.score);
    text += fmt::format("{}{} {} {}", text.empty() ? "" : ", ", stage_words(j.score.stage), value,
                        unit);
  }
  for (const EnergyScore& e : result.energy) {
    text += fmt::format("{}energy of {} {} %", text.empty() ? "" : ", ", e.pump,
                        signed_percent(e.relative_error));
  }
  return text;
}

/// Describes in whole sentences how the error of one quantity is distributed.
std::string where_it_fails(const CompareResult& result, const StageScore& worst) {
  std::string text;
  if (std::abs(worst.bias) > 0.5 * worst.rmse) {
    const bool kilo = worst.unit.name == "N" && std::abs(worst.bias) >= 1e3;
    text = fmt::format("On average the prediction is {} {} too {}. ",
                       display_number(std::abs(worst.bias) / (kilo ? 1e3 : worst.unit.si), 3),
                       kilo ? "kN" : worst.unit.name, worst.bias < 0.0 ? "low" : "high");
  }
  const auto region = std::find_if(
      result.worst.begin(), result.worst.end(),
      [&](const WorstRegion& w) { return w.stage == worst.stage && w.at == worst.at; });
  if (region != result.worst.end())
    return text + "Its error is largest here: " + region->sentence + ". ";
  text += "Its error is spread over all postures, speeds and loads. ";
  if (!result.worst.empty()) text += "Elsewhere: " + result.worst.front().sentence + ". ";
  return text;
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
  }
  return "";
}

void set_verdict(Page& page, const CompareResult& result, const std::vector<JudgedScore>& judged) {
  const JudgedScore* worst = worst_score(judged);
  if (worst == nullptr) {
    page.verdict(Tone::kWarning, "Nothing could be compared",
                 "The notes below name the columns that the log lacks.");
    return;
  }
  Tone tone = worst->tone;
  for (const EnergyScore& e : result.energy) tone = std::max(tone, judge_energy(e));
  const StageScore& s = worst->score;
  const auto [value, unit] = error_text(s);
  std::string headline = "The model follows the measurements in every stage";
  std::string text;
  if (worst->tone != Tone::kGood) {
    const std::string what = quantity_words(s.stage, s.stage == "pump" ? s.at : place_words(s));
    headline = fmt::format("The model {} the {}: {} {} RMS",
                           worst->tone == Tone::kBad ? "misses" : "follows only roughly", what,
                           value, unit);
    if (std::isfinite(s.fit_percent))
      headline += fmt::format(", {:.0f} % explained", std::max(0.0, s.fit_percent));
    text = where_it_fails(result, s);
  } else {
    if (tone != Tone::kGood) headline = "The model follows the measurements, except for the energy";
    text = result.worst.empty()
               ? "No region of postures, speeds or loads stands out. "
               : "The error is largest here: " + result.worst.front().sentence + ". ";
  }
  if (!result.bad_data.empty()) {
    tone = Tone::kBad;
    headline = "Bad data: " + result.bad_data.front().bad.channel + " " +
               bad_words(result.bad_data.front().bad.kind);
    text = bad_channel_sentence(result.bad_data.front().bad) + " " + text;
  }
  if (!result.slips.empty()) {
    tone = Tone::kBad;
    headline =
        fmt::format("Check the sensors: {}", fmt::join(result.slips.front().slip.channels, ", "));
    std::string sentences;
    for (const SlipOfLog& slip : result.slips)
      sentences += slip.file + ": " + slip.slip.sentence + ". ";
    text = sentences + text;
  }
  if (!result.fault.sentence.empty()) text = result.fault.sentence + " " + text;
  page.verdict(tone, headline,
               text + fmt::format("RMS error at the worst place of each stage: {}.",
                                  worst_errors(result, judged)));
}

}  // namespace

void add_comparison(Page& page, const CraneModel& model, const CompareResult& result,
                    const std::string& heading_prefix) {
  page.section(heading_prefix + "Scores");
  const std::vector<JudgedScore> judged = judge_scores(model.machine, result);
  add_tiles(page, result, judged);
  add_scores(page, judged);
  add_energy(page, result);
  for (const std::string& note : result.notes)
    page.paragraph(note.ends_with('.') ? note : note + ".");
  if (result.scores.empty()) return;
  add_causes(page, result, heading_prefix);
  add_worst_regions(page, result, heading_prefix);
  add_working_area(page, model.machine, result, heading_prefix);
  page.section(heading_prefix + "Error against signals");
  page.paragraph(
      "For each quantity: its error against the signals that explain most of it, with the median "
      "of "
      "each direction. A median that differs from zero is a systematic error, so the model lacks a "
      "physical effect. Two medians with a constant difference indicate friction. A cloud about "
      "zero is noise.");
  const JudgedScore* worst = worst_score(judged);
  add_residuals(page, model.machine, result, worst->score.stage, worst->score.at);
  add_compared_curves(page, model.machine, result, heading_prefix);
}

Page compare_page(const CraneModel& model, const CompareResult& result) {
  Page page("Model against measurements: " + model.machine.name);
  page.subtitle(fmt::format("{} samples in {} log{}", result.samples, result.logs.size(),
                            result.logs.size() == 1 ? "" : "s"));
  set_verdict(page, result, judge_scores(model.machine, result));
  add_comparison(page, model, result);
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", model.machine.name);
  for (const LogComparison& log : result.logs) {
    page.provenance("compared log",
                    fmt::format("{}, {} samples, sha256 {}", log.signals.file,
                                log.signals.samples(), log.signals.sha256.substr(0, 16)));
  }
  for (const DataSource& d : model.data) {
    page.provenance("model's " + d.use + " log",
                    fmt::format("{}, {} rows, sha256 {}", d.file, d.rows, d.sha256.substr(0, 16)));
  }
  return page;
}

}  // namespace sparflow
