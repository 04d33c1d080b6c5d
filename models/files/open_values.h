#pragma once
/// What the reader of machine files and the reader of sketches share.
#include <string>

#include "models/files/cylinder_file.h"
#include "models/machine/machine.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {

/// Refuses a machine file with open values, naming all of them and the verb that finds them. @param text of the file
/// @throws InputError at the first one
void refuse_open_values(const YamlValue& root, const std::string& text);

/// Reads a machine without checks of the whole machine. @param frames gets the frames of the file's points
Machine parse_unchecked_machine(const std::string& text, const std::string& name,
                                const std::string& folder, FileFrames* frames);

}  // namespace sparflow
