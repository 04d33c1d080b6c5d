/// The texts of optimize: a table for the terminal, JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/motion_pages/evaluation.h"
#include "apps/report/motion_pages/motion_page.h"
#include "models/math/units.h"
#include "optimizer/solve/optimize_cycle.h"

namespace sparflow {
namespace {

nlohmann::json start_json(const StartResult& s) {
  nlohmann::json stages = nlohmann::json::array();
  for (const StageRecord& g : s.stages) {
    stages.push_back({{"what", g.what},
                      {"status", to_string(g.status)},
                      {"iterations", g.iterations},
                      {"solve_s", g.solve_s},
                      {"energy_exact_J", g.energy_exact},
                      {"excess", g.excess}});
  }
  nlohmann::json out = {{"seed", s.seed},
                        {"status", to_string(s.status)},
                        {"message", s.message},
                        {"duration_s", s.duration},
                        {"energy_J", s.energy_smooth},
                        {"energy_exact_J", s.energy_exact},
                        {"constraint_violation", s.excess},
                        {"iterations", s.iterations},
                        {"solve_s", s.solve_s},
                        {"callbacks_s", s.callbacks_s},
                        {"linear_solver_s", s.linear_solver_s},
                        {"modes_held", s.modes_held},
                        {"stages", stages}};
  if (s.motion.size() < 2) {
    for (const char* key : {"energy_J", "energy_exact_J", "constraint_violation"})
      out[key] = nullptr;
  }
  if (s.seed_feasible) out["seed_energy_exact_J"] = s.seed_energy;
  if (s.same_as >= 0) out["same_as"] = s.same_as;
  return out;
}

void add_energy_keys(const CraneModel& model, const MotionProblem& problem,
                     const MotionEnergy& energy, double duration, nlohmann::json& out) {
  out["energy_exact_J"] = energy.total;
  out["idle_energy_J"] = problem.idle_power * duration;
  out["potential_energy_difference_J"] = energy.potential_difference;
  out["largest_pressure_std_bar"] = energy.largest_pressure_std / units::kBar;
  out["moving_share_outside_data"] = energy.moving_share_outside_data;
  out["share_of_time_moving"] = energy.share_moving;
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    const std::string& name = model.machine.cylinders[i].name;
    out["throttling_J"][name] = energy.throttling[i];
    out["useful_J"][name] = energy.useful[i];
    out["creep_m"][name] = energy.creep[i];
  }
  for (std::size_t p = 0; p < model.pumps.size(); ++p)
    out["pump_J"][model.machine.pumps[p].name] = energy.pump[p];
}

void add_limit_keys(const std::vector<LimitCheck>& checks, nlohmann::json& out) {
  out["constraint_violation"] = worst_excess(checks);
  out["limits"] = nlohmann::json::array();
  for (const LimitCheck& c : checks) {
    out["limits"].push_back({{"what", c.what},
                             {"value", c.value},
                             {"limit", c.limit},
                             {"unit", c.unit},
                             {"t_s", c.time},
                             {"excess", c.excess}});
  }
}

void add_legs(const CraneModel& model, const MotionProblem& problem, const OptimizeResult& r,
              nlohmann::json& out) {
  if (problem.stops.empty()) return;
  out["legs"] = nlohmann::json::array();
  for (const LegEnergy& leg : leg_energies(model, problem, r.motion)) {
    out["legs"].push_back({{"to", leg.to},
                           {"payload_kg", leg.payload},
                           {"begin_s", leg.begin},
                           {"end_s", leg.end},
                           {"energy_exact_J", leg.energy}});
  }
  out["legwise_energy_exact_J"] =
      r.legwise_energy > 0.0 ? nlohmann::json(r.legwise_energy) : nlohmann::json();
  out["bound_note"] = r.bound_note;
}

/// The engine's energy while time passes, which no motion avoids; "" without idle power.
std::string idle_text(const MotionProblem& problem, double duration) {
  if (problem.idle_power <= 0.0) return "";
  return fmt::format("  idle energy          {:9.2f} kJ   {:.4g} kW while {:.2f} s pass\n",
                     problem.idle_power * duration / 1e3, problem.idle_power / 1e3, duration);
}

std::string no_motion_text(const OptimizeResult& r) {
  const bool said = r.message.find(to_string(r.status)) != std::string::npos;
  std::string text =
      (said ? r.message : fmt::format("{}: {}", to_string(r.status), r.message)) + "\n";
  for (const StartResult& s : r.starts) text += fmt::format("  {:<34} {}\n", s.seed, s.message);
  return text;
}

/// Energy and idle power x time. [J]
double cost_of(const MotionProblem& problem, const OptimizeResult& r) {
  return r.energy.total + problem.idle_power * r.duration;
}

/// The optimum's energy beside those it is compared with, and beside its bounds.
std::string energies_text(const MotionProblem& problem, const OptimizeResult& r) {
  std::string text = fmt::format("  energy (exact law)   {:9.2f} kJ   in {:.2f} s, from {}\n",
                                 r.energy.total / 1e3, r.duration,
                                 r.starts[static_cast<std::size_t>(r.best_start)].seed);
  const auto against = [&](const char* what, double energy, const std::string& name) {
    if (energy > 0.0)
      text += fmt::format(
          "  {:<20} {:9.2f} kJ   the optimum {} {:.1f} %{}{}\n", what, energy / 1e3,
          r.energy.total <= energy ? "saves" : "takes more (energy is not its only cost):",
          100.0 * std::abs(1.0 - r.energy.total / energy), name.empty() ? "" : "; ", name);
    else
      text += fmt::format("  {:<20}         -      it breaks a limit in this time\n", what);
  };
  if (problem.stops.empty()) {
    against("straight, nearest", r.nearest_line_energy, "");
    against("straight, cheapest", r.straight_line_energy, r.straight_line_name);
    against("best seed path", r.best_seed_energy, r.best_seed_name);
  } else if (r.legwise_energy > 0.0) {
    against("legs one by one", r.legwise_energy, "");
  }
  if (r.grid_path_energy > 0.0) against("dynamic programming", r.grid_path_energy, "");
  if (r.unlimited_energy > 0.0) {
    text += fmt::format(
        "  at unlimited time    {:9.2f} kJ   cheapest path of a joint grid, driven slowly\n",
        r.unlimited_energy / 1e3);
  }
  if (r.lower_bound_cost > 0.0) {
    text += fmt::format(
        "  with idle power      {:9.2f} kJ   energy and {:g} kW x time; their estimated bound "
        "{:.2f} "
        "kJ is {:.1f} % below\n",
        cost_of(problem, r) / 1e3, problem.idle_power / 1e3, r.lower_bound_cost / 1e3,
        100.0 * (1.0 - r.lower_bound_cost / cost_of(problem, r)));
  }
  if (r.lower_bound > 0.0) {
    const std::string which =
        r.lower_bound_time > 0.0 ? fmt::format("of motions of {:.2f} s or less", r.lower_bound_time)
                                 : "of motions of any duration";
    text += fmt::format("  estimated bound      {:9.2f} kJ   {}: gap {:.1f} %\n",
                        r.lower_bound / 1e3, which, 100.0 * bound_gap(r));
    if (!r.bound_note.empty()) text += "  note                 " + r.bound_note + "\n";
  } else if (!r.bound_note.empty()) {
    text += "  estimated bound           none   " + r.bound_note + "\n";
  }
  return text + fmt::format("  potential energy     {:+9.2f} kJ   end minus start\n",
                            r.energy.potential_difference / 1e3);
}

std::string cylinders_text(const Machine& machine, const MotionEnergy& energy) {
  std::string text =
      fmt::format("  {:<14} {:>12} {:>14}\n", "cylinder", "useful [kJ]", "throttled [kJ]");
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    text += fmt::format("  {:<14} {:>12.2f} {:>14.2f}\n", machine.cylinders[i].name,
                        energy.useful[i] / 1e3, energy.throttling[i] / 1e3);
  }
  return text;
}

/// Time and energy of each leg of a cycle; "" where there is one move.
std::string legs_text(const CraneModel& model, const MotionProblem& problem,
                      const Trajectory& motion) {
  if (problem.stops.empty()) return "";
  std::string text = fmt::format("  {:<20} {:>12} {:>9} {:>9} {:>12}\n", "leg to", "payload [kg]",
                                 "from [s]", "to [s]", "energy [kJ]");
  for (const LegEnergy& leg : leg_energies(model, problem, motion))
    text += fmt::format("  {:<20} {:>12.4g} {:>9.2f} {:>9.2f} {:>12.2f}\n", leg.to, leg.payload,
                        leg.begin, leg.end, leg.energy / 1e3);
  return text;
}

/// Largest sway of the load, and how far it swings on, of a problem that limits it.
std::string sway_text(const std::vector<LimitCheck>& checks) {
  std::string text;
  for (const LimitCheck& k : checks)
    if (k.what.starts_with("sway of the load"))
      text += fmt::format("  {:<20} {:.2f} of {:.2f} deg at {:.2f} s\n",
                          "sway" + k.what.substr(std::string_view("sway of the load").size()),
                          k.value, k.limit, k.time);
  return text;
}

/// Whether all limits are kept, and which one is nearest; start and goal are met at equality and are no news.
std::string limits_text(const std::vector<LimitCheck>& checks) {
  const double margin = -100.0 * checks.front().excess;
  for (const LimitCheck& k : checks) {
    if (is_end_condition(k)) continue;
    return fmt::format(
               "  limits               {} at 16 samples per mesh interval; nearest: {} {:.4g} of "
               "{:.4g} {} at {:.2f} s\n",
               margin >= -1e-3 ? "all kept" : "BROKEN", k.what, k.value, k.limit, k.unit, k.time) +
           sway_text(checks);
  }
  return {};
}

/// Share of the moving time outside the data from which it is told, and from which the headline tells it.
constexpr double kToldOutside = 0.02, kMostlyOutside = 0.5;

/// What a reader must know before the energies are believed.
std::string reservations_text(const CraneModel& model, const MotionEnergy& energy) {
  std::string text;
  if (energy.moving_share_outside_data > kToldOutside) {
    text += fmt::format(
        "  note                 {:.0f} % of the moving time lies outside the data; least certain "
        "pressure +-{:.1f} bar (one standard deviation)\n",
        100.0 * energy.moving_share_outside_data, energy.largest_pressure_std / units::kBar);
  }
  /// Way of a rod below its valve's least flow from which on it is told.
  /// @threshold [m] 1e-4..0.1; chosen: a millimetre, which a tip a hundred times as far out shows as a hand's breadth
  constexpr double kToldCreep = 1e-3;
  for (std::size_t i = 0; i < energy.creep.size(); ++i) {
    if (energy.creep[i] < kToldCreep) continue;
    text += fmt::format(
        "  note                 {} moves {:.1f} mm at flows below its valve's least "
        "(limits: valve_least_fraction)\n",
        model.machine.cylinders[i].name, 1e3 * energy.creep[i]);
  }
  if (const std::string why = constant_pressure_note(model); !why.empty())
    text += "  note                 " + why + "\n";
  if (energy.impossible()) {
    text +=
        "  WARNING              the pump delivers less energy than machine and payload gain: "
        "working "
        "pressures\n"
        "                       are extrapolated to loads beyond the data; fit the model to logs "
        "with "
        "such loads\n";
  }
  return text;
}

std::string outside_text(const OptimizeResult& r) {
  return fmt::format(
      "most of the motion ({:.0f} % of the moving time) lies outside what the model has learned",
      100.0 * r.energy.moving_share_outside_data);
}

std::string starts_text(const OptimizeResult& r) {
  int usable = 0, distinct = 0;
  for (const StartResult& s : r.starts) {
    usable += s.motion.size() > 1 && s.excess <= 1e-4;
    distinct += s.motion.size() > 1 && s.excess <= 1e-4 && s.same_as < 0;
  }
  const std::string bound =
      r.bound_s > 0.0 ? fmt::format(", of which {:.1f} s for the bound", r.bound_s) : "";
  return fmt::format(
      "  starts               {} tried, {} kept all limits, {} distinct motions; {:.1f} s{}\n",
      r.starts.size(), usable, distinct, r.solve_s, bound);
}

}  // namespace

std::string against_seeds(const OptimizeResult& r) {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& what, double energy) {
    if (energy <= 0.0) return;
    const double saved = 100.0 * (1.0 - r.energy.total / energy);
    if (std::abs(saved) < 0.05) {  // instead of "0.0 % less"
      parts.push_back(fmt::format("as much as {} ({:.1f} kJ)", what, energy / 1e3));
      return;
    }
    parts.push_back(fmt::format("{:.{}f} % {} than {} ({:.1f} kJ)", std::abs(saved),
                                std::abs(saved) < 9.95 ? 1 : 0, saved >= 0.0 ? "less" : "more",
                                what, energy / 1e3));
  };
  add("the straight joint line to the nearest goal configuration", r.nearest_line_energy);
  if (r.straight_line_energy != r.nearest_line_energy)
    add("the cheapest straight line", r.straight_line_energy);
  if (r.best_seed_energy != r.straight_line_energy)
    add("the best seed, " + r.best_seed_name, r.best_seed_energy);
  return parts.empty() ? "" : fmt::format("{} in the same time", fmt::join(parts, " and "));
}

double bound_gap(const OptimizeResult& r) {
  return r.lower_bound > 0.0 ? r.energy.total / r.lower_bound - 1.0 : std::nan("");
}

bool mostly_outside_data(const OptimizeResult& r) {
  return r.energy.moving_share_outside_data > kMostlyOutside;
}

std::string motion_headline(const OptimizeResult& r) {
  if (r.motion.size() < 2) return "no motion was found";
  std::string text = fmt::format("{:.1f} kJ in {:.2f} s", r.energy.total / 1e3, r.duration);
  if (const std::string against = against_seeds(r); !against.empty()) text += ": " + against;
  if (r.lower_bound > 0.0)
    text += fmt::format("; {:.1f} % above the estimated bound of {:.1f} kJ", 100.0 * bound_gap(r),
                        r.lower_bound / 1e3);
  if (mostly_outside_data(r)) text += "; " + outside_text(r);
  return text;
}

std::string constant_pressure_note(const CraneModel& model) {
  const std::vector<Pump>& pumps = model.machine.pumps;
  const bool constant =
      !pumps.empty() && std::all_of(pumps.begin(), pumps.end(), [](const Pump& p) {
        return p.type == PumpType::kConstantPressure;
      });
  return constant ? "At constant supply pressure the energy is pressure times oil volume: it "
                    "depends on the strokes alone, not on their timing."
                  : "";
}

std::string optimize_json(const CraneModel& model, const MotionProblem& problem,
                          const OptimizeResult& r) {
  nlohmann::json out = {
      {"problem", problem.name},
      {"status", r.status == OptimizeStatus::kInterrupted ? "failed" : to_string(r.status)},
      {"interrupted", r.interrupted || r.status == OptimizeStatus::kInterrupted},
      {"message", r.message},
      {"headline", motion_headline(r)},
      {"duration_s", r.duration},
      {"solve_s", r.solve_s}};
  if (r.bound_s > 0.0) out["bound_s"] = r.bound_s;
  if (r.shortest_duration > 0.0) out["shortest_duration_s"] = r.shortest_duration;
  int iterations = 0;
  for (const StartResult& s : r.starts) iterations += s.iterations;
  out["iterations"] = iterations;
  out["starts"] = nlohmann::json::array();
  for (const StartResult& s : r.starts) out["starts"].push_back(start_json(s));
  if (r.motion.size() > 1) {
    out["energy_J"] = r.energy_smooth;
    out["seed"] = r.starts[static_cast<std::size_t>(r.best_start)].seed;
    add_energy_keys(model, problem, r.energy, r.duration, out);
    add_limit_keys(r.checks, out);
    add_legs(model, problem, r, out);
    out["mesh_error"] = r.mesh_error;
    if (r.lower_bound > 0.0) {
      out["lower_bound_J"] = r.lower_bound;
      out["lower_bound_time_s"] =
          r.lower_bound_time > 0.0 ? nlohmann::json(r.lower_bound_time) : nlohmann::json();
      out["gap"] = bound_gap(r);
    }
    if (r.lower_bound_cost > 0.0) {
      // With idle power it is energy and time together that are least.
      out["cost_J"] = cost_of(problem, r);
      out["lower_bound_cost_J"] = r.lower_bound_cost;
      out["gap"] = cost_of(problem, r) / r.lower_bound_cost - 1.0;
    }
    if (r.grid_path_energy > 0.0) out["grid_path_energy_exact_J"] = r.grid_path_energy;
    if (r.unlimited_energy > 0.0) out["unlimited_time_J"] = r.unlimited_energy;
    out["best_seed_energy_exact_J"] =
        r.best_seed_energy > 0.0 ? nlohmann::json(r.best_seed_energy) : nlohmann::json();
    out["best_seed"] =
        r.best_seed_energy > 0.0 ? nlohmann::json(r.best_seed_name) : nlohmann::json();
    out["nearest_line_energy_exact_J"] =
        r.nearest_line_energy > 0.0 ? nlohmann::json(r.nearest_line_energy) : nlohmann::json();
    out["straight_line_energy_exact_J"] =
        r.straight_line_energy > 0.0 ? nlohmann::json(r.straight_line_energy) : nlohmann::json();
  }
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string optimize_table(const CraneModel& model, const MotionProblem& problem,
                           const OptimizeResult& r) {
  if (r.motion.size() < 2) return no_motion_text(r);
  const std::string reached =
      r.status == OptimizeStatus::kFeasible ? "  not converged        " + r.message + "\n" : "";
  return fmt::format("{}: {}{}\n", to_string(r.status), problem.name,
                     mostly_outside_data(r) ? "; " + outside_text(r) : "") +
         reached + energies_text(problem, r) + idle_text(problem, r.duration) +
         legs_text(model, problem, r.motion) + cylinders_text(model.machine, r.energy) +
         limits_text(r.checks) + reservations_text(model, r.energy) + starts_text(r);
}

bool limits_kept(const MotionEvaluation& e) {
  return worst_excess(e.checks) <= OptimizeOptions{}.limit_tolerance;
}

std::string evaluation_json(const CraneModel& model, const MotionProblem& problem,
                            const MotionEvaluation& e) {
  nlohmann::json out = {{"motion", e.file},
                        {"machine", model.machine.name},
                        {"payload_kg", problem.payload},
                        {"duration_s", e.motion.duration()},
                        {"limits_kept", limits_kept(e)},
                        {"from_positions", e.from_positions},
                        {"notes", e.notes}};
  add_energy_keys(model, problem, e.energy, e.motion.duration(), out);
  add_limit_keys(e.checks, out);
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string evaluation_table(const CraneModel& model, const MotionProblem& problem,
                             const MotionEvaluation& e) {
  double lost = 0.0;
  for (const double t : e.energy.throttling) lost += t;
  std::string text =
      fmt::format("{} on {}, {:.4g} kg\n", e.file, model.machine.name, problem.payload);
  text += fmt::format("  energy (exact law)   {:9.2f} kJ   in {:.2f} s\n", e.energy.total / 1e3,
                      e.motion.duration());
  text += idle_text(problem, e.motion.duration());
  text += fmt::format("  throttling loss      {:9.2f} kJ   {:.0f} % of the energy\n", lost / 1e3,
                      100.0 * lost / std::max(1.0, e.energy.total));
  text += fmt::format("  potential energy     {:+9.2f} kJ   end minus start\n",
                      e.energy.potential_difference / 1e3);
  text += cylinders_text(model.machine, e.energy);
  if (!e.checks.empty()) text += limits_text(e.checks);
  for (const LimitCheck& c : e.checks) {
    if (c.excess <= OptimizeOptions{}.limit_tolerance) break;
    text += fmt::format("    broken             {}: {:.4g} of {:.4g} {} at {:.2f} s\n", c.what,
                        c.value, c.limit, c.unit, c.time);
  }
  text += reservations_text(model, e.energy);
  for (const std::string& n : e.notes) text += "  note                 " + n + "\n";
  return text;
}

}  // namespace sparflow
