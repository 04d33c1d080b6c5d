#pragma once
/// The one list of effects. Everything that knows about an effect knows it from here.
#include <memory>
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// The catalogue, in order of the chain: force, flow, pressure, pump, sensor; then user effects.
const std::vector<std::unique_ptr<Effect>>& effect_catalogue();
/// nullptr when there is none.
const Effect* find_effect(const std::string& id);
/// Adds a user effect for this process. @throws InputError when the id is taken
const Effect* add_user_effect(std::unique_ptr<Effect> effect);

struct EffectAt {
  const Effect* effect = nullptr;
  int at = -1;
  bool operator==(const EffectAt&) const = default;
};
/// "coulomb_friction:boom" on this machine. @throws InputError naming what exists, with a suggestion
EffectAt parse_effect(const std::string& key, const Machine& machine);
/// Every effect at every place it can sit on this machine.
std::vector<EffectAt> candidates(const Machine& machine);

}  // namespace sparflow
