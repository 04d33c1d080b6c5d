#pragma once
/// The single list of effects; every other part of the program takes effects from here.
#include <memory>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// The catalogue, in order of the chain: force, flow, pressure, pump, sensor; then user effects.
const std::vector<std::unique_ptr<Effect>>& effect_catalogue();
/// The effect with this id, nullptr when there is none.
const Effect* find_effect(const std::string& id);
/// Adds a user effect until the program ends. @throws InputError when the id is taken
const Effect* add_user_effect(std::unique_ptr<Effect> effect);

struct EffectAt {
  const Effect* effect = nullptr;
  int at = -1;
  bool operator==(const EffectAt&) const = default;
};
/// Effect and place of a key such as "coulomb_friction:boom" on this machine.
/// @throws InputError that names what exists, with a suggestion
EffectAt parse_effect(const std::string& key, const Machine& machine);
/// Every effect at every place where it can act on this machine.
std::vector<EffectAt> candidates(const Machine& machine);

}  // namespace sparflow
