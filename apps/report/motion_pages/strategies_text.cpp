/// The texts of strategies: a table for the terminal, JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/motion_pages/strategies_page.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using nlohmann::json;

json by_name(const std::vector<double>& values, const std::vector<std::string>& names,
             double unit) {
  json out = json::object();
  for (std::size_t i = 0; i < std::min(values.size(), names.size()); ++i)
    out[names[i]] = values[i] / unit;
  return out;
}

json outcome_json(const StrategyOutcome& o, double idle_power, const Machine& machine) {
  std::vector<std::string> cylinders, pumps;
  for (const Cylinder& c : machine.cylinders) cylinders.push_back(c.name);
  for (const Pump& p : machine.pumps) pumps.push_back(p.name);
  json out = {{"feasible", o.found()}, {"duration_s", o.duration}, {"shortest_s", nullptr}};
  if (o.shortest > 0.0) out["shortest_s"] = o.shortest;
  if (!o.found()) {
    out["energy_J"] = nullptr;
    out["throttling_J"] = json::object();
    out["why"] = o.why;
    return out;
  }
  out["energy_J"] = o.energy.total;
  out["throttling_J"] = by_name(o.energy.throttling, cylinders, 1.0);
  out["useful_J"] = by_name(o.energy.useful, cylinders, 1.0);
  out["potential_J"] = o.energy.potential_difference;
  out["idle_J"] = idle_power * o.duration;
  out["pump_pressure_peak_bar"] = by_name(o.peak_pressure, pumps, units::kBar);
  out["pump_pressure_mean_bar"] = by_name(o.mean_pressure, pumps, units::kBar);
  out["share_moving"] = o.energy.share_moving;
  if (o.kind == kSequential) {
    out["order"] = o.detail;
  } else if (!o.detail.empty()) {
    out["from"] = o.detail;
  }
  return out;
}

json row_json(const StrategyRow& row, double idle_power, const Machine& machine) {
  json out = json::object();
  for (const StrategyOutcome& o : row.outcomes) out[o.kind] = outcome_json(o, idle_power, machine);
  return out;
}

json finite(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json paired_json(const PairedSummary& s) {
  return {{"n", s.n},
          {"only_this", s.only_kind},
          {"only_other", s.only_against},
          {"cheaper", s.cheaper},
          {"dearer", s.dearer},
          {"median_excess_percent", finite(100.0 * s.median)},
          {"lower_quartile_percent", finite(100.0 * s.lower)},
          {"upper_quartile_percent", finite(100.0 * s.upper)},
          {"least_percent", finite(100.0 * s.least)},
          {"largest_percent", finite(100.0 * s.largest)},
          {"wilcoxon_p", s.test.p_value},
          {"wilcoxon_n", s.test.n},
          {"wilcoxon_exact", s.test.exact}};
}

json summary_json(const std::vector<StrategyComparison>& all) {
  json out = {{"problems", all.size()}};
  int solved = 0;
  for (const StrategyComparison& c : all) solved += c.message.empty() ? 1 : 0;
  out["solved"] = solved;
  for (const std::string& name : row_names(all)) {
    json row = json::object();
    for (const std::string& kind : BaselineSet::kinds())
      row[kind] = paired_json(paired(all, name, kind, kOptimal));
    row["sequential_against_simultaneous"] =
        paired_json(paired(all, name, kSequential, kJointLine));
    out[name] = std::move(row);
  }
  return out;
}

}  // namespace

bool any_interrupted(const std::vector<StrategyComparison>& all) {
  return std::any_of(all.begin(), all.end(),
                     [](const StrategyComparison& c) { return c.interrupted; });
}

std::string strategies_json(const std::vector<StrategyComparison>& all,
                            const std::vector<Machine>& machines) {
  json problems = json::array();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const StrategyComparison& c = all[i];
    json p = {{"name", c.problem},
              {"file", c.file},
              {"payload_kg", c.payload},
              {"idle_power_W", c.idle_power},
              {"solve_s", c.solve_s},
              {"shortest_s", nullptr},
              {"strategies", json::object()},
              {"interrupted", c.interrupted}};
    if (c.shortest > 0.0) {
      p["shortest_s"] = c.shortest;
      p["shortest_of"] = c.shortest_of;
    }
    if (!c.message.empty()) p["message"] = c.message;
    for (const StrategyRow& row : c.rows) {
      json r = row_json(row, c.idle_power, machines[i]);
      if (row.name == "own") {
        p["own_time"] = std::move(r);
      } else if (row.factor > 0.0) {
        p["factors"].push_back(
            {{"factor", row.factor}, {"duration_s", row.duration}, {"strategies", std::move(r)}});
      } else {
        p["strategies"] = std::move(r);
      }
    }
    // With own times only, these also stand under the key that docs/strategies.md promises.
    if (p["strategies"].empty() && p.contains("own_time")) p["strategies"] = p["own_time"];
    json orders = json::array();
    for (const BaselineMotion& m : c.orders) {
      json order = {{"order", m.detail}, {"shortest_s", m.shortest}, {"energy_J", nullptr}};
      if (m.why == "kept") {
        order["energy_J"] = m.energy.total;
      } else {
        order["why"] = m.why;
      }
      orders.push_back(std::move(order));
    }
    p["orders"] = std::move(orders);
    problems.push_back(std::move(p));
  }
  return json({{"problems", problems},
               {"summary", summary_json(all)},
               {"interrupted", any_interrupted(all)}})
             .dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

std::string strategies_table(const std::vector<StrategyComparison>& all) {
  std::string text;
  for (const StrategyComparison& c : all) {
    text += fmt::format("{}\n", c.problem);
    if (!c.message.empty()) text += fmt::format("  {}\n", c.message);
    for (const StrategyRow& row : c.rows) {
      const StrategyOutcome* best = row.find(kOptimal);
      const bool own = row.duration <= 0.0;
      text +=
          own ? fmt::format("  each in its own best time, idling at {:g} kW\n", c.idle_power / 1e3)
              : fmt::format("  {} time, {:.2f} s\n", row.factor > 0.0 ? row.name : "equal",
                            row.duration);
      text += fmt::format("    {:34} {:>8} {:>8} {:>9} {:>8} {:>8}\n", "", "kJ", "s",
                          own ? "with idle" : "optimum +", "throttled", "bar peak");
      for (const StrategyOutcome& o : row.outcomes) {
        if (!o.found()) {
          text += fmt::format("    {:34} {}\n", strategy_title(o.kind), o.why);
          continue;
        }
        double valves = 0.0, peak = 0.0;
        for (const double t : o.energy.throttling) valves += t;
        for (const double p : o.peak_pressure) peak = std::max(peak, p);
        std::string third;
        if (own) {
          third = fmt::format("{:.1f}", cost_with_idling(o, c.idle_power) / 1e3);
        } else if (best != nullptr && best->found() && o.kind != kOptimal) {
          third = fmt::format("{:+.1f} %", 100.0 * (o.energy.total / best->energy.total - 1.0));
        }
        text +=
            fmt::format("    {:34} {:8.2f} {:8.2f} {:>9} {:9.1f} {:8.0f}  {}\n",
                        strategy_title(o.kind), o.energy.total / 1e3, o.duration, third,
                        valves / 1e3, peak / units::kBar, o.kind == kSequential ? o.detail : "");
      }
    }
  }
  if (all.size() < 2) return text;
  for (const std::string& name : row_names(all)) {
    text += fmt::format("over {} problems, {}: energy above the optimum\n", all.size(), name);
    text += fmt::format("    {:34} {:>4} {:>8} {:>17} {:>8} {:>10}\n", "", "n", "median",
                        "quartiles", "worst", "Wilcoxon p");
    const auto line = [&](const PairedSummary& s, const std::string& title) {
      if (s.n == 0) return;
      text += fmt::format("    {:34} {:4} {:7.1f}% {:7.1f} ..{:6.1f}% {:7.1f}% {:10.2g}\n", title,
                          s.n, 100.0 * s.median, 100.0 * s.lower, 100.0 * s.upper,
                          100.0 * s.largest, s.test.p_value);
    };
    for (const std::string& kind : BaselineSet::kinds())
      line(paired(all, name, kind, kOptimal), strategy_title(kind));
    line(paired(all, name, kSequential, kJointLine), "sequential against simultaneous");
  }
  return text;
}

}  // namespace sparflow
