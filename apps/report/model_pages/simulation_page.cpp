#include "apps/report/model_pages/simulation_page.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

/// One chart for each title, in the order of their first channel.
std::vector<LineChart> simulation_charts(const SimulationView& view) {
  std::vector<LineChart> charts;
  for (const SimulatedChannel& c : view.channels) {
    const std::string title = c.part + ": " + c.chart;
    auto chart = std::find_if(charts.begin(), charts.end(),
                              [&](const LineChart& known) { return known.title == title; });
    if (chart == charts.end()) {
      LineChart next;
      next.title = title;
      next.group = "time";
      next.x = view.t;
      next.y_axis = {"", c.unit};
      next.width = FigureWidth::kHalf;
      charts.push_back(std::move(next));
      chart = charts.end() - 1;
    }
    const int color = static_cast<int>(
        std::count_if(chart->series.begin(), chart->series.end(),
                      [](const LineSeries& s) { return s.style != LineStyle::kMeasured; }));
    LineSeries line;
    line.color = color;
    if (c.recorded.size() > 0) {
      line.name = c.name + ", recorded";
      line.y = c.recorded;
      line.style = LineStyle::kMeasured;
      chart->series.push_back(line);
    }
    line.name = c.name;
    line.y = c.simulated;
    line.style = c.recorded.size() > 0 ? LineStyle::kPredicted : LineStyle::kPlain;
    chart->series.push_back(line);
  }
  return charts;
}

}  // namespace

RecordingError recording_error(const SimulatedChannel& channel) {
  RecordingError e{std::numeric_limits<double>::quiet_NaN(),
                   std::numeric_limits<double>::quiet_NaN()};
  if (channel.recorded.size() == 0) return e;
  const auto both = channel.recorded.array().isFinite() && channel.simulated.array().isFinite();
  const auto n = static_cast<double>(both.count());
  if (n < 2.0) return e;
  const auto sum = [&](const Eigen::ArrayXd& values) { return both.select(values, 0.0).sum(); };
  const double mean = sum(channel.recorded.array()) / n;
  e.rmse = std::sqrt(sum((channel.simulated - channel.recorded).array().square()) / n);
  e.spread = std::sqrt(sum((channel.recorded.array() - mean).square()) / n);
  return e;
}

Page simulation_page(const SimulationView& view) {
  Page page("Simulated: " + view.machine);
  page.subtitle("measurements of the dynamic plant, true values without sensors");
  page.verdict(Tone::kNeutral, view.headline, view.text);
  for (const auto& [name, value] : view.provenance)
    if (!value.empty()) page.provenance(name, value);
  Table errors;
  errors.title = "Simulated less recorded";
  errors.columns = {
      {"channel"}, {"unit"}, {"RMS error", "", 3}, {"spread of the recording", "", 3}};
  for (const SimulatedChannel& c : view.channels) {
    const RecordingError e = recording_error(c);
    if (std::isfinite(e.rmse) && c.name != "command")
      errors.rows.push_back({c.label(), c.unit, e.rmse, e.spread});
  }
  if (!errors.rows.empty()) {
    page.section("Against the recording");
    errors.note =
        "Spread: standard deviation of the recording, which an error has to be seen beside.";
    page.table(errors);
  }
  page.section("Over time");
  for (LineChart& chart : simulation_charts(view)) page.plot(std::move(chart));
  if (!view.losses_kJ.empty()) {
    page.section("Where the energy went");
    Table balance;
    balance.title = "Energy balance";
    balance.columns = {{"part"}, {"energy", "kJ", 4}};
    for (const auto& [name, value] : view.balance_kJ) balance.rows.push_back({name, value});
    balance.note =
        "The pumps' work is the ideal work on their oil. A payload that is taken brings its "
        "height's energy, and takes "
        "it along where it is put down.";
    page.table(balance);
    BarChart bars;
    bars.title = "Turned into heat, by part";
    bars.value_axis = {"energy", "kJ"};
    BarSeries series{"energy", Eigen::VectorXd(static_cast<Eigen::Index>(view.losses_kJ.size()))};
    for (std::size_t i = 0; i < view.losses_kJ.size(); ++i) {
      bars.categories.push_back(view.losses_kJ[i].first);
      series.values[static_cast<Eigen::Index>(i)] = view.losses_kJ[i].second;
    }
    bars.series.push_back(series);
    page.plot(std::move(bars));
  }
  return page;
}

}  // namespace sparflow
