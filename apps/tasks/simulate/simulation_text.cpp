#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/tasks/simulate/simulate_task.h"

namespace sparflow {
namespace {

double plant_work(const Simulation& s) {
  const std::vector<double>& work = s.ledger.pump_work;
  return std::accumulate(work.begin(), work.end(), 0.0);
}
double plant_delivered(const Simulation& s) {
  const std::vector<double>& energy = s.ledger.delivered;
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

/// The energy balance and its losses in kJ; what is below one joule is left out.
void add_energies(const Simulation& s, SimulationView& view) {
  const Machine& machine = *s.machine;
  const plant::EnergyLedger& l = s.ledger;
  const auto add = [](auto& list, const std::string& name, double joule) {
    if (std::abs(joule) > 1.0) list.emplace_back(name, joule / 1e3);
  };
  add(view.balance_kJ, "work of the pumps", plant_work(s));
  add(view.balance_kJ, "work of drives without hydraulics", l.drive_work);
  add(view.balance_kJ, "brought by payloads that were taken, less those put down",
      l.payload_exchange);
  add(view.balance_kJ, "turned into heat", -l.total_loss());
  add(view.balance_kJ, "stored in height, motion and oil", -l.stored);
  add(view.balance_kJ, "error of the integration", -l.imbalance());
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    for (int k = 0; k < plant::kLosses; ++k) {
      const auto place = static_cast<std::size_t>(k);
      add(view.losses_kJ,
          fmt::format("{}: {}", machine.cylinders[c].name, plant::kLossWords[place]),
          l.cylinder_loss[c][place]);
    }
  }
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    add(view.losses_kJ, "pump " + machine.pumps[p].name + ": leakage and relief", l.pump_loss[p]);
  add(view.losses_kJ, "return line", l.tank_loss);
  add(view.losses_kJ, "swinging payload and bending booms", l.swing_loss);
}

/// A line for each channel of the recording.
std::string recording_errors(const Simulation& s) {
  std::string text;
  for (const SimulatedChannel& c : s.view.channels) {
    const RecordingError e = recording_error(c);
    if (!std::isfinite(e.rmse) || c.name == "command") continue;
    text += fmt::format("  {:<28} {:8.3g} {} RMS from the recording (its spread {:.3g})\n",
                        c.label(), e.rmse, c.unit, e.spread);
  }
  return text;
}

}  // namespace

std::string simulation_json(const Simulation& s) {
  const Machine& machine = *s.machine;
  const plant::EnergyLedger& l = s.ledger;
  nlohmann::json json;
  json["status"] = s.interrupted                                  ? "interrupted"
                   : s.status == plant::RunStatus::kRunning       ? "done"
                   : s.status == plant::RunStatus::kKinematicsEnd ? "kinematics_end"
                                                                  : "failed";
  json["message"] = s.message;
  json["interrupted"] = s.interrupted;
  json["seconds"] = s.time;
  json["samples"] = s.rows;
  json["seed"] = s.seed;
  json["effects"] = s.effects;
  json["elapsed_s"] = s.elapsed;
  json["times_real_time"] = s.time / std::max(s.elapsed, 1e-9);
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    json["pumps"][machine.pumps[p].name] = {
        {"work_J", l.pump_work[p]}, {"energy_J", l.delivered[p]}, {"loss_J", l.pump_loss[p]}};
  for (std::size_t c = 0; c < machine.cylinders.size(); ++c) {
    for (int k = 0; k < plant::kLosses; ++k) {
      const auto place = static_cast<std::size_t>(k);
      json["losses_J"][machine.cylinders[c].name][plant::kLossNames[place]] =
          l.cylinder_loss[c][place];
    }
  }
  json["tank_loss_J"] = l.tank_loss;
  json["swing_loss_J"] = l.swing_loss;
  json["drive_work_J"] = l.drive_work;
  json["payload_exchange_J"] = l.payload_exchange;
  json["stored_J"] = l.stored;
  json["imbalance_J"] = l.imbalance();
  const plant::PlantRun::Counts& counts = s.counts;
  json["integrator"] = {{"steps", counts.steps},
                        {"evaluations", counts.evaluations},
                        {"jacobians", counts.jacobians},
                        {"starts", counts.starts}};
  for (const SimulatedChannel& c : s.view.channels) {
    const RecordingError e = recording_error(c);
    if (!std::isfinite(e.rmse) || c.name == "command") continue;
    json["recording"][c.label()] = {{"rmse", e.rmse}, {"spread", e.spread}, {"unit", c.unit}};
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string simulation_table(const Simulation& s, const std::string& log) {
  const Machine& machine = *s.machine;
  const plant::EnergyLedger& l = s.ledger;
  std::string text = recording_errors(s);
  text += fmt::format("{}: {:.2f} s, {} samples, {:.0f} times real time\n", machine.name, s.time,
                      s.rows, s.time / std::max(s.elapsed, 1e-9));
  for (std::size_t p = 0; p < machine.pumps.size(); ++p)
    text +=
        fmt::format("  {:<21} {:10.2f} kJ of work, {:.2f} kJ of them into the valves\n",
                    "pump " + machine.pumps[p].name, l.pump_work[p] / 1e3, l.delivered[p] / 1e3);
  for (int k = 0; k < plant::kLosses; ++k) {
    const auto place = static_cast<std::size_t>(k);
    double sum = 0.0;
    for (const auto& c : l.cylinder_loss) sum += c[place];
    text += fmt::format("  {:<21} {:10.2f} kJ lost\n", plant::kLossWords[place], sum / 1e3);
  }
  text += fmt::format("  {:<21} {:10.2f} kJ lost\n", "pump leakage, relief",
                      std::accumulate(l.pump_loss.begin(), l.pump_loss.end(), 0.0) / 1e3);
  text += fmt::format("  {:<21} {:10.2f} kJ lost\n", "return line", l.tank_loss / 1e3);
  if (std::abs(l.payload_exchange) > 1.0)
    text +=
        fmt::format("  {:<21} {:10.2f} kJ brought\n", "payloads taken", l.payload_exchange / 1e3);
  // Where a load falls, far more energy is lost than the pumps gave.
  double lost = l.tank_loss + std::accumulate(l.pump_loss.begin(), l.pump_loss.end(), 0.0);
  for (const auto& c : l.cylinder_loss) lost += std::accumulate(c.begin(), c.end(), 0.0);
  text += fmt::format(
      "  energy balance closes to {:.2g} %\n",
      100.0 * std::abs(l.imbalance()) / std::max({1.0, l.drive_work + plant_work(s), lost}));
  if (!s.message.empty()) text += fmt::format("  ended at {:.2f} s: {}\n", s.time, s.message);
  if (!log.empty()) text += fmt::format("log written to {}\n", log);
  return text;
}

std::string simulation_headline(const Simulation& s) {
  return fmt::format(
      "In {:.1f} s the pumps did {:.1f} kJ of work, of which {:.1f} kJ went into the valves",
      s.time, plant_work(s) / 1e3, plant_delivered(s) / 1e3);
}

SimulationView simulation_view(const Simulation& s) {
  SimulationView view = s.view;
  add_energies(s, view);
  view.headline = simulation_headline(s);
  view.text = recording_errors(s).empty()
                  ? "Nothing was recorded to compare with."
                  : "The plant got what was recorded; the table tells its errors.";
  if (s.interrupted) view.text += " The run was interrupted.";
  if (!s.message.empty()) view.text += " The run ended early: " + s.message + ".";
  return view;
}

}  // namespace sparflow
