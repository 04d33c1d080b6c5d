#include "apps/report/model_pages/compare_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/model_pages/compare_causes.h"
#include "apps/report/model_pages/compare_charts.h"
#include "identification/comparison/report_numbers.h"
#include "models/files/model_file.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

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

/// One tile for each stage, with the quantity that the ranking puts first (another error may be larger), and one for each pump's energy, in the order of the ranking.
void add_tiles(Page& page, const CompareResult& result) {
  std::vector<Tile> tiles;
  for (const RankedError* r : result.ranking.worst_of_stages()) {
    if (r->stage == "energy") continue;
    const StageScore* s = result.find(r->stage, r->at, r->regime);
    const auto of_stage = std::count_if(result.scores.begin(), result.scores.end(),
                                        [&](const StageScore& o) { return o.stage == r->stage; });
    const std::size_t space = r->amount.find(' ');
    const std::string unit = r->amount.substr(space + 1, r->amount.rfind(' ') - space - 1);
    tiles.push_back({r->amount.substr(0, space), unit, stage_words(r->stage) + ", RMS error",
                     fmt::format("{}{}, {:.0f} % explained", of_stage > 1 ? "ranked worst: " : "",
                                 place_words(*s), r->explained_percent()),
                     tone_of(r->grade)});
  }
  for (const RankedError& r : result.ranking.errors) {
    if (r.stage != "energy") continue;
    for (const EnergyScore& e : result.energy) {
      if (e.pump != r.at) continue;
      tiles.push_back(
          {r.amount.substr(0, r.amount.find(' ')), "%", r.words,
           fmt::format("{} kJ predicted, {} kJ measured", display_number(e.predicted / 1e3, 4),
                       display_number(e.measured / 1e3, 4)),
           tone_of(r.grade)});
    }
  }
  for (const EnergyScore& e : result.energy) {
    if (std::isfinite(e.relative_error)) continue;
    tiles.push_back(
        {"\u2013", "%", "energy of pump " + e.pump,
         fmt::format("the pump delivered nothing in {:.1f} s: no cylinder is driven", e.duration)});
  }
  if (!tiles.empty()) page.tiles(std::move(tiles));
}

const char* const kJudgementRule =
    "Explained: 100 % when the error is the sensor's noise, 0 % when it is as large as the "
    "standard deviation of the measured values (at least a third of their RMS is taken for it; of "
    "an "
    "energy a tenth). Good: 85 % and more. Poor: less than 50 %. The order is that of the ranking: "
    "worst grade first, an inherited error behind its source.";

void add_scores(Page& page, const CompareResult& result) {
  Table table;
  table.title = "Predicted against measured, worst first";
  table.columns = {{"quantity"},
                   {"error"},
                   {"bias"},
                   {"sensor noise", "", 3},
                   {"unit"},
                   {"explained", "%", 3},
                   {"grade"},
                   {"inherited from"},
                   {"inside 95 % interval", "%", 3},
                   {"samples"}};
  bool intervals = false;
  for (const RankedError& r : result.ranking.errors) {
    const StageScore* s = result.find(r.stage, r.at, r.regime);
    const std::string from =
        r.source < 0 ? "" : result.ranking.errors[static_cast<std::size_t>(r.source)].words;
    if (s == nullptr) {  // an energy
      table.rows.push_back({capitalised(r.words), r.amount, "", kNaN, "", r.explained_percent(),
                            std::string(grade_word(r.grade)), from, kNaN, kNaN});
      continue;
    }
    intervals = intervals || std::isfinite(s->within_95_percent);
    table.rows.push_back(
        {capitalised(r.words), r.amount, short_number(s->bias / s->unit.si) + " " + s->unit.name,
         r.noise / s->unit.si, s->unit.name, r.explained_percent(),
         std::string(grade_word(r.grade)), from, s->within_95_percent, static_cast<double>(s->n)});
  }
  table.note =
      "Only samples in which the cylinder moves (for a pump: any of its cylinders). Bias: mean of "
      "predicted \u2212 measured. ";
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
    table.rows.push_back({e.pump, e.measured / 1e3, e.predicted / 1e3,
                          rounded(100.0 * e.relative_error, 0.01),
                          e.from_commands ? *e.from_commands / 1e3 : kNaN, e.duration});
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

/// "force 2.3 kN RMS, working pressure 0.9 bar RMS, energy of pump main +0.40 %"
std::string worst_errors(const CompareResult& result) {
  std::string text;
  for (const RankedError* r : result.ranking.worst_of_stages()) {
    if (r->stage == "energy") continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", stage_words(r->stage), r->amount);
  }
  for (const RankedError& r : result.ranking.errors) {
    if (r.stage == "energy") text += fmt::format(", {} {}", r.words, r.amount);
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

void set_verdict(Page& page, const CompareResult& result) {
  const ErrorRanking& ranking = result.ranking;
  if (ranking.empty()) {
    page.verdict(Tone::kWarning, compare_headline(result),
                 "The notes below name the columns that the log lacks.");
    return;
  }
  std::string text;
  if (!result.bad_data.empty()) text = bad_channel_sentence(result.bad_data.front().bad) + " ";
  if (!result.fault.sentence.empty()) text += result.fault.sentence + " ";
  const RankedError& cause = *ranking.cause();
  if (const StageScore* s = result.find(cause.stage, cause.at, cause.regime);
      s != nullptr && ranking.grade() != Grade::kGood) {
    text += where_it_fails(result, *s);
  } else {
    text += result.worst.empty()
                ? "No region of postures, speeds or loads stands out. "
                : "The error is largest here: " + result.worst.front().sentence + ". ";
  }
  for (const SlipOfLog& slip : result.slips)
    text = slip.file + ": " + slip.slip.sentence + ". " + text;
  const bool sound = result.bad_data.empty() && result.slips.empty();
  page.verdict(sound ? tone_of(ranking.grade()) : Tone::kBad, compare_headline(result),
               text + fmt::format("Worst of each stage: {}.", worst_errors(result)));
}

}  // namespace

void add_comparison(Page& page, const CraneModel& model, const CompareResult& result,
                    const std::string& heading_prefix) {
  page.section(heading_prefix + "Scores");
  add_tiles(page, result);
  add_scores(page, result);
  add_energy(page, result);
  for (const std::string& note : result.notes)
    page.paragraph(note.ends_with('.') ? note : note + ".");
  if (result.scores.empty()) return;
  add_causes(page, model.machine, result, heading_prefix);
  add_worst_regions(page, result, heading_prefix);
  add_working_area(page, model.machine, result, heading_prefix);
  page.section(heading_prefix + "Error against signals");
  page.paragraph(
      "For each quantity: its error against the signals that explain most of it, with the median "
      "of "
      "each direction. A median that differs from zero is a systematic error, so the model lacks a "
      "physical effect. Two medians with a constant difference indicate friction. A cloud about "
      "zero is noise.");
  const RankedError& cause = *result.ranking.cause();
  add_residuals(page, model.machine, result, cause.stage, cause.at);
  add_compared_curves(page, model.machine, result, heading_prefix);
}

Page compare_page(const CraneModel& model, const CompareResult& result) {
  Page page("Model against measurements: " + model.machine.name);
  page.subtitle(fmt::format("{} samples in {} log{}", result.samples, result.logs.size(),
                            result.logs.size() == 1 ? "" : "s"));
  set_verdict(page, result);
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
