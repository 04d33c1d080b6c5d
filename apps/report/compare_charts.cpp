#include "apps/report/compare_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "apps/report/working_area.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr std::size_t kMostCurveCharts = 40;  // more than anybody scrolls through
constexpr std::size_t kSignalsPerQuantity = 2;
constexpr std::size_t kSignalsOfTheWorst = 6;

bool compared(const ComparedSeries& s) { return s.measured.array().isFinite().any(); }

/// Samples of one log that lie in a region found by the comparison.
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

/// Stretches of time inside, those nearer than half a second joined, the longest 40 of them.
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

LineChart curve_chart(const Machine& machine, const CompareResult& result,
                      const ComparedQuantity& quantity, const LogComparison& log,
                      const ComparedSeries& series, int color) {
  LineChart chart;
  chart.title = quantity.words;
  if (result.logs.size() > 1) chart.title += " \u2013 " + log.signals.file;
  chart.width = FigureWidth::kHalf;
  chart.group = log.signals.file;
  chart.y_axis = {quantity.words, quantity.unit.name};
  chart.x = log.signals.time;
  const double scale = 1.0 / quantity.unit.si;
  LineSeries measured, predicted;
  measured.name = "measured";
  measured.y = series.measured * scale;
  measured.style = LineStyle::kMeasured;
  predicted.name = "predicted";
  predicted.y = series.predicted * scale;
  predicted.style = LineStyle::kPredicted;
  measured.color = predicted.color = color;
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

/// Residuals of a quantity over all logs, one row a compared sample, with every signal any log offers.
struct ResidualTable {
  VectorXd residual;        // in the quantity's unit
  std::vector<int> regime;  // index into names
  std::vector<std::string> names;
  std::vector<RegimeSignal> signals;  // values in their unit
};

ResidualTable residual_table(const Machine& machine, const ComparedQuantity& quantity) {
  ResidualTable table;
  std::vector<double> residual;
  std::vector<std::vector<double>> columns;
  std::map<std::string, std::size_t> place;
  for (const auto& [log, series] : quantity.logs) {
    std::vector<Index> rows;
    for (Index k = 0; k < series->measured.size(); ++k) {
      if (!std::isfinite(series->measured[k])) continue;
      rows.push_back(k);
      residual.push_back((series->predicted[k] - series->measured[k]) / quantity.unit.si);
      table.regime.push_back(series->regime[k]);
    }
    table.names = series->regimes;
    for (const RegimeSignal& signal : regime_signals(machine, log->signals, *series)) {
      const auto [at, is_new] = place.try_emplace(signal.key, columns.size());
      if (is_new) {
        table.signals.push_back({signal.key, signal.words, signal.unit, 1.0, {}});
        columns.emplace_back();
      }
      std::vector<double>& column = columns[at->second];
      column.resize(residual.size() - rows.size(), kNaN);
      for (const Index k : rows) column.push_back(signal.values[k] / signal.scale);
    }
  }
  table.residual = Eigen::Map<VectorXd>(residual.data(), static_cast<Index>(residual.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    columns[c].resize(residual.size(), kNaN);
    table.signals[c].values =
        Eigen::Map<VectorXd>(columns[c].data(), static_cast<Index>(columns[c].size()));
  }
  return table;
}

std::string regime_words(const std::string& stage, const std::string& regime) {
  if (stage != "pump") return regime == "extend" ? "extending" : "retracting";
  return regime == "standby" || regime == "constant" ? regime : "led by " + regime;
}

ScatterChart scatter(const ComparedQuantity& quantity, const ResidualTable& table,
                     const RegimeSignal& signal, double share) {
  ScatterChart chart;
  chart.title = fmt::format("Error in {} against {}", quantity.words, signal.words);
  chart.note =
      fmt::format("{} explains {:.0f} % of the error's variance.", signal.words, 100.0 * share);
  chart.note[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(chart.note[0])));
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {signal.words, signal.unit};
  chart.y_axis = {"predicted \u2212 measured", quantity.unit.name};
  chart.trend = true;
  for (std::size_t r = 0; r < table.names.size(); ++r) {
    std::vector<double> x, y;
    for (Index k = 0; k < table.residual.size(); ++k) {
      if (table.regime[static_cast<std::size_t>(k)] != static_cast<int>(r)) continue;
      x.push_back(signal.values[k]);
      y.push_back(table.residual[k]);
    }
    if (x.empty()) continue;
    const auto n = static_cast<Index>(x.size());
    chart.groups.push_back({regime_words(quantity.stage, table.names[r]),
                            Eigen::Map<VectorXd>(x.data(), n), Eigen::Map<VectorXd>(y.data(), n)});
  }
  return chart;
}

/// Whether the worst region is of this quantity, or, where there is none, its fit the poorest.
bool is_worst(const CompareResult& result, const ComparedQuantity& quantity) {
  if (!result.worst.empty()) {
    return result.worst.front().stage == quantity.stage && result.worst.front().at == quantity.at;
  }
  const StageScore* poorest = nullptr;
  for (const StageScore& s : result.scores) {
    if (std::isfinite(s.fit_percent) &&
        (poorest == nullptr || s.fit_percent < poorest->fit_percent)) {
      poorest = &s;
    }
  }
  return poorest != nullptr && poorest->stage == quantity.stage && poorest->at == quantity.at;
}

}  // namespace

std::string quantity_words(const std::string& stage, const std::string& at) {
  if (stage == "pump") return "pressure of pump " + at;
  if (stage == "pressure") return "working pressure of " + at;
  if (stage == "flow_sensor") return "flow of " + at + " at its sensor";
  return stage + " of " + at;
}

double share_explained(const VectorXd& x, const VectorXd& y) {
  std::vector<Index> order;
  for (Index k = 0; k < x.size(); ++k) {
    if (std::isfinite(x[k]) && std::isfinite(y[k])) order.push_back(k);
  }
  const auto n = static_cast<Index>(order.size());
  if (n < 40) return 0.0;
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return x[a] != x[b] ? x[a] < x[b] : a < b; });
  const Index bins = std::min<Index>(24, n / 20);
  double total = 0.0, sum = 0.0, between = 0.0;
  for (const Index k : order) sum += y[k];
  const double mean = sum / static_cast<double>(n);
  for (const Index k : order) total += (y[k] - mean) * (y[k] - mean);
  Index used = 0;
  for (Index from = 0; from < n;) {
    // equal values stay in one bin: how they were sorted must not matter
    Index to = std::min(n, from + (n + bins - 1) / bins);
    while (to < n &&
           x[order[static_cast<std::size_t>(to)]] == x[order[static_cast<std::size_t>(to - 1)]]) {
      ++to;
    }
    double part = 0.0;
    for (Index i = from; i < to; ++i) part += y[order[static_cast<std::size_t>(i)]] - mean;
    between += part * part / static_cast<double>(to - from);
    ++used;
    from = to;
  }
  if (!(total > 0.0) || used < 2) return 0.0;
  const double within = (total - between) / total;
  return std::clamp(1.0 - within * static_cast<double>(n - 1) / static_cast<double>(n - used), 0.0,
                    1.0);
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

void add_compared_curves(Page& page, const Machine& machine, const CompareResult& result) {
  const std::vector<ComparedQuantity> quantities = compared_quantities(result);
  std::size_t drawn = 0, left_out = 0;
  for (const LogComparison& log : result.logs) {
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      for (const auto& [of, series] : quantities[i].logs) {
        if (of != &log) continue;
        if (drawn == kMostCurveCharts) {
          ++left_out;
          continue;
        }
        ++drawn;
        page.plot(curve_chart(machine, result, quantities[i], log, *series, static_cast<int>(i)));
      }
    }
  }
  if (left_out > 0) {
    page.paragraph(
        fmt::format("{} more charts are left out to keep the page small: compare fewer logs at a "
                    "time to see them.",
                    left_out));
  }
}

void add_residuals(Page& page, const Machine& machine, const CompareResult& result) {
  std::vector<ComparedQuantity> quantities = compared_quantities(result);
  std::stable_partition(quantities.begin(), quantities.end(),
                        [&](const ComparedQuantity& q) { return is_worst(result, q); });
  for (const ComparedQuantity& quantity : quantities) {
    const ResidualTable table = residual_table(machine, quantity);
    std::vector<std::pair<double, const RegimeSignal*>> shares;
    for (const RegimeSignal& signal : table.signals) {
      shares.emplace_back(share_explained(signal.values, table.residual), &signal);
    }
    std::stable_sort(shares.begin(), shares.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    const std::size_t most = is_worst(result, quantity) ? kSignalsOfTheWorst : kSignalsPerQuantity;
    for (std::size_t i = 0; i < std::min(most, shares.size()); ++i) {
      page.plot(scatter(quantity, table, *shares[i].second, shares[i].first));
    }
  }
}

int add_working_area(Page& page, const Machine& machine, const CompareResult& result) {
  constexpr double kFlat = 0.02;  // [m] an area less high or wide is a line
  int added = 0;
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
    map.title = fmt::format("Error in {} by position of the tip", quantity.words);
    map.note = fmt::format("Root mean square; the crane stands where it is largest, {:.3g} {}.",
                           map.values(row, column), quantity.unit.name);
    map.width = FigureWidth::kHalf;
    map.height = 400;
    map.x_axis = {plane.horizontal_name, "m"};
    map.z_axis = {plane.vertical_name, "m"};
    map.value = {"error (RMS)", quantity.unit.name};
    page.plot(std::move(map));
    ++added;
  }
  return added;
}

}  // namespace sparflow
