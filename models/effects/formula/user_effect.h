#pragma once
/// Effects that users describe in YAML (models/effects/formula/effect_file.h) as effects of the catalogue.
#include <string>
#include <vector>

#include "models/effects/effect.h"

namespace sparflow {

/// Adds the effects of a text to the catalogue for this process. One that is there already with the same definition
/// (layout and comments aside) is kept.
/// @param file how messages call the text  @param machine joints and units of its laws are checked against it
/// @return the effects of the text, in its order
/// @throws InputError as parse_user_effects; when an id is taken by another effect. Nothing is added then.
std::vector<const Effect*> register_user_effects(const std::string& text, const std::string& file,
                                                 const Machine& machine);

/// The same from a file. @param machine nullptr: any joint passes, and only machines that have it get the effect
/// @throws InputError also when the file cannot be read
std::vector<const Effect*> register_user_effects_file(const std::string& path,
                                                      const Machine* machine = nullptr);

}  // namespace sparflow
