#include "apps/report/model_pages/compare_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "apps/report/charts/working_area.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr std::size_t kMostCurveCharts = 40;  // keeps the page readable and small
const char* const kCurvesExplained =
    "Each cylinder and pump has one colour on all pages. Only samples that count in the scores are "
    "drawn. Bands: \u00B12 standard deviations of one "
    "measurement. Shaded: the regions named above. Drag to zoom; all charts of a log zoom "
    "together.";

bool compared(const ComparedSeries& s) { return s.measured.array().isFinite().any(); }

/// Marks the samples of one log that lie in a region found by the comparison.
Mask in_region(const Machine& machine, const MachineSignals& signals, const ComparedSeries& series,
               const WorstRegion& region) {
  Mask inside(series.measured.size());
  for (Index k = 0; k < inside.size(); ++k) {
    inside[k] = std::isfinite(series.measured[k]) &&
                series.regimes[static_cast<std::size_t>(series.regime[k])] == region.regime;
  }
  for (const RegimeSignal& signal : regime_signals(machine, signals, series)) {
    for (const RegionBound& bound : region.where) {
      if (bound.key != signal.key) continue;
      const Eigen::ArrayXd values = signal.values.array() / signal.scale;
      inside = inside && values >= bound.lo && values <= bound.hi;
    }
  }
  return inside;
}

/// Stretches of time in which `inside` is set; those less than half a second apart are joined, the longest 40 kept.
std::vector<Span> spans_of(const Mask& inside, const VectorXd& time) {
  constexpr double kJoin = 0.5;  // [s]
  constexpr std::size_t kMost = 40;
  std::vector<Span> spans;
  for (Index k = 0; k < inside.size(); ++k) {
    if (!inside[k]) continue;
    if (spans.empty() || time[k] - spans.back().to > kJoin) {
      spans.push_back({time[k], time[k], ""});
    } else {
      spans.back().to = time[k];
    }
  }
  if (spans.size() > kMost) {
    std::sort(spans.begin(), spans.end(),
              [](const Span& a, const Span& b) { return a.to - a.from > b.to - b.from; });
    spans.resize(kMost);
    std::sort(spans.begin(), spans.end(),
              [](const Span& a, const Span& b) { return a.from < b.from; });
  }
  return spans;
}

/// Measured and predicted curve of a quantity in one of its logs.
/// @param of the log and its series, as in ComparedQuantity::logs
LineChart curve_chart(const Machine& machine, const CompareResult& result,
                      const ComparedQuantity& quantity,
                      const std::pair<const LogComparison*, const ComparedSeries*>& of) {
  const LogComparison& log = *of.first;
  const ComparedSeries& series = *of.second;
  LineChart chart;
  chart.title = capitalised(quantity.words);
  chart.width = FigureWidth::kHalf;
  chart.group = log.signals.file;
  chart.y_axis = {quantity.stage == "force"            ? "force"
                  : quantity.stage.starts_with("flow") ? "flow"
                                                       : "pressure",
                  quantity.unit.name};
  chart.x = log.signals.time;
  const double scale = 1.0 / quantity.unit.si;
  LineSeries measured, predicted;
  measured.name = "measured";
  measured.y = series.measured * scale;
  measured.style = LineStyle::kMeasured;
  predicted.name = "predicted";
  predicted.y = series.predicted * scale;
  predicted.style = LineStyle::kPredicted;
  measured.color = predicted.color = place_color(machine, series.stage, series.at);
  if (series.deviation.size() > 0) {
    predicted.band_lower = (series.predicted - 2.0 * series.deviation) * scale;
    predicted.band_upper = (series.predicted + 2.0 * series.deviation) * scale;
  }
  chart.series = {std::move(measured), std::move(predicted)};
  for (const WorstRegion& region : result.worst) {
    if (region.stage != series.stage || region.at != series.at) continue;
    const std::vector<Span> spans =
        spans_of(in_region(machine, log.signals, series, region), log.signals.time);
    chart.spans.insert(chart.spans.end(), spans.begin(), spans.end());
  }
  return chart;
}

}  // namespace

int place_color(const Machine& machine, const std::string& stage, const std::string& at) {
  return stage == "pump" || stage == "energy" ? machine.cylinder_count() + machine.pump_index(at)
                                              : machine.cylinder_index(at);
}

Tone tone_of(Grade grade) {
  return grade == Grade::kGood ? Tone::kGood : grade == Grade::kPoor ? Tone::kBad : Tone::kWarning;
}

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string quantity_words(const std::string& stage, const std::string& at) {
  return quantity_name(stage, at, "");
}

std::vector<ComparedQuantity> compared_quantities(const CompareResult& result) {
  std::vector<ComparedQuantity> all;
  for (const LogComparison& log : result.logs) {
    for (const ComparedSeries& s : log.series) {
      if (!compared(s)) continue;
      auto at = std::find_if(all.begin(), all.end(), [&](const ComparedQuantity& q) {
        return q.stage == s.stage && q.at == s.at;
      });
      if (at == all.end()) {
        all.push_back({s.stage, s.at, quantity_words(s.stage, s.at), s.unit, {}});
        at = all.end() - 1;
      }
      at->logs.emplace_back(&log, &s);
      const double largest =
          s.measured.array().isFinite().select(s.measured.array().abs(), 0.0).maxCoeff();
      if (at->unit.name == "N" && largest >= 1e4) at->unit = {"kN", 1e3};
    }
  }
  const auto rank = [](const ComparedQuantity& q) {
    const std::vector<std::string> order = {"force", "flow", "flow_sensor", "pressure", "pump"};
    return std::find(order.begin(), order.end(), q.stage) - order.begin();
  };
  std::stable_sort(
      all.begin(), all.end(),
      [&](const ComparedQuantity& a, const ComparedQuantity& b) { return rank(a) < rank(b); });
  return all;
}

void add_compared_curves(Page& page, const Machine& machine, const CompareResult& result,
                         const std::string& heading_prefix) {
  const std::vector<ComparedQuantity> quantities = compared_quantities(result);
  std::size_t drawn = 0, left_out = 0;
  for (const LogComparison& log : result.logs) {
    bool heading = false;
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      for (const auto& of : quantities[i].logs) {
        if (of.first != &log) continue;
        if (drawn == kMostCurveCharts) {
          ++left_out;
          continue;
        }
        if (!heading) {
          page.section(heading_prefix + "Curves of " + log.signals.file);
          if (drawn == 0) page.paragraph(kCurvesExplained);
          heading = true;
        }
        ++drawn;
        page.plot(curve_chart(machine, result, quantities[i], of));
      }
    }
  }
  if (left_out > 0) {
    page.paragraph(fmt::format(
        "{} more charts are left out to keep the page small; compare fewer logs at a time to see "
        "them.",
        left_out));
  }
}

void add_working_area(Page& page, const Machine& machine, const CompareResult& result,
                      const std::string& heading_prefix) {
  constexpr double kFlat = 0.02;  // [m] an area less high or wide counts as a line
  bool heading = false;
  for (const ComparedQuantity& quantity : compared_quantities(result)) {
    std::vector<Eigen::Vector2d> tip;
    std::vector<double> residual;
    std::vector<VectorXd> pose;
    DrawingPlane plane;
    for (const auto& [log, series] : quantity.logs) {
      const VectorXd error = series->residual();
      for (Index k = 0; k < error.size(); ++k) {
        if (!std::isfinite(error[k])) continue;
        pose.emplace_back(log->signals.q.row(k));
        if (plane.turns || pose.size() == 1) plane = drawing_plane(machine, pose.back());
        tip.push_back(plane.project(log->signals.tip.row(k).transpose()));
        residual.push_back(error[k] / quantity.unit.si);
      }
    }
    Eigen::Vector2d lo = tip.front(), hi = tip.front();
    for (const Eigen::Vector2d& p : tip) {
      lo = lo.cwiseMin(p);
      hi = hi.cwiseMax(p);
    }
    if ((hi - lo).minCoeff() < kFlat) continue;
    HeatMap map = rms_over_working_area(
        tip, Eigen::Map<VectorXd>(residual.data(), static_cast<Index>(residual.size())));
    Index row = 0, column = 0;
    if (!map.values.array().isFinite().any()) continue;
    map.values.array().isFinite().select(map.values.array(), -1.0).maxCoeff(&row, &column);
    const Eigen::Vector2d worst(0.5 * (map.x_edges[column] + map.x_edges[column + 1]),
                                0.5 * (map.z_edges[row] + map.z_edges[row + 1]));
    const auto nearest =
        std::min_element(tip.begin(), tip.end(), [&](const auto& a, const auto& b) {
          return (a - worst).squaredNorm() < (b - worst).squaredNorm();
        });
    map.crane = drawing_frame(machine, pose[static_cast<std::size_t>(nearest - tip.begin())]).parts;
    map.title = capitalised(quantity.words);
    map.note = fmt::format("Largest: {} {}.", display_number(map.values(row, column), 3),
                           quantity.unit.name);
    map.width = FigureWidth::kHalf;
    map.height = 400;
    map.x_axis = {plane.horizontal_name, "m"};
    map.z_axis = {plane.vertical_name, "m"};
    map.value = {"error (RMS)", quantity.unit.name};
    if (!heading) {
      page.section(heading_prefix + "Error over the working area");
      page.paragraph(
          "Root mean square of predicted \u2212 measured over the positions of the tip. The crane "
          "is "
          "drawn where the error is largest.");
      heading = true;
    }
    page.plot(std::move(map));
  }
}

}  // namespace sparflow
