#include "apps/report/motion_pages/benchmark_page.h"

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

Table compared(const BenchmarkView& view) {
  Table table;
  table.title = "Controllers over all scenarios";
  table.note =
      "Medians over the runs that were done. Energy: the pumps' pressure times their flow into the "
      "valves. Above " +
      view.reference +
      ": median over scenarios of the relative difference, with its 95 % interval by bootstrap "
      "over "
      "scenarios. Predicted: what the model says of the energy-optimal motion in the same time.";
  table.columns = {{"controller"},
                   {"runs", "", 4},
                   {"failed", "", 4},
                   {"mean rank", "", 3},
                   {"energy", "kJ", 4},
                   {"above " + view.reference, "%", 3},
                   {"from", "%", 3},
                   {"to", "%", 3},
                   {"dearer in", "% of scenarios", 3},
                   {"above predicted", "%", 3},
                   {"above bound", "%", 3}};
  for (const BenchmarkedController& c : view.controllers) {
    if (c.name == view.reference) table.highlighted_row = static_cast<int>(table.rows.size());
    table.rows.push_back({c.name, c.runs, c.failed, c.rank, c.energy_kJ, c.above, c.above_lower,
                          c.above_upper, c.dearer, c.above_promise, c.above_bound});
  }
  return table;
}

Table quality(const BenchmarkView& view) {
  Table table;
  table.title = "How well the work was done";
  table.note =
      "Tip error on the way: RMS from the controller's own path, for those that follow one. Sway: "
      "largest angle of the hanging payload while it is held at a goal. Rate of the levers: RMS. "
      "Limits: runs that broke one.";
  table.columns = {
      {"controller"},          {"time", "s", 3},          {"tip error on the way", "mm", 3},
      {"at the end", "mm", 3}, {"sway", "deg", 3},        {"rate of the levers", "1/s", 3},
      {"limits", "", 4},       {"step, median", "ms", 2}, {"step, worst", "ms", 2}};
  for (const BenchmarkedController& c : view.controllers)
    table.rows.push_back({c.name, c.time_s, c.tip_path_mm, c.tip_end_mm, c.sway_deg, c.roughness,
                          c.limits, c.step_median_ms, c.step_worst_ms});
  return table;
}

Table what_they_do(const BenchmarkView& view) {
  Table table;
  table.title = "What each does";
  table.columns = {{"controller"}, {"what it does"}};
  for (const BenchmarkedController& c : view.controllers) table.rows.push_back({c.name, c.words});
  return table;
}

BarChart bars(const BenchmarkView& view) {
  BarChart chart;
  chart.title = "Energy above " + view.reference;
  chart.note = "Median over scenarios, paired; a negative bar takes less.";
  chart.value_axis = {"above " + view.reference, "%"};
  chart.stacked = false;
  std::vector<double> values;
  for (const BenchmarkedController& c : view.controllers) {
    if (c.name == view.reference || !std::isfinite(c.above)) continue;
    chart.categories.push_back(c.name);
    values.push_back(c.above);
  }
  chart.series = {{"median", Eigen::Map<const Eigen::VectorXd>(
                                 values.data(), static_cast<Eigen::Index>(values.size()))}};
  return chart;
}

void add_scatters(Page& page, const BenchmarkView& view) {
  ScatterChart pairs, pareto;
  pairs.title = "Energy against " + view.reference + ", run by run";
  pairs.note = "On the diagonal a controller takes as much, above it more.";
  pairs.x_axis = {view.reference, "kJ"};
  pairs.y_axis = {"this controller", "kJ"};
  pairs.diagonal = true;
  pareto.title = "Energy against time, run by run";
  pareto.note = "Time until the tip is at its goals to stay.";
  pareto.x_axis = {"time", "s"};
  pareto.y_axis = {"energy", "kJ"};
  for (const BenchmarkedController& c : view.controllers) {
    if (c.scenario_energy.size() == 0) continue;
    pareto.groups.push_back({c.name, c.scenario_time, c.scenario_energy});
    if (c.name != view.reference && c.reference_energy.array().isFinite().any())
      pairs.groups.push_back({c.name, c.reference_energy, c.scenario_energy});
  }
  pairs.width = pareto.width = FigureWidth::kHalf;
  if (!pairs.groups.empty()) page.plot(std::move(pairs));
  if (!pareto.groups.empty()) page.plot(std::move(pareto));
}

/// Values of a run at common instants; NaN after its end.
Eigen::VectorXd at_times(const Eigen::VectorXd& t, const Eigen::VectorXd& values,
                         const Eigen::VectorXd& at) {
  Eigen::VectorXd r = Eigen::VectorXd::Constant(at.size(), std::nan(""));
  Eigen::Index i = 0;
  for (Eigen::Index k = 0; k < at.size(); ++k) {
    while (i + 1 < t.size() && t[i + 1] < at[k]) ++i;
    if (i + 1 >= t.size()) break;
    const double share = std::clamp((at[k] - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0);
    r[k] = values[i] + share * (values[i + 1] - values[i]);
  }
  return r;
}

void add_over_time(Page& page, const BenchmarkView& view) {
  double longest = 0.0;
  for (const BenchmarkedRun& r : view.runs)
    if (r.t.size() > 1) longest = std::max(longest, r.t[r.t.size() - 1]);
  if (longest <= 0.0) return;
  constexpr Eigen::Index kSamples = 400;  // as other pages draw
  for (const bool lost : {false, true}) {
    LineChart chart;
    chart.title = lost ? "Turned into heat, over time" : "Power of the pumps over time";
    chart.y_axis = {"power", "kW"};
    chart.group = "run";
    chart.x = Eigen::VectorXd::LinSpaced(kSamples, 0.0, longest);
    for (const BenchmarkedRun& r : view.runs) {
      if (r.t.size() < 2) continue;
      LineSeries line;
      line.name = r.controller;
      line.y = at_times(r.t, lost ? r.loss_kW : r.power_kW, chart.x);
      chart.series.push_back(std::move(line));
    }
    page.plot(std::move(chart));
  }
}

BarChart where_it_went(const BenchmarkView& view) {
  BarChart chart;
  chart.title = "Where the energy went";
  chart.note =
      "The pumps' work: what machine and payload gained in height (a negative bar: they gave it), "
      "and heat by place.";
  chart.value_axis = {"energy", "kJ"};
  for (const BenchmarkedRun& r : view.runs) chart.categories.push_back(r.controller);
  for (std::size_t place = 0; !view.runs.empty() && place < view.runs[0].went.size(); ++place) {
    BarSeries series{view.runs[0].went[place].name,
                     Eigen::VectorXd(static_cast<Eigen::Index>(view.runs.size()))};
    for (std::size_t k = 0; k < view.runs.size(); ++k)
      series.values[static_cast<Eigen::Index>(k)] = view.runs[k].went[place].kJ;
    chart.series.push_back(std::move(series));
  }
  return chart;
}

double came_in(const BenchmarkedRun& run) {
  double sum = 0.0;
  for (const EnergyPlace& p : run.went) sum += std::max(0.0, p.kJ);
  return sum;
}

/// Pumps, and height that was given, on the left; what was gained and heat by place on the right.
SankeyChart sankey(const BenchmarkedRun& run, double scale) {
  SankeyChart chart;
  chart.title = "Where the energy went [kJ]: " + run.controller;
  chart.amount = {"energy", "kJ"};
  chart.width = FigureWidth::kHalf;
  chart.scale = scale;
  const auto node = [&](const std::string& name) {
    const auto at = std::find(chart.nodes.begin(), chart.nodes.end(), name);
    if (at != chart.nodes.end()) return static_cast<int>(at - chart.nodes.begin());
    chart.nodes.push_back(name);
    return static_cast<int>(chart.nodes.size()) - 1;
  };
  double given = 0.0;
  for (const EnergyPlace& p : run.went) given += std::max(0.0, -p.kJ);
  const int pumps = node("pumps"), oil = node("oil");
  chart.flows.push_back({pumps, oil, std::max(0.0, came_in(run) - given)});
  if (given > 0.0) chart.flows.push_back({node("height given"), oil, given});
  std::vector<std::pair<int, double>> groups;
  std::vector<SankeyFlow> places;
  for (const EnergyPlace& p : run.went) {
    const double kJ = std::max(0.0, p.kJ);
    if (p.group.empty()) {
      if (kJ > 0.0) chart.flows.push_back({oil, node(p.name), kJ});
      continue;
    }
    const int group = node(p.group);
    const auto known =
        std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.first == group; });
    if (known == groups.end())
      groups.emplace_back(group, kJ);
    else
      known->second += kJ;
    places.push_back({group, node(p.name), kJ});
  }
  for (const auto& [group, kJ] : groups) chart.flows.push_back({oil, group, kJ});
  chart.flows.insert(chart.flows.end(), places.begin(), places.end());
  return chart;
}

/// All diagrams of a scenario have one scale, so that their bands can be compared.
void add_sankeys(Page& page, const BenchmarkView& view) {
  double most = 0.0;
  for (const BenchmarkedRun& run : view.runs) most = std::max(most, came_in(run));
  for (const BenchmarkedRun& run : view.runs) page.plot(sankey(run, most));
}

void add_cranes(Page& page, const BenchmarkView& view) {
  for (const BenchmarkedRun& r : view.runs) {
    if (r.motion.size() < 2) continue;
    CraneDrawing drawing;
    drawing.title = r.controller;
    const Eigen::VectorXd start = r.motion.q.row(0);
    const DrawingPlane plane = drawing_plane(view.machine, start);
    drawing.x_axis = {plane.horizontal_name, "m"};
    drawing.z_axis = {plane.vertical_name, "m"};
    drawing.frames = drawing_frames(view.machine, r.motion, 90);
    drawing.group = "run";
    drawing.width = FigureWidth::kHalf;
    page.plot(std::move(drawing));
  }
}

}  // namespace

Page benchmark_page(const BenchmarkView& view) {
  Page page("Controllers on the dynamic plant");
  page.subtitle("true energies of a plant that knows no law of the model");
  page.banner(view.banner);
  page.verdict(Tone::kNeutral, view.headline, view.text);
  for (const auto& [name, value] : view.provenance)
    if (!value.empty()) page.provenance(name, value);
  page.section("Comparison");
  page.table(compared(view));
  page.table(quality(view));
  page.table(what_they_do(view));
  BarChart chart = bars(view);
  if (!chart.categories.empty()) page.plot(std::move(chart));
  add_scatters(page, view);
  if (!view.runs.empty()) {
    page.section("Scenario " + view.shown);
    add_cranes(page, view);
    add_over_time(page, view);
    page.plot(where_it_went(view));
    add_sankeys(page, view);
  }
  if (!view.failures.empty()) {
    page.section("Failures");
    Table table;
    table.title = "Runs that were not done";
    table.columns = {{"scenario"}, {"controller"}, {"seed"}, {"reason"}};
    for (const auto& f : view.failures) table.rows.push_back({f[0], f[1], f[2], f[3]});
    page.table(std::move(table));
  }
  return page;
}

}  // namespace sparflow
