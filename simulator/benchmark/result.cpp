#include "simulator/benchmark/result.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "models/math/units.h"

namespace sparflow::benchmark {
namespace {

using nlohmann::ordered_json;

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}
double read(const ordered_json& j, const char* key) {
  return j.at(key).is_null() ? kNotKnown : j.at(key).get<double>();
}

ordered_json as_json(const Row& r) {
  ordered_json j;
  j["scenario"] = r.scenario;
  j["controller"] = r.controller;
  j["seed"] = r.seed;
  j["status"] = r.done ? "done" : "failed";
  j["reason"] = r.reason;
  j["energy_J"] = number(r.energy);
  j["pump_work_J"] = number(r.pump_work);
  j["useful_J"] = number(r.useful);
  for (std::size_t k = 0; k < r.loss.size(); ++k) j["losses_J"][plant::kLossNames[k]] = r.loss[k];
  j["losses_J"]["pump"] = r.pump_loss;
  j["losses_J"]["return_line"] = r.tank_loss;
  j["losses_J"]["swing"] = r.swing_loss;
  j["time_s"] = number(r.time);
  j["ran_s"] = r.ran;
  j["tip_error_path_m"] = number(r.tip_error_path);
  j["tip_error_end_m"] = number(r.tip_error_end);
  j["sway_rad"] = number(r.sway);
  j["sway_path_rad"] = number(r.sway_path);
  j["peak_pressure_bar"] = r.peak_pressure / units::kBar;
  j["limits_broken"] = r.limits;
  j["roughness_1_s"] = number(r.roughness);
  j["step_median_s"] = number(r.step_median);
  j["step_worst_s"] = number(r.step_worst);
  return j;
}

}  // namespace

std::string row_json(const Row& row) {
  return as_json(row).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::string packed(const Row& row) {
  ordered_json j = as_json(row);
  j["peak_pressure_Pa"] = row.peak_pressure;
  j["trace"] = {
      {"t", row.trace.t}, {"q", row.trace.q}, {"power", row.trace.power}, {"loss", row.trace.loss}};
  return j.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

Row row_from(const std::string& text) {
  const ordered_json j = ordered_json::parse(text);
  Row r;
  r.scenario = j.at("scenario");
  r.controller = j.at("controller");
  r.seed = j.at("seed");
  r.done = j.at("status") == "done";
  r.reason = j.at("reason");
  r.energy = read(j, "energy_J");
  r.pump_work = read(j, "pump_work_J");
  r.useful = read(j, "useful_J");
  const ordered_json& losses = j.at("losses_J");
  for (std::size_t k = 0; k < r.loss.size(); ++k) r.loss[k] = read(losses, plant::kLossNames[k]);
  r.pump_loss = read(losses, "pump");
  r.tank_loss = read(losses, "return_line");
  r.swing_loss = read(losses, "swing");
  r.time = read(j, "time_s");
  r.ran = read(j, "ran_s");
  r.tip_error_path = read(j, "tip_error_path_m");
  r.tip_error_end = read(j, "tip_error_end_m");
  r.sway = read(j, "sway_rad");
  r.sway_path = read(j, "sway_path_rad");
  r.peak_pressure = read(j, "peak_pressure_Pa");
  r.limits = j.at("limits_broken").get<std::vector<std::string>>();
  r.roughness = read(j, "roughness_1_s");
  r.step_median = read(j, "step_median_s");
  r.step_worst = read(j, "step_worst_s");
  const ordered_json& trace = j.at("trace");
  r.trace.t = trace.at("t").get<std::vector<double>>();
  r.trace.q = trace.at("q").get<std::vector<std::vector<double>>>();
  r.trace.power = trace.at("power").get<std::vector<double>>();
  r.trace.loss = trace.at("loss").get<std::vector<double>>();
  return r;
}

std::string csv_head() {
  std::string text =
      "scenario,controller,seed,status,energy_J,pump_work_J,useful_J,time_s,tip_error_path_m,"
      "tip_error_end_m,sway_rad,sway_path_rad,peak_pressure_bar,limits_broken,roughness_1_s,step_"
      "median_s,"
      "step_worst_s";
  for (const char* place : plant::kLossNames) text += fmt::format(",loss_{}_J", place);
  return text + ",loss_pump_J,loss_return_line_J,loss_swing_J,reason\n";
}

std::string row_csv(const Row& r) {
  const auto cell = [](double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : ""; };
  std::string text =
      fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", r.scenario, r.controller,
                  r.seed, r.done ? "done" : "failed", cell(r.energy), cell(r.pump_work),
                  cell(r.useful), cell(r.time), cell(r.tip_error_path), cell(r.tip_error_end),
                  cell(r.sway), cell(r.sway_path), cell(r.peak_pressure / units::kBar),
                  r.limits.size(), cell(r.roughness), cell(r.step_median), cell(r.step_worst));
  for (const double loss : r.loss) text += "," + cell(loss);
  std::string reason = r.reason;
  for (std::size_t at = 0; (at = reason.find('"', at)) != std::string::npos; at += 2)
    reason.insert(at, 1, '"');
  return text + fmt::format(",{},{},{},\"{}\"\n", cell(r.pump_loss), cell(r.tank_loss),
                            cell(r.swing_loss), reason);
}

}  // namespace sparflow::benchmark
