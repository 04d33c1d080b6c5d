#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/model_pages/compare_causes.h"
#include "apps/report/model_pages/compare_charts.h"
#include "apps/report/model_pages/compare_page.h"
#include "models/files/model_file.h"
#include "models/math/nan.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using units::kBar;
using units::kLitrePerMinute;

const std::string& cylinder_name(const FitResult& r, int cylinder) {
  return r.model.machine.cylinders[static_cast<std::size_t>(cylinder)].name;
}

std::string direction(bool extend) { return extend ? "extending" : "retracting"; }

const GaussianProcess& process_of(const FitResult& r, const ProcessFit& f) {
  const CylinderModel& c = r.model.cylinders[static_cast<std::size_t>(f.cylinder)];
  return f.extend ? c.extend : c.retract;
}

void add_processes(Page& page, const FitResult& r) {
  if (r.processes.empty()) {
    page.paragraph("The machine has no hydraulic cylinder, so there is no pressure to learn.");
    return;
  }
  Table table;
  table.title = "Pressure models: working pressure over flow and force";
  table.columns = {
      {"cylinder"}, {"direction"},      {"samples"},         {"used"},          {"outliers"},
      {"centres"},  {"RMSE", "bar", 3}, {"noise", "bar", 3}, {"flow", "l/min"}, {"load", "kN"},
      {"law"}};
  for (const ProcessFit& f : r.processes) {
    const GaussianProcess& g = process_of(r, f);
    if (g.empty()) {
      table.rows.push_back({cylinder_name(r, f.cylinder), direction(f.extend),
                            static_cast<double>(f.offered), 0.0, kNaN, kNaN, kNaN, kNaN,
                            std::string("\u2014"), std::string("\u2014"), "not learned"});
      continue;
    }
    const GpParameters& p = g.parameters();
    table.rows.push_back(
        {cylinder_name(r, f.cylinder), direction(f.extend), static_cast<double>(f.offered),
         static_cast<double>(f.report.used), static_cast<double>(f.report.outliers),
         static_cast<double>(f.report.centres), f.report.rmse / kBar, f.report.noise_std / kBar,
         fmt::format("{:.1f} to {:.1f}", p.flow_min / kLitrePerMinute,
                     p.flow_max / kLitrePerMinute),
         fmt::format("{:.1f} to {:.1f}", p.force_min / 1e3, p.force_max / 1e3),
         std::string(pressure_law_name(p.law))});
  }
  table.note =
      "RMSE: of the samples used. Noise: learned standard deviation of one measurement. Samples "
      "are "
      "thinned where neighbours carry the same information. Flow and load: the range of the data, "
      "beyond which a model extrapolates.";
  page.table(std::move(table));
}

void add_supplies(Page& page, const FitResult& r) {
  const Machine& machine = r.model.machine;
  Table table;
  table.title = "Pumps: standby and margins";
  table.columns = {
      {"pump"}, {"term"}, {"pressure", "bar", 3}, {"\u00B1", "bar", 2}, {"samples as leader"},
      {""}};
  for (std::size_t p = 0; p < r.pumps.size(); ++p) {
    if (!r.pumps[p]) continue;
    const Pump& pump = machine.pumps[p];
    const bool sensing = pump.type == PumpType::kLoadSensing;
    table.rows.push_back({pump.name, std::string(sensing ? "standby" : "constant pressure"),
                          r.model.pumps[p].standby / kBar, kNaN,
                          static_cast<double>(r.pumps[p]->standby_leading),
                          std::string(!sensing || r.pumps[p]->standby_identified
                                          ? "learned"
                                          : "not in the logs: from the machine file")});
    for (std::size_t f = 0; f < pump.feeds.size() && f < r.pumps[p]->margins.size(); ++f) {
      const LearnedMargin& m = r.pumps[p]->margins[f];
      table.rows.push_back({pump.name, "margin of " + cylinder_name(r, pump.feeds[f]),
                            m.margin / kBar, m.identified ? m.standard_error / kBar : kNaN,
                            static_cast<double>(m.leading),
                            std::string(m.identified ? "learned" : "assumed: leader too rarely")});
    }
  }
  table.note =
      "The pump pressure is the largest of the standby and, for each moving cylinder, working "
      "pressure "
      "plus margin. The cylinder that sets it is the load-sensing leader.";
  if (!table.rows.empty()) page.table(std::move(table));
}

void add_valves(Page& page, const FitResult& r) {
  if (r.valves.empty()) return;
  Table table;
  table.title = "Valve gains: flow against command";
  table.columns = {{"cylinder"},
                   {"direction"},
                   {"gain", "l/min", 4},
                   {"\u00B1", "l/min", 2},
                   {"R\u00B2", "", 3},
                   {"RMSE", "l/min", 3},
                   {"largest command", "%", 3},
                   {"samples"},
                   {"dead band", "%", 2}};
  for (const ValveFit& v : r.valves) {
    table.rows.push_back(
        {cylinder_name(r, v.cylinder), direction(v.extend), v.valve.gain / kLitrePerMinute,
         v.valve.gain_standard_error / kLitrePerMinute, v.valve.r2, v.valve.rmse / kLitrePerMinute,
         100.0 * v.valve.command_max, static_cast<double>(v.valve.used),
         v.valve.affine ? std::round(1000.0 * v.valve.dead_band) / 10.0 : kNaN});
  }
  table.note =
      "Gain: flow at full command, by a line through zero. Largest command: of the samples used. "
      "Dead "
      "band: estimate by a line with an offset, for information only.";
  page.table(std::move(table));
}

/// Draws pressure over flow at five loads, a little beyond the data; where there are no data it is shaded.
LineChart pressure_chart(const FitResult& r, const ProcessFit& f) {
  const GaussianProcess& g = process_of(r, f);
  const GpParameters& p = g.parameters();
  LineChart chart;
  chart.title =
      fmt::format("Working pressure of {} {}", cylinder_name(r, f.cylinder), direction(f.extend));
  chart.width = FigureWidth::kHalf;
  chart.x_axis = {"flow", "l/min"};
  chart.y_axis = {"pressure", "bar"};
  constexpr Index kPoints = 61;
  const double beyond = 0.15 * (p.flow_max - p.flow_min);
  const double from = std::max(0.0, p.flow_min - beyond), to = p.flow_max + beyond;
  chart.x = VectorXd::LinSpaced(kPoints, from / kLitrePerMinute, to / kLitrePerMinute);
  const bool one_load = p.force_max - p.force_min < 1e-6 * std::max(1.0, std::abs(p.force_max));
  const int loads = one_load ? 1 : 5;
  for (int i = 0; i < loads; ++i) {
    const double share = loads == 1 ? 0.5 : static_cast<double>(i) / (loads - 1);
    const double force = p.force_min + share * (p.force_max - p.force_min);
    LineSeries curve;
    curve.name = fmt::format("{:.3g} kN", force / 1e3);
    curve.y.resize(kPoints);
    VectorXd deviation(kPoints);
    for (Index k = 0; k < kPoints; ++k) {
      const double flow = chart.x[k] * kLitrePerMinute;
      curve.y[k] = g.mean(flow, force) / kBar;
      deviation[k] = std::sqrt(std::max(0.0, g.variance(flow, force))) / kBar;
    }
    curve.band_lower = curve.y - 2.0 * deviation;
    curve.band_upper = curve.y + 2.0 * deviation;
    curve.color = i;
    chart.series.push_back(std::move(curve));
  }
  const double lo = p.flow_min / kLitrePerMinute, hi = p.flow_max / kLitrePerMinute;
  if (lo > chart.x[0]) chart.spans.push_back({chart.x[0], lo, ""});
  chart.spans.push_back({hi, chart.x[kPoints - 1], "no data"});
  return chart;
}

void add_pressures(Page& page, const FitResult& r, const std::string& heading) {
  if (std::all_of(r.processes.begin(), r.processes.end(),
                  [&](const ProcessFit& f) { return process_of(r, f).empty(); })) {
    return;
  }
  page.section(heading);
  page.paragraph(
      "Working pressure over flow at five loads across the range of the data. The band is \u00B12 "
      "standard deviations of the curve, without measurement noise. Where it widens, the logs have "
      "no such load at that flow.");
  for (const ProcessFit& f : r.processes) {
    if (!process_of(r, f).empty()) page.plot(pressure_chart(r, f));
  }
}

/// The comparison that judges the model: on data that took no part in learning, where there are such.
const CompareResult& judged_on(const FitResult& r) {
  return r.test ? *r.test : r.held_out ? *r.held_out : r.train;
}

void set_verdict(Page& page, const FitResult& r) {
  const auto learned =
      std::count_if(r.processes.begin(), r.processes.end(),
                    [&](const ProcessFit& f) { return !process_of(r, f).empty(); });
  const auto all = static_cast<std::ptrdiff_t>(r.processes.size());
  std::string headline = fmt::format("All {} pressure models were identified", all);
  Tone tone = Tone::kGood;
  if (learned < all) {
    headline = fmt::format("{} of {} pressure models were identified", learned, all);
    tone = learned == 0 ? Tone::kBad : Tone::kWarning;
  }
  if (all == 0) headline = "The machine has no hydraulics: only forces are compared";
  std::string text = r.brief(false) + ".";
  const ErrorRanking& ranking = judged_on(r).ranking;
  if (ranking.grade() != Grade::kGood) {
    tone = std::max(tone, tone_of(ranking.grade()));
    headline += ". " + ranking.headline;
  }
  if (learned < all) {
    std::string names;
    for (const std::string& n : r.model.missing()) names += (names.empty() ? "" : ", ") + n;
    text += " Missing: " + names + "; the notes name the motions to record.";
  }
  if (!r.train.bad_data.empty()) {
    tone = std::max(tone, Tone::kWarning);
    std::string names;
    for (const BadChannelOfLog& b : r.train.bad_data)
      names += fmt::format("{}{} of {}", names.empty() ? "" : ", ", b.bad.channel, b.file);
    text += " Faulty stretches took no part: " + names + ".";
  }
  page.verdict(all == 0 ? Tone::kNeutral : tone, headline, text);
}

}  // namespace

void add_fit(Page& page, const FitResult& result) {
  page.section("Identified model");
  add_processes(page, result);
  add_supplies(page, result);
  add_valves(page, result);
  if (&judged_on(result) != &result.train) add_bad_data(page, result.train);
  for (const std::string& note : result.notes) page.paragraph(note);
  add_pressures(page, result, "Identified pressures");
}

Page fit_page(const FitResult& result) {
  Page page("Model of " + result.model.machine.name);
  page.subtitle(fmt::format("learned from {} samples in {} log{}", result.train.samples,
                            result.train.logs.size(), result.train.logs.size() == 1 ? "" : "s"));
  set_verdict(page, result);
  add_fit(page, result);
  add_comparison(page, result.model, judged_on(result),
                 result.test       ? "Test logs: "
                 : result.held_out ? "Held-out motions: "
                                   : "Training logs: ");
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", result.model.machine.name);
  for (const DataSource& d : result.model.data) {
    page.provenance(d.use + " log",
                    fmt::format("{}, {} rows, sha256 {}", d.file, d.rows, d.sha256.substr(0, 16)));
  }
  return page;
}

}  // namespace sparflow
