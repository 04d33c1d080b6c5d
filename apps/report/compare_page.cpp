#include "apps/report/compare_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report/compare_charts.h"
#include "models/model_file.h"

namespace sparflow {
namespace {

// What the colours of scores mean; said below the table of scores.
constexpr double kGoodFit = 85.0, kPoorFit = 50.0;            // [%]
constexpr double kGoodRelative = 0.05, kPoorRelative = 0.15;  // RMSE over RMS of the measured
constexpr double kGoodEnergy = 0.02, kPoorEnergy = 0.05;      // relative error
const char* const kToneRule =
    "Good: fit at least 85 %, or an RMSE of at most 5 % of the measured RMS (for quantities that "
    "hardly vary, like "
    "the pressure of a constant supply). Poor: fit below 50 % and more than 15 % of the measured "
    "RMS.";

double measured_rms(const CompareResult& result, const StageScore& score) {
  double sum = 0.0, n = 0.0;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (s.stage != score.stage || s.at != score.at) continue;
      const auto there = s.measured.array().isFinite();
      sum += there.select(s.measured.array().square(), 0.0).sum();
      n += static_cast<double>(there.count());
    }
  }
  return std::sqrt(sum / n);
}

Tone tone_of(const CompareResult& result, const StageScore& s) {
  const double relative = s.rmse / measured_rms(result, s);
  if (s.fit_percent >= kGoodFit || relative <= kGoodRelative) return Tone::kGood;
  if (!(s.fit_percent >= kPoorFit) && relative > kPoorRelative) return Tone::kBad;
  return Tone::kWarning;
}

Tone tone_of(const EnergyScore& e) {
  const double error = std::abs(e.relative_error);
  if (!std::isfinite(error)) return Tone::kNeutral;
  return error <= kGoodEnergy ? Tone::kGood : error <= kPoorEnergy ? Tone::kWarning : Tone::kBad;
}

const char* tone_word(Tone tone) {
  return tone == Tone::kGood ? "good" : tone == Tone::kBad ? "poor" : "fair";
}

/// RMSE in the unit it reads best in: {"20.3", "kN"}.
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

/// Worse first: tone, then what of the variation stays unexplained.
bool worse(const CompareResult& result, const StageScore& a, const StageScore& b) {
  const Tone ta = tone_of(result, a), tb = tone_of(result, b);
  if (ta != tb) return static_cast<int>(ta) > static_cast<int>(tb);
  const auto open = [](const StageScore& s) {
    return std::isfinite(s.fit_percent) ? 100.0 - s.fit_percent : 0.0;
  };
  return open(a) > open(b);
}

/// The worst score of each stage, in the order of the stages.
std::vector<StageScore> worst_of_stages(const CompareResult& result) {
  std::vector<StageScore> out;
  for (const StageScore& s : result.scores) {
    auto at = std::find_if(out.begin(), out.end(),
                           [&](const StageScore& o) { return o.stage == s.stage; });
    if (at == out.end()) {
      out.push_back(s);
    } else if (worse(result, s, *at)) {
      *at = s;
    }
  }
  return out;
}

void add_tiles(Page& page, const CompareResult& result) {
  std::vector<Tile> tiles;
  for (const StageScore& s : worst_of_stages(result)) {
    const auto [value, unit] = error_text(s);
    const auto of_stage = std::count_if(result.scores.begin(), result.scores.end(),
                                        [&](const StageScore& o) { return o.stage == s.stage; });
    std::string note = of_stage > 1 ? "worst: " + place_words(s) : place_words(s);
    if (std::isfinite(s.fit_percent)) note += fmt::format(", fit {:.0f} %", s.fit_percent);
    tiles.push_back({value, unit, stage_words(s.stage) + ", RMS error", note, tone_of(result, s)});
  }
  for (const EnergyScore& e : result.energy) {
    tiles.push_back(
        {fmt::format("{:+.2f}", 100.0 * e.relative_error), "%", "energy of pump " + e.pump,
         fmt::format("{} kJ predicted, {} kJ measured", display_number(e.predicted / 1e3, 4),
                     display_number(e.measured / 1e3, 4)),
         tone_of(e)});
  }
  if (!tiles.empty()) page.tiles(std::move(tiles));
}

void add_scores(Page& page, const CompareResult& result) {
  Table table;
  table.title = "Predicted against measured";
  table.columns = {{"stage"},
                   {"at"},
                   {"RMSE", "", 4},
                   {"bias", "", 3},
                   {"unit"},
                   {"fit", "%", 3},
                   {"inside 95 % interval", "%", 3},
                   {"samples"},
                   {""}};
  bool intervals = false;
  for (const StageScore& s : result.scores) {
    intervals = intervals || std::isfinite(s.within_95_percent);
    table.rows.push_back({stage_words(s.stage), place_words(s), s.rmse / s.unit.si,
                          s.bias / s.unit.si, s.unit.name, s.fit_percent, s.within_95_percent,
                          static_cast<double>(s.n), std::string(tone_word(tone_of(result, s)))});
  }
  table.note =
      "Samples in which the cylinder moves (a pump: any cylinder it serves). Bias: mean of "
      "predicted \u2212 measured. "
      "Fit: 100 % when nothing is left, 0 % when a constant would do as well. ";
  if (intervals) table.note += "Inside: share of samples within the model's own 95 % interval. ";
  table.note += kToneRule;
  if (!table.rows.empty()) page.table(std::move(table));
}

void add_energy(Page& page, const CompareResult& result) {
  if (result.energy.empty()) return;
  Table table;
  table.title = "Pump energy";
  table.columns = {{"pump"},
                   {"measured", "kJ", 5},
                   {"predicted", "kJ", 5},
                   {"error", "%", 3},
                   {"from commands alone", "kJ", 5},
                   {"time", "s", 4}};
  for (const EnergyScore& e : result.energy) {
    table.rows.push_back(
        {e.pump, e.measured / 1e3, e.predicted / 1e3, 100.0 * e.relative_error,
         e.from_commands ? *e.from_commands / 1e3 : std::numeric_limits<double>::quiet_NaN(),
         e.duration});
  }
  table.note =
      "Pressure times flow over time. The flow is that of the measured speeds, in both columns; "
      "\"from commands "
      "alone\" takes it from the valve gains instead.";
  page.table(std::move(table));
}

void add_worst_regions(Page& page, const CompareResult& result, const std::string& prefix) {
  page.section(prefix + "Where it fails");
  if (result.worst.empty()) {
    page.paragraph(
        "No region stands out: what error there is lies evenly over poses, speeds and loads, as "
        "noise does.");
    return;
  }
  Table table;
  table.title = "Regions with the most error for their size";
  table.columns = {{"stage"},       {"where"}, {"of the error", "%", 2}, {"of the samples", "%", 2},
                   {"RMSE", "", 3}, {"unit"}};
  for (const WorstRegion& w : result.worst) {
    table.rows.push_back({stage_words(w.stage), w.sentence, 100.0 * w.share_of_error,
                          100.0 * w.share_of_samples, w.rmse, w.unit});
  }
  table.note =
      "Shares are of the squared error. One region at most for each cylinder and direction; the "
      "curves below are "
      "shaded where the log passes through one.";
  page.table(std::move(table));
}

/// "working pressure 0.9 bar, pump pressure 1.1 bar, energy of main +0.4 %"
std::string in_short(const CompareResult& result) {
  std::string text;
  for (const StageScore& s : worst_of_stages(result)) {
    const auto [value, unit] = error_text(s);
    text += fmt::format("{}{} {} {}", text.empty() ? "" : ", ", stage_words(s.stage), value, unit);
  }
  for (const EnergyScore& e : result.energy) {
    text += fmt::format("{}energy of {} {:+.2f} %", text.empty() ? "" : ", ", e.pump,
                        100.0 * e.relative_error);
  }
  return text;
}

std::string sentence(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text + ".";
}

void set_verdict(Page& page, const CompareResult& result) {
  if (result.scores.empty()) {
    page.verdict(Tone::kWarning, "Nothing could be compared",
                 "The notes below say which columns the log would need.");
    return;
  }
  const StageScore* worst = &result.scores.front();
  Tone tone = Tone::kGood;
  for (const StageScore& s : result.scores) {
    if (worse(result, s, *worst)) worst = &s;
  }
  for (const EnergyScore& e : result.energy) tone = std::max(tone, tone_of(e));
  const Tone stages = tone_of(result, *worst);
  tone = std::max(tone, stages);
  const auto [value, unit] = error_text(*worst);
  const std::string what = quantity_words(
      worst->stage,
      worst->regime.empty() || worst->stage == "pump" ? worst->at : place_words(*worst));
  std::string headline = "The model follows the measurements in every stage";
  if (stages != Tone::kGood) {
    headline =
        fmt::format("The model {} the {}: {} {} RMS",
                    stages == Tone::kBad ? "misses" : "follows only roughly", what, value, unit);
    if (std::isfinite(worst->fit_percent))
      headline += fmt::format(", {:.0f} % explained", std::max(0.0, worst->fit_percent));
  } else if (tone != Tone::kGood) {
    headline = "The model follows the measurements, its energy does not";
  }
  std::string text = fmt::format("Worst of each stage: {}. ", in_short(result));
  if (result.worst.empty()) {
    text += "No region of poses, speeds or loads stands out.";
  } else {
    // the region of the quantity in the headline, else the one with the highest rank
    const WorstRegion* region = &result.worst.front();
    for (auto w = result.worst.rbegin(); w != result.worst.rend(); ++w) {
      if (w->stage == worst->stage && w->at == worst->at) region = &*w;
    }
    text += "It fails most here: " + region->sentence + ".";
  }
  page.verdict(tone, headline, text);
}

}  // namespace

void add_comparison(Page& page, const CraneModel& model, const CompareResult& result,
                    const std::string& heading_prefix) {
  page.section(heading_prefix + "Scores");
  add_tiles(page, result);
  add_scores(page, result);
  add_energy(page, result);
  for (const std::string& note : result.notes) page.paragraph(sentence(note));
  if (result.scores.empty()) return;
  add_worst_regions(page, result, heading_prefix);
  page.section(heading_prefix + "Over the working area");
  if (add_working_area(page, model.machine, result) == 0) {
    page.paragraph("The tip moves along a line: there is no area to draw.");
  }
  page.section(heading_prefix + "Error against signals");
  page.paragraph(
      "Of each quantity, the signals that explain most of its error. A median line that leaves "
      "zero is an error "
      "that repeats, and so physics that the model lacks; a cloud about zero is noise.");
  add_residuals(page, model.machine, result);
  page.section(heading_prefix + "Measured and predicted");
  page.paragraph(
      "Only samples that count in the scores are drawn. Bands: \u00B12 standard deviations of one "
      "measurement. Shaded: "
      "the regions above. Drag to zoom; all charts of a log follow.");
  add_compared_curves(page, model.machine, result);
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
