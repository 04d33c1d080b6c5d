#pragma once
/// Turns effects that users describe in YAML (models/effects/formula/effect_file.h) into effects of the catalogue.
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// Adds the effects of a text to the catalogue until the program ends. One that is there already with the same definition
/// (apart from layout and comments) is kept.
/// @param file name of the text in messages  @param machine joints and units of its laws are checked against it
/// @return the effects of the text, in its order
/// @throws InputError as parse_user_effects, and when another effect has the id; nothing is added then
std::vector<const Effect*> register_user_effects(const std::string& text, const std::string& file,
                                                 const Machine& machine);

/// The same from a file. @param machine nullptr: any joint is accepted, and only machines that have it get the effect
/// @throws InputError also when the file cannot be read
std::vector<const Effect*> register_user_effects_file(const std::string& path,
                                                      const Machine* machine = nullptr);

}  // namespace sparflow
