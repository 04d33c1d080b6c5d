// Residuals against the signals that explain most of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/report/model_pages/compare_charts.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr std::size_t kCharts = 2, kChartsOfTheFirst = 6;
constexpr double kLeastDrawnShare =
    0.01;  // [-] of the variance that a signal must explain to be drawn

/// Residuals of a quantity over all logs, one row for each compared sample, with all signals that any log has.
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
  return regime == "standby" || regime == "constant" ? regime : "leader " + regime;
}

/// A pump's regimes have the colours of their leaders. Of a cylinder, extending has its colour and retracting a dark one.
int regime_color(const Machine& machine, const ComparedQuantity& quantity,
                 const std::string& regime) {
  constexpr int kDark = 7;
  if (quantity.stage != "pump")
    return regime == "retract" ? kDark : place_color(machine, quantity.stage, quantity.at);
  if (regime == "constant") return place_color(machine, "pump", quantity.at);
  const int leader = machine.cylinder_index(regime);
  return leader >= 0 ? leader : kDark;
}

ScatterChart scatter(const Machine& machine, const ComparedQuantity& quantity,
                     const ResidualTable& table, const RegimeSignal& signal, double share) {
  ScatterChart chart;
  chart.title = capitalised(fmt::format("{} against {}", quantity.words, signal.words));
  chart.note = fmt::format("Explains {:.0f} % of the error's variance.", 100.0 * share);
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {signal.words, signal.unit};
  chart.y_axis = {kErrorAxis, quantity.unit.name};
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
                            Eigen::Map<VectorXd>(x.data(), n), Eigen::Map<VectorXd>(y.data(), n),
                            regime_color(machine, quantity, table.names[r])});
  }
  return chart;
}

/// Chooses the signals to draw. Two thirds of the charts are for signals with a known meaning (posture, speed, load),
/// since other columns often are a second sensor of the measured quantity and explain nothing physical.
std::vector<std::pair<double, const RegimeSignal*>> chosen(const ComparedQuantity& quantity,
                                                           const ResidualTable& table,
                                                           std::size_t most) {
  const auto has_meaning = [&](const RegimeSignal& signal) {
    for (const auto& [log, series] : quantity.logs) {
      for (const CandidateSignal& c : log->signals.candidates) {
        if (c.name == signal.words) return false;
      }
    }
    return true;
  };
  const auto better = [](const auto& a, const auto& b) { return a.first > b.first; };
  std::vector<std::pair<double, const RegimeSignal*>> known, rest, out;
  for (const RegimeSignal& signal : table.signals) {
    (has_meaning(signal) ? known : rest)
        .emplace_back(share_explained(signal.values, table.residual), &signal);
  }
  std::stable_sort(known.begin(), known.end(), better);
  const std::size_t sure = std::min(known.size(), std::max<std::size_t>(1, most * 2 / 3));
  out.assign(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(sure));
  rest.insert(rest.end(), known.begin() + static_cast<std::ptrdiff_t>(sure), known.end());
  std::stable_sort(rest.begin(), rest.end(), better);
  rest.resize(std::min(rest.size(), most - std::min(most, out.size())));
  out.insert(out.end(), rest.begin(), rest.end());
  const auto explains_little = [](const auto& signal) { return signal.first < kLeastDrawnShare; };
  out.erase(std::remove_if(out.begin() + (out.empty() ? 0 : 1), out.end(), explains_little),
            out.end());
  return out;
}

}  // namespace

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
    // Equal values stay in one bin, so that the result does not depend on their order.
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

void add_residuals(Page& page, const Machine& machine, const CompareResult& result,
                   const std::string& stage, const std::string& at) {
  const auto is_first = [&](const ComparedQuantity& q) { return q.stage == stage && q.at == at; };
  std::vector<ComparedQuantity> quantities = compared_quantities(result);
  std::stable_partition(quantities.begin(), quantities.end(), is_first);
  for (const ComparedQuantity& quantity : quantities) {
    const ResidualTable table = residual_table(machine, quantity);
    for (const auto& [share, signal] :
         chosen(quantity, table, is_first(quantity) ? kChartsOfTheFirst : kCharts)) {
      page.plot(scatter(machine, quantity, table, *signal, share));
    }
  }
}

}  // namespace sparflow
