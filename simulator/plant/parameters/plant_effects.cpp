#include "simulator/plant/parameters/plant_effects.h"

#include <fmt/format.h>

#include <array>
#include <charconv>

#include "models/math/error.h"

namespace sparflow::plant {
namespace {

constexpr std::array<PlantEffect, 32> kEffects = {{
    {"coulomb_friction", "coulomb_friction_N", 0.0, true, "dry friction with presliding (LuGre)"},
    {"stiction", "stiction_ratio", 1.0, true, "breakaway above dry friction"},
    {"viscous_friction", "viscous_friction_N_s_m", 0.0, true,
     "friction that grows with speed and cold oil"},
    {"leakage", "leakage_lpm_100bar", 0.0, true, "across the piston"},
    {"compressibility", "bulk_modulus_MPa", 1e4, true, "oil yields to pressure"},
    {"entrained_air", "air_fraction", 0.0, true, "softens the oil at low pressure"},
    {"hose_expansion", "hose_modulus_MPa", 1e4, true, "hoses widen under pressure"},
    {"hose_volume", "hose_volume_l", 0.05, true, "oil in the hoses between valve and cylinder"},
    {"line_loss", "line_drop_bar", 0.2, true, "between valve and cylinder"},
    {"return_back_pressure", "tank_drop_bar", 0.05, true,
     "of filter and return line, shared by all cylinders"},
    {"return_edge", "return_drop_bar", 0.5, true,
     "throttling of the emptied chamber's flow in the spool"},
    {"valve_deadband", "dead_band_extend", 0.0, true, "extending; see valve_deadband_retract"},
    {"valve_deadband_retract", "dead_band_retract", 0.0, true, "retracting"},
    {"valve_hysteresis", "hysteresis", 0.0, true, "of the spool's drive"},
    {"valve_lag", "spool_frequency_Hz", 60.0, true, "second-order spool"},
    {"counterbalance", "counterbalance", 0.0, true,
     "load-holding valves with pilot; off: the return edge limits the flow"},
    {"port_relief", "port_relief_bar", 1e5, true, "relief valves at the chambers' ports"},
    {"end_cushion", "cushion_length_m", 0.0, true, "throttles the last part of the stroke"},
    {"load_sensing_delay", "line_delay_s", 0.002, true, "of the load-sensing line"},
    {"pump_lag", "response_s", 0.008, true, "of the pump's pressure control"},
    {"pump_leakage", "pump_leakage_lpm_100bar", 1.0, true,
     "into the pump's case; off: what lets the line down"},
    {"flow_saturation", "max_flow_lpm", 2000.0, true, "largest flow of the pump"},
    {"torque_limit", "power_kW", 1e5, true, "least of torque limit and asked flow"},
    {"flow_sharing", "flow_sharing", 0.0, false,
     "an exhausted pump's flow is shared in proportion"},
    {"sway", "rope_length_m", 0.0, true, "payload on a rope, two angles"},
    {"flexible_boom", "boom_flex_rad", 0.0, false, "booms bend"},
    {"sensor_noise", "pressure_noise_bar", 0.0, true, "of pressures"},
    {"position_noise", "position_noise", 0.0, true, "of positions"},
    {"quantisation", "pressure_step_bar", 0.0, true, "of pressures"},
    {"pressure_offset", "pressure_offset_bar", 0.0, false, "of the bore side's sensor"},
    {"sensor_delay", "sensor_delay_s", 0.0, false, "pressures come late"},
    {"drop_outs", "drop_out_per_s", 0.0, false, "gaps in single channels"},
}};

const PlantEffect* find_effect(const std::string& name) {
  for (const PlantEffect& e : kEffects)
    if (e.name == name) return &e;
  return nullptr;
}

std::vector<std::size_t> places_of(const Machine& machine, const ParameterRow& row,
                                   const EffectSetting& item) {
  const bool cylinder = row.place == Place::kCylinder;
  const std::size_t count = row.place == Place::kPlant ? 1
                            : cylinder                 ? machine.cylinders.size()
                                                       : machine.pumps.size();
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < count; ++i) {
    if (item.at.empty()) {
      indices.push_back(i);
    } else if (row.place != Place::kPlant) {
      const std::string& name = cylinder ? machine.cylinders[i].name : machine.pumps[i].name;
      if (name == item.at) indices.push_back(i);
    }
  }
  if (indices.empty() && !item.at.empty())
    throw UsageError(fmt::format("--effects: {} acts at {}, and \"{}\" is none", item.name,
                                 row.place == Place::kPlant ? "no single place"
                                 : cylinder                 ? "a cylinder"
                                                            : "a pump",
                                 item.at));
  return indices;
}

void switch_off(const PlantEffect& effect, const std::vector<std::size_t>& indices,
                PlantParameters& parameters) {
  const ParameterRow& row = *find_parameter(effect.key);
  for (const std::size_t i : indices) row.value(parameters, i) = effect.off * row.scale;
}

}  // namespace

std::span<const PlantEffect> plant_effects() { return kEffects; }

EffectSetting parse_effect(const std::string& item) {
  EffectSetting s;
  const std::size_t equals = item.find('=');
  std::string place = item.substr(0, equals);
  if (equals != std::string::npos) {
    s.value = item.substr(equals + 1);
    if (s.value.empty())
      throw UsageError(fmt::format("--effects: \"{}\" has no value behind =", item));
  }
  const std::size_t colon = place.find(':');
  s.name = place.substr(0, colon);
  if (colon != std::string::npos) s.at = place.substr(colon + 1);
  if (s.name.empty() || (colon != std::string::npos && s.at.empty()))
    throw UsageError(fmt::format("--effects: \"{}\" is not of the form NAME[:AT][=VALUE]", item));
  return s;
}

void apply_effects(const Machine& machine, const std::vector<EffectSetting>& items,
                   PlantParameters& parameters) {
  const PlantParameters nominal = parameters;
  const EffectSetting everywhere;
  const auto switch_each = [&](auto on) {
    parameters = nominal;
    for (const PlantEffect& e : kEffects)
      if (!on(e)) switch_off(e, places_of(machine, *find_parameter(e.key), everywhere), parameters);
  };
  switch_each([](const PlantEffect& e) { return e.from_start; });
  for (const EffectSetting& item : items) {
    if (item.name == "none" || item.name == "all") {
      const bool on = item.name == "all";
      switch_each([on](const PlantEffect&) { return on; });
      continue;
    }
    const PlantEffect* effect = find_effect(item.name);
    if (effect == nullptr) {
      std::vector<std::string> known = {"none", "all"};
      for (const PlantEffect& e : kEffects) known.emplace_back(e.name);
      const std::string near = nearest_word(item.name, known);
      throw UsageError(
          fmt::format("--effects: the plant has no effect \"{}\"{}; `sparflow simulate "
                      "--list-effects` names them",
                      item.name, near.empty() ? "" : fmt::format(", did you mean \"{}\"?", near)));
    }
    const ParameterRow& row = *find_parameter(effect->key);
    const std::vector<std::size_t> indices = places_of(machine, row, item);
    if (item.value == "off") {
      switch_off(*effect, indices, parameters);
      continue;
    }
    PlantParameters from = nominal;
    for (const std::size_t i : indices) {
      double value = row.value(from, i);
      if (!item.value.empty()) {
        double number = 0.0;
        const char* end = item.value.data() + item.value.size();
        const auto [read, error] = std::from_chars(item.value.data(), end, number);
        if (error != std::errc() || read != end || number < row.lowest || number > row.highest)
          throw UsageError(
              fmt::format("--effects: {} takes off, or {} from {:g} to {:g} [{}]; got \"{}\"",
                          item.name, row.text, row.lowest, row.highest, row.unit, item.value));
        value = number * row.scale;
      }
      row.value(parameters, i) = value;
    }
  }
}

std::string effects_help() {
  std::string text = fmt::format("{:<24} {:<28} {:<10} {}\n", "effect", "its value", "at", "what");
  for (const PlantEffect& e : kEffects) {
    const ParameterRow& row = *find_parameter(e.key);
    text += fmt::format("{:<24} {:<28} {:<10} {}{}; nominal {}\n", e.name, e.key,
                        row.place == Place::kPlant      ? "-"
                        : row.place == Place::kCylinder ? "cylinder"
                                                        : "pump",
                        e.text, e.from_start ? "" : " (off unless named)", row.typical);
  }
  return text;
}

}  // namespace sparflow::plant
