#include "apps/report/motion_pages/pareto_page.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "models/files/model_file.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using nlohmann::json;

json number_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

LineSeries named_line(const std::string& name, VectorXd y, LineStyle style = LineStyle::kPlain) {
  LineSeries series;
  series.name = name;
  series.y = std::move(y);
  series.style = style;
  return series;
}

LineChart energy_chart(const ParetoCurve& curve) {
  const auto n = static_cast<Eigen::Index>(curve.points.size());
  LineChart chart;
  chart.title = "Pump energy against time";
  chart.note =
      "Each point is a motion that keeps all limits. Horizontal dashed lines: energy at unlimited "
      "time. Falling dashed lines: equal cost of pump energy and idle power; such a line touches "
      "the "
      "curve at the best duration, which is marked.";
  chart.x_axis = {"duration", "s"};
  chart.y_axis = {"pump energy", "kJ"};
  chart.x.resize(n);
  VectorXd best(n), sequential(n), simultaneous(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParetoPoint& p = curve.points[static_cast<std::size_t>(i)];
    chart.x[i] = p.duration;
    best[i] = p.optimal.energy.total / 1e3;
    sequential[i] = p.sequential / 1e3;
    simultaneous[i] = p.simultaneous / 1e3;
  }
  chart.series.push_back(named_line("energy-optimal", best));
  chart.series.push_back(named_line("sequential", sequential));
  chart.series.push_back(named_line("simultaneous, best goal configuration", simultaneous));
  if (std::isfinite(curve.sequential_limit)) {
    chart.series.push_back(named_line("sequential, unlimited time",
                                      VectorXd::Constant(n, curve.sequential_limit / 1e3),
                                      LineStyle::kLimit));
  }
  if (std::isfinite(curve.grid_limit)) {
    chart.series.push_back(named_line("cheapest path of a joint grid, unlimited time",
                                      VectorXd::Constant(n, curve.grid_limit / 1e3),
                                      LineStyle::kLimit));
  }
  // Energy + idle power x duration is constant along such a line; it touches the curve at the best duration.
  for (const IdleChoice& c : curve.idle) {
    if (c.at_end) continue;
    VectorXd iso(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      iso[i] = (c.energy + c.idle_power * (c.duration - chart.x[i])) / 1e3;
      if (iso[i] < 0.9 * best.minCoeff() || iso[i] > best.maxCoeff()) iso[i] = std::nan("");
    }
    chart.series.push_back(named_line(fmt::format("equal cost at {:g} kW", c.idle_power / 1e3), iso,
                                      LineStyle::kLimit));
  }
  for (const IdleChoice& c : curve.idle) {
    if (!c.at_end)
      chart.markers.push_back({c.duration, fmt::format("{:g} kW", c.idle_power / 1e3)});
  }
  return chart;
}

LineChart moving_chart(const ParetoCurve& curve) {
  const auto n = static_cast<Eigen::Index>(curve.points.size());
  LineChart chart;
  chart.title = "Number of moving cylinders in the optimum";
  chart.note = "Share of the duration in which this number of cylinders moves.";
  chart.x_axis = {"duration", "s"};
  chart.y_axis = {"share of time", "%"};
  chart.x.resize(n);
  const std::size_t counts = curve.points.front().optimal.energy.share_moving.size();
  std::vector<VectorXd> share(counts, VectorXd::Zero(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParetoPoint& p = curve.points[static_cast<std::size_t>(i)];
    chart.x[i] = p.duration;
    for (std::size_t k = 0; k < counts; ++k) share[k][i] = 100.0 * p.optimal.energy.share_moving[k];
  }
  for (std::size_t k = 0; k < counts; ++k) {
    chart.series.push_back(named_line(
        k == 0 ? "none moves" : fmt::format("{} move{}", k, k == 1 ? "s" : ""), share[k]));
  }
  return chart;
}

}  // namespace

Page pareto_page(const CraneModel& model, const MotionProblem& problem, const ParetoCurve& curve) {
  Page page("Energy against time: " + problem.name);
  if (curve.interrupted) {
    page.banner("Interrupted: durations are missing, and the energies shown could still fall.");
  }
  if (curve.points.empty()) {
    page.verdict(Tone::kBad, "No motion was found", curve.message);
    return page;
  }
  const ParetoPoint &first = curve.points.front(), &last = curve.points.back();
  page.verdict(Tone::kNeutral,
               fmt::format("From {:.1f} kJ in {:.2f} s to {:.1f} kJ in {:.1f} s",
                           first.optimal.energy.total / 1e3, first.duration,
                           last.optimal.energy.total / 1e3, last.duration),
               std::isfinite(curve.sequential_limit)
                   ? fmt::format("At unlimited time the sequential motion takes {:.1f} kJ.",
                                 curve.sequential_limit / 1e3)
                   : "No sequential motion keeps the limits.");
  page.plot(energy_chart(curve));
  page.plot(moving_chart(curve));
  Table idle;
  idle.title = "Best duration for each idle power";
  idle.columns = {{"idle power", "kW"},
                  {"duration", "s"},
                  {"pump energy", "kJ"},
                  {"with idling", "kJ"},
                  {"note"}};
  for (const IdleChoice& c : curve.idle) {
    idle.rows.push_back({c.idle_power / 1e3, c.duration, c.energy / 1e3,
                         (c.energy + c.idle_power * c.duration) / 1e3,
                         c.at_end ? "the longest duration searched" : ""});
  }
  page.table(std::move(idle));
  Table points;
  points.title = "Points";
  points.columns = {
      {"duration", "s"}, {"optimal", "kJ"}, {"sequential", "kJ"}, {"simultaneous", "kJ"}, {"from"}};
  for (const ParetoPoint& p : curve.points) {
    points.rows.push_back({p.duration, p.optimal.energy.total / 1e3, p.sequential / 1e3,
                           p.simultaneous / 1e3, p.optimal.detail});
  }
  page.table(std::move(points));
  page.provenance("program", std::string("sparflow ") + program_version());
  page.provenance("machine", model.machine.name);
  return page;
}

std::string pareto_json(const MotionProblem& problem, const ParetoCurve& curve) {
  json points = json::array();
  for (const ParetoPoint& p : curve.points) {
    points.push_back({{"duration_s", p.duration},
                      {"energy_J", p.optimal.energy.total},
                      {"sequential_J", number_or_null(p.sequential)},
                      {"simultaneous_J", number_or_null(p.simultaneous)},
                      {"potential_J", p.optimal.energy.potential_difference},
                      {"share_moving", p.optimal.energy.share_moving},
                      {"from", p.optimal.detail}});
  }
  json idle = json::array();
  for (const IdleChoice& c : curve.idle) {
    idle.push_back({{"idle_power_W", c.idle_power},
                    {"duration_s", c.duration},
                    {"energy_J", c.energy},
                    {"at_end", c.at_end}});
  }
  json out = {{"name", problem.name},
              {"status", curve.interrupted      ? "interrupted"
                         : curve.points.empty() ? "infeasible"
                                                : "optimal"},
              {"interrupted", curve.interrupted},
              {"points", points},
              {"idle", idle},
              {"shortest_s", nullptr},
              {"unlimited_time",
               {{"sequential_J", number_or_null(curve.sequential_limit)},
                {"simultaneous_J", number_or_null(curve.simultaneous_limit)},
                {"grid_J", number_or_null(curve.grid_limit)}}}};
  if (curve.shortest > 0.0) out["shortest_s"] = curve.shortest;
  if (!curve.message.empty()) out["message"] = curve.message;
  return out.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string pareto_csv(const ParetoCurve& curve) {
  std::string text = "duration_s,energy_J,sequential_J,simultaneous_J";
  const std::size_t counts =
      curve.points.empty() ? 0 : curve.points.front().optimal.energy.share_moving.size();
  for (std::size_t k = 0; k < counts; ++k) text += fmt::format(",share_moving_{}", k);
  text += "\n";
  const auto cell = [](double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : ""; };
  for (const ParetoPoint& p : curve.points) {
    text += fmt::format("{:.6g},{:.7g},{},{}", p.duration, p.optimal.energy.total,
                        cell(p.sequential), cell(p.simultaneous));
    for (const double s : p.optimal.energy.share_moving) text += fmt::format(",{:.4f}", s);
    text += "\n";
  }
  return text;
}

std::string pareto_table(const MotionProblem& problem, const ParetoCurve& curve) {
  std::string text = problem.name + "\n";
  if (curve.points.empty()) return text + "  " + curve.message + "\n";
  text += fmt::format("  {:>8} {:>10} {:>12} {:>14}   cylinders moving, share of time\n", "s",
                      "optimal kJ", "sequential", "simultaneous");
  const auto cell = [](double v) {
    return std::isfinite(v) ? fmt::format("{:.2f}", v / 1e3) : std::string("-");
  };
  for (const ParetoPoint& p : curve.points) {
    text += fmt::format("  {:8.2f} {:10.2f} {:>12} {:>14}  ", p.duration,
                        p.optimal.energy.total / 1e3, cell(p.sequential), cell(p.simultaneous));
    for (std::size_t k = 0; k < p.optimal.energy.share_moving.size(); ++k)
      text += fmt::format(" {}: {:.0f} %", k, 100.0 * p.optimal.energy.share_moving[k]);
    text += "\n";
  }
  text += fmt::format("  unlimited time: sequential {} kJ, cheapest path of a joint grid {} kJ\n",
                      cell(curve.sequential_limit), cell(curve.grid_limit));
  for (const IdleChoice& c : curve.idle) {
    text += fmt::format("  idle power {:4.1f} kW: best duration {:.2f} s{}\n", c.idle_power / 1e3,
                        c.duration, c.at_end ? " (the longest searched)" : "");
  }
  return text;
}

}  // namespace sparflow
