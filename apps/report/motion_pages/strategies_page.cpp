#include "apps/report/motion_pages/strategies_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/charts/obstacle_drawing.h"
#include "models/files/model_file.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

std::string row_title(const StrategyRow& row) {
  if (row.name == "own") return "Each in its own best time";
  if (row.factor > 0.0)
    return fmt::format("In {:g} times the shortest time ({:.2f} s)", row.factor, row.duration);
  return fmt::format("In equal time ({:.2f} s)", row.duration);
}

std::string excess_text(double share) { return fmt::format("{:+.1f} %", 100.0 * share); }

/// Draws useful energy, throttling losses and idling, one bar for each strategy.
BarChart energy_bars(const StrategyRow& row, double idle_power, const Machine& machine) {
  BarChart bars;
  bars.title = row_title(row);
  bars.value_axis = {"energy", "kJ"};
  bars.note =
      "Useful: working pressure times flow. Throttled: pump pressure above the working pressure, "
      "times "
      "flow; another cylinder, the margin or standby sets the pump pressure.";
  std::vector<double> useful, idle;
  std::vector<std::vector<double>> lost(machine.cylinders.size());
  for (const StrategyOutcome& o : row.outcomes) {
    if (!o.found()) continue;
    bars.categories.push_back(strategy_title(o.kind));
    double sum = 0.0;
    for (const double x : o.energy.useful) sum += x;
    useful.push_back(sum / 1e3);
    for (std::size_t c = 0; c < lost.size(); ++c)
      lost[c].push_back(c < o.energy.throttling.size() ? o.energy.throttling[c] / 1e3 : 0.0);
    idle.push_back(idle_power * o.duration / 1e3);
  }
  const auto column = [](const std::vector<double>& v) {
    return VectorXd(Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())));
  };
  bars.series = {{"useful", column(useful)}};
  for (std::size_t c = 0; c < lost.size(); ++c) {
    if (machine.cylinders[c].hydraulic())
      bars.series.push_back({"throttled at " + machine.cylinders[c].name, column(lost[c])});
  }
  if (idle_power > 0.0) bars.series.push_back({"engine idling", column(idle)});
  return bars;
}

/// Lists energies, times and pressures of each strategy.
Table row_table(const StrategyRow& row, double idle_power) {
  Table table;
  table.title = row_title(row);
  table.note =
      "Throttling: throttling loss. Potential: energy gained by machine and payload, part of the "
      "useful "
      "energy. Peak, mean: pump pressure.";
  table.columns = {
      {"strategy"},        {"pump energy", "kJ"},  {"duration", "s"},  {"throttling", "kJ", 3},
      {"idling", "kJ", 3}, {"potential", "kJ", 3}, {"peak", "bar", 3}, {"mean", "bar", 3}};
  for (const StrategyOutcome& o : row.outcomes) {
    std::vector<TableCell> cells{strategy_title(o.kind)};
    if (!o.found()) {
      while (cells.size() < table.columns.size()) cells.emplace_back(std::nan(""));
      table.rows.push_back(std::move(cells));
      continue;
    }
    double lost = 0.0, peak = 0.0, mean = 0.0;
    for (const double t : o.energy.throttling) lost += t;
    for (const double p : o.peak_pressure) peak = std::max(peak, p);
    for (const double p : o.mean_pressure) mean = std::max(mean, p);
    for (const double value :
         {o.energy.total / 1e3, o.duration, lost / 1e3, idle_power * o.duration / 1e3,
          o.energy.potential_difference / 1e3, peak / units::kBar, mean / units::kBar})
      cells.emplace_back(value);
    if (o.kind == kOptimal) table.highlighted_row = static_cast<int>(table.rows.size());
    table.rows.push_back(std::move(cells));
  }
  return table;
}

/// Lists how many cylinders move, the shortest time of each strategy, and which start its motion comes from.
Table moving_table(const StrategyRow& row) {
  Table table;
  table.title = "Number of moving cylinders";
  table.columns = {{"strategy"}};
  for (int k = 1; k <= 3; ++k)
    table.columns.push_back({fmt::format("{} move{}", k, k == 1 ? "s" : ""), "% of time", 3});
  table.columns.push_back({"shortest", "s", 4});
  table.columns.push_back({"note"});
  for (const StrategyOutcome& o : row.outcomes) {
    std::vector<TableCell> cells{strategy_title(o.kind)};
    for (std::size_t k = 1; k <= 3; ++k) {
      cells.emplace_back(o.found() && k < o.energy.share_moving.size()
                             ? 100.0 * o.energy.share_moving[k]
                             : std::nan(""));
    }
    cells.emplace_back(o.shortest > 0.0 ? o.shortest : std::nan(""));
    cells.emplace_back(o.found() ? o.detail : o.why);
    if (o.kind == kOptimal) table.highlighted_row = static_cast<int>(table.rows.size());
    table.rows.push_back(std::move(cells));
  }
  return table;
}

/// Draws pump power over time of the sequential, the simultaneous and the optimal motion.
void add_powers(Page& page, const CraneModel& model, const MotionProblem& problem,
                const StrategyRow& row) {
  LineChart chart;
  chart.title = "Pump power over time";
  chart.y_axis = {"power", "kW"};
  constexpr Eigen::Index kSamples = 400;
  chart.x = VectorXd::LinSpaced(kSamples, 0.0, row.duration);
  Chain chain(model);
  VectorXd q, qd;
  for (const char* kind : {kSequential, kJointLine, kOptimal}) {
    const StrategyOutcome* o = row.find(kind);
    if (o == nullptr || !o->found()) continue;
    const Trajectory m = resampled(o->motion, chart.x);
    VectorXd power(kSamples);
    for (Eigen::Index k = 0; k < kSamples; ++k) {
      q = m.q.row(k);
      qd = m.qd.row(k);
      power[k] = chain.evaluate({q.data(), qd.data()}, problem.payload).power / 1e3;
    }
    LineSeries series;
    series.name = strategy_title(kind);
    series.y = power;
    chart.series.push_back(std::move(series));
  }
  if (!chart.series.empty()) page.plot(std::move(chart));
}

void add_paths(Page& page, const Machine& machine, const MotionProblem& problem,
               const StrategyRow& row) {
  const StrategyOutcome* best = row.find(kOptimal);
  if (best == nullptr || !best->found()) return;
  CraneDrawing drawing;
  drawing.title = "Paths of the tip";
  drawing.note =
      "The crane drives the energy-optimal motion. Dashed: paths of the tip in the other motions.";
  const DrawingPlane plane = drawing_plane(machine, problem.start);
  drawing.x_axis = {plane.horizontal_name, "m"};
  drawing.z_axis = {plane.vertical_name, "m"};
  drawing.frames = drawing_frames(machine, best->motion, 90);
  drawing.obstacles = cut_obstacles(problem.obstacles, plane);
  drawing.payload = problem.payload > 0.0;
  for (const StrategyOutcome& o : row.outcomes) {
    if (!o.found() || o.kind == kOptimal) continue;
    DrawingPath path{strategy_title(o.kind), {}};
    for (const DrawingFrame& f : drawing_frames(machine, o.motion, 60))
      path.points.push_back(f.tip);
    drawing.paths.push_back(std::move(path));
  }
  page.plot(std::move(drawing));
}

void add_orders(Page& page, const StrategyComparison& c) {
  if (c.orders.empty()) return;
  Table table;
  table.title = "Sequential motions in every order of the cylinders";
  table.note =
      "A joint that is not named stays at rest. The goal configuration is the cheapest one for "
      "that "
      "order. The segments of the cheapest orders are optimised.";
  table.columns = {{"order"}, {"energy", "kJ"}, {"shortest", "s"}, {"note"}};
  for (const BaselineMotion& m : c.orders) {
    const bool kept = m.why == "kept";
    table.rows.push_back({m.detail, kept ? m.energy.total / 1e3 : std::nan(""),
                          m.shortest > 0.0 ? m.shortest : std::nan(""), kept ? "" : m.why});
  }
  page.table(std::move(table));
}

void add_one(Page& page, const StrategyComparison& c, const CraneModel& model,
             const MotionProblem& problem) {
  for (const StrategyRow& row : c.rows) {
    const double idle = row.duration > 0.0 ? 0.0 : c.idle_power;
    page.section(row_title(row));
    page.plot(energy_bars(row, idle, model.machine));
    page.table(row_table(row, c.idle_power));
    page.table(moving_table(row));
    if (row.name == "equal") {
      add_paths(page, model.machine, problem, row);
      add_powers(page, model, problem, row);
      add_orders(page, c);
    }
  }
}

/// Excess [%], rounded to 1e-4, because two sums of the same motion's energy differ by rounding errors.
double excess_percent(double cost, double best) {
  return std::round(1e6 * (cost / best - 1.0)) / 1e4;
}

/// Draws by how much each strategy exceeds the optimum, problem by problem.
BarChart excess_bars(const std::vector<StrategyComparison>& all, const std::string& name) {
  BarChart bars;
  bars.title = "Energy above the optimum";
  bars.note = "No bar: this strategy has no motion of that duration that keeps the limits.";
  bars.value_axis = {"above the energy-optimal motion", "%"};
  bars.stacked = false;
  const std::vector<std::string> kinds = {kSequential, kJointLine, kTipLine, kBestTipLine};
  std::vector<std::vector<double>> values(kinds.size());
  for (const StrategyComparison& c : all) {
    const StrategyRow* row = c.row(name);
    const StrategyOutcome* best = row != nullptr ? row->find(kOptimal) : nullptr;
    if (best == nullptr || !best->found()) continue;
    const double idle = row->duration > 0.0 ? 0.0 : c.idle_power;
    bars.categories.push_back(c.problem);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const StrategyOutcome* o = row->find(kinds[k]);
      values[k].push_back(o != nullptr && o->found() ? excess_percent(cost_with_idling(*o, idle),
                                                                      cost_with_idling(*best, idle))
                                                     : std::nan(""));
    }
  }
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    bars.series.push_back({strategy_title(kinds[k]),
                           Eigen::Map<const VectorXd>(
                               values[k].data(), static_cast<Eigen::Index>(values[k].size()))});
  }
  return bars;
}

Table summary_table(const std::vector<StrategyComparison>& all, const std::string& name) {
  Table table;
  table.title = "Energy above the other strategy, over all problems";
  table.note =
      "Only problems in which both strategies keep all limits. p: two-sided p-value of Wilcoxon's "
      "signed-rank test for no difference.";
  table.columns = {{"strategy"},
                   {"against"},
                   {"problems", "", 4},
                   {"only this one", "", 4},
                   {"only the other", "", 4},
                   {"median", "%", 3},
                   {"first quartile", "%", 3},
                   {"third quartile", "%", 3},
                   {"worst", "%", 3},
                   {"p", "", 2}};
  const auto add = [&](const PairedSummary& s) {
    table.rows.push_back({strategy_title(s.kind), strategy_title(s.against),
                          static_cast<double>(s.n), static_cast<double>(s.only_kind),
                          static_cast<double>(s.only_against), 100.0 * s.median, 100.0 * s.lower,
                          100.0 * s.upper, 100.0 * s.largest,
                          s.test.n > 0 ? s.test.p_value : std::nan("")});
  };
  for (const std::string& kind : BaselineSet::kinds()) add(paired(all, name, kind, kOptimal));
  add(paired(all, name, kSequential, kJointLine));
  return table;
}

ScatterChart pairs_chart(const std::vector<StrategyComparison>& all, const std::string& name) {
  ScatterChart chart;
  chart.title = "Energy against the optimum, problem by problem";
  chart.note =
      "One point for each problem. On the diagonal a strategy takes as much as the optimum, above "
      "it more.";
  chart.x_axis = {"energy-optimal", "kJ"};
  chart.y_axis = {"this strategy", "kJ"};
  chart.diagonal = true;
  for (const char* kind : {kSequential, kJointLine, kTipLine}) {
    std::vector<double> x, y;
    for (const StrategyComparison& c : all) {
      const StrategyRow* row = c.row(name);
      const StrategyOutcome* best = row != nullptr ? row->find(kOptimal) : nullptr;
      const StrategyOutcome* o = row != nullptr ? row->find(kind) : nullptr;
      if (best == nullptr || !best->found() || o == nullptr || !o->found()) continue;
      const double idle = row->duration > 0.0 ? 0.0 : c.idle_power;
      x.push_back(cost_with_idling(*best, idle) / 1e3);
      y.push_back(cost_with_idling(*o, idle) / 1e3);
    }
    if (x.empty()) continue;
    const auto n = static_cast<Eigen::Index>(x.size());
    chart.groups.push_back({strategy_title(kind), Eigen::Map<const VectorXd>(x.data(), n),
                            Eigen::Map<const VectorXd>(y.data(), n)});
  }
  return chart;
}

void add_set(Page& page, const std::vector<StrategyComparison>& all) {
  for (const std::string& name : row_names(all)) {
    page.section(name == "equal" ? "In equal time"
                 : name == "own" ? "Each in its own best time"
                                 : "In " + name + " time");
    page.table(summary_table(all, name));
    BarChart bars = excess_bars(all, name);
    if (!bars.categories.empty()) page.plot(std::move(bars));
    ScatterChart pairs = pairs_chart(all, name);
    if (!pairs.groups.empty()) page.plot(std::move(pairs));
  }
  page.section("Problem by problem");
  for (const StrategyComparison& c : all) {
    if (!c.message.empty()) page.paragraph(c.problem + ": " + c.message);
    for (const StrategyRow& row : c.rows) {
      Table table = row_table(row, c.idle_power);
      table.title = c.problem + ": " + table.title;
      page.table(std::move(table));
    }
  }
}

void set_verdict(Page& page, const std::vector<StrategyComparison>& all) {
  const std::vector<std::string> names = row_names(all);
  if (names.empty()) {
    page.verdict(Tone::kBad, "No motion was found",
                 all.empty() ? std::string() : all.front().message);
    return;
  }
  const PairedSummary sequential = paired(all, names.front(), kSequential, kOptimal),
                      line = paired(all, names.front(), kJointLine, kOptimal),
                      tip = paired(all, names.front(), kTipLine, kOptimal);
  const auto text = [](const PairedSummary& s, const std::string& what) {
    return s.n > 0 ? fmt::format("{} {}", what, excess_text(s.median)) : what + ": none";
  };
  const std::string where = names.front() == "equal" ? "In equal time"
                            : names.front() == "own" ? "Each in its own best time"
                                                     : "In " + names.front() + " time";
  page.verdict(
      Tone::kNeutral,
      fmt::format("{} against the energy-optimal motion{}: {}, {}, {}", where,
                  all.size() > 1 ? " (medians)" : "", text(sequential, "sequential"),
                  text(line, "simultaneous to the best goal configuration"),
                  text(tip, "tip on a straight line")),
      "Every motion keeps all limits at 16 samples per mesh interval; energies are those of the "
      "exact "
      "law. Which strategy takes least energy depends on the duration and on the idle power, so "
      "every energy is given with its duration.");
}

}  // namespace

Page strategies_page(const std::vector<StrategyComparison>& all, const CraneModel* model,
                     const MotionProblem* problem) {
  Page page(all.size() == 1 ? "Strategies: " + all.front().problem
                            : fmt::format("Strategies over {} problems", all.size()));
  set_verdict(page, all);
  if (any_interrupted(all)) {
    page.banner(
        "Interrupted: strategies or whole problems are missing, and the energies shown could still "
        "fall.");
  }
  if (all.size() == 1 && model != nullptr && problem != nullptr) {
    if (!all.front().message.empty()) page.paragraph(all.front().message);
    add_one(page, all.front(), *model, *problem);
    page.provenance("machine", model->machine.name);
  } else {
    add_set(page, all);
  }
  page.provenance("program", std::string("sparflow ") + program_version());
  return page;
}

}  // namespace sparflow
