#pragma once
/// The catalogue of effects as text, which `sparflow effects` prints.
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// "coulomb_friction:<cyl>", as the command line takes it.
std::string effect_signature(const EffectInfo& info);
/// Every effect on one screen, in the order of the stages, with the sensor fault (bad data) at the end.
std::string effect_table();
/// The complete entry of an effect: equation, parameters with unit, bounds and typical value, the channels in which it
/// shows, what it is confused with and what separates them, how it acts on a motion, source.
std::string effect_entry(const Effect& effect);
/// Entry by id, with or without a place ("coulomb_friction:boom"); `sensor_fault` has one too.
/// @throws UsageError when there is no such effect, with a suggestion
std::string effect_entry(const std::string& id);
/// {"effects": [...]} with the same content, for one id or (empty) for all. @throws UsageError as above
std::string effects_json(const std::string& id = {});

}  // namespace sparflow
