#pragma once
/// The catalogue of effects in words: what `sparflow effects` prints.
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// "coulomb_friction:<cyl>", as the command line takes it.
std::string effect_signature(const EffectInfo& info);
/// Every effect in one screen, by stage along the chain, and the verdict on bad data at the end.
std::string effect_table();
/// A whole entry: equation, parameters with unit, bounds and typical size, where it shows in a log, what it is
/// confused with and what separates them, what a motion sees of it, source.
std::string effect_entry(const Effect& effect);
/// Entry by id, with or without a place ("coulomb_friction:boom"); `sensor_fault` has one too.
/// @throws UsageError when there is no such effect, with a suggestion
std::string effect_entry(const std::string& id);
/// {"effects": [...]} with the same facts, of one id or (empty) of all. @throws UsageError as above
std::string effects_json(const std::string& id = {});

}  // namespace sparflow
