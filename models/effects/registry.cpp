#include "models/effects/registry.h"

#include <fmt/format.h>

#include "models/effects/builtin.h"
#include "models/effects/user_effect_scope.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

std::vector<std::unique_ptr<Effect>>& mutable_catalogue() {
  static std::vector<std::unique_ptr<Effect>> all = [] {
    // Of effects that are confused with each other the usual cause comes first; `improve` prefers it where chance may decide.
    std::vector<std::unique_ptr<Effect>> list;
    list.push_back(make_unmodelled_mass());
    list.push_back(make_payload_error());
    list.push_back(make_base_tilt());
    list.push_back(make_angle_offset());
    list.push_back(make_structural_flex());
    list.push_back(make_inertia());
    list.push_back(make_payload_sway());
    list.push_back(make_coulomb_friction());
    list.push_back(make_viscous_friction());
    list.push_back(make_stribeck_friction());
    list.push_back(make_load_friction());
    list.push_back(make_pad_friction());
    list.push_back(make_end_cushion());
    list.push_back(make_presliding());
    list.push_back(make_force_offset());
    list.push_back(make_valve_deadband());
    list.push_back(make_valve_lag());
    list.push_back(make_valve_pressure_drop());
    list.push_back(make_flow_saturation());
    list.push_back(make_leakage());
    list.push_back(make_compressibility());
    list.push_back(make_return_back_pressure());
    list.push_back(make_counterbalance());
    list.push_back(make_oil_temperature());
    list.push_back(make_pump_lag());
    list.push_back(make_line_loss());
    list.push_back(make_flow_dependent_margin());
    list.push_back(make_torque_limit());
    list.push_back(make_pressure_offset());
    list.push_back(make_sensor_delay());
    return list;
  }();
  return all;
}

}  // namespace

const std::vector<std::unique_ptr<Effect>>& effect_catalogue() { return mutable_catalogue(); }

const Effect* find_effect(const std::string& id) {
  for (const auto& effect : effect_catalogue()) {
    if (effect->info().id == id) return effect.get();
  }
  return nullptr;
}

const Effect* add_user_effect(std::unique_ptr<Effect> effect) {
  const std::string& id = effect->info().id;
  if (find_effect(id) != nullptr) {
    throw InputError({}, id,
                     fmt::format("an effect called '{}' exists already: choose another id", id));
  }
  mutable_catalogue().push_back(std::move(effect));
  return mutable_catalogue().back().get();
}

UserEffectScope::UserEffectScope() : before_(mutable_catalogue().size()) {}

UserEffectScope::~UserEffectScope() { mutable_catalogue().resize(before_); }

namespace {

/// The id that was probably meant, or "" if none is near.
std::string nearest_effect(const std::string& id) {
  std::vector<std::string> ids;
  ids.reserve(effect_catalogue().size());
  for (const auto& known : effect_catalogue()) ids.push_back(known->info().id);
  const std::string near = nearest_word(id, ids);
  /// Shortest beginning of an id that is completed.
  /// @threshold [letters] 2..20; chosen: shorter beginnings fit too many ids
  constexpr std::size_t kAWord = 4;
  if (!near.empty() || id.size() < kAWord) return near;
  for (const std::string& full : ids) {  // "coulomb" is far from coulomb_friction by edit distance
    if (full.starts_with(id)) return full;
  }
  return {};
}

}  // namespace

EffectAt parse_effect(const std::string& key, const Machine& machine) {
  const std::size_t colon = key.find(':');
  const std::string id = key.substr(0, colon);
  const Effect* effect = find_effect(id);
  if (effect == nullptr) {
    const std::string near = nearest_effect(id);
    throw InputError({}, key,
                     fmt::format("there is no effect '{}'{}; `sparflow effects` lists them", id,
                                 near.empty() ? "" : fmt::format(" (did you mean '{}'?)", near)));
  }
  std::vector<std::string> names;
  for (const int at : effect->places(machine)) {
    const std::string full = effect_key(effect->info(), machine, at);
    if (full == key) return {effect, at};
    names.push_back(full);
  }
  if (names.size() == 1 && colon == std::string::npos) return parse_effect(names.front(), machine);
  throw InputError(
      {}, key, fmt::format("on this machine '{}' has the places: {}", id, fmt::join(names, ", ")));
}

std::vector<EffectAt> candidates(const Machine& machine) {
  std::vector<EffectAt> all;
  for (const auto& effect : effect_catalogue()) {
    for (const int at : effect->places(machine)) all.push_back({effect.get(), at});
  }
  return all;
}

}  // namespace sparflow
