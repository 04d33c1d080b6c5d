#pragma once
/// The effects of the dynamic plant that can be switched: one table that `sparflow simulate --effects` and its help read.
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "simulator/plant/parameters/parameter_table.h"

namespace sparflow::plant {

struct PlantEffect {
  std::string_view name;
  std::string_view key;  ///< the parameter that switches it and takes a value
  double off;       ///< in the parameter's unit: the value with which the effect is not noticed
  bool from_start;  ///< on where `--effects` says nothing of it
  std::string_view text;
};

std::span<const PlantEffect> plant_effects();

/// One item of `--effects`: `none`, `all`, or NAME[:AT][=VALUE], with `off` as a value, too.
struct EffectSetting {
  std::string name;
  std::string at;     ///< cylinder or pump; empty: each
  std::string value;  ///< empty: nominal
};

/// @throws UsageError when an item has another form
EffectSetting parse_effect(const std::string& item);

/// Nominal values of the effects that are on from the start, the others off; then the items in their order.
/// @param parameters nominal values in, the plant's out
/// @throws UsageError that names what is unknown, with the nearest known name
void apply_effects(const Machine& machine, const std::vector<EffectSetting>& items,
                   PlantParameters& parameters);

/// One line for each effect: name, nominal value, text. @param parameters nominal
std::string effects_help();

}  // namespace sparflow::plant
