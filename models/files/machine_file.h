#pragma once
/// Reads a machine file (YAML); every key is described in docs/machine_file.md.
#include <string>
#include <vector>

#include "models/machine/machine.h"

namespace sparflow {

/// @param warnings gets one sentence for everything unusual but possible; may be null
/// @throws InputError with file:line:column, key path, what was found, what was expected and what to do
Machine load_machine(const std::string& path, std::vector<std::string>* warnings = nullptr);

/// The same from text, as a fitted model contains it.
/// @param name of the text in messages  @param folder base of relative paths in it (`kinematics.urdf`)
/// `source_text` of the result is complete: joints and links of a URDF are written out in it.
Machine parse_machine(const std::string& text, const std::string& name, const std::string& folder,
                      std::vector<std::string>* warnings = nullptr);

/// The machine as the text of a machine file, every number with all its digits.
std::string write_machine(const Machine& machine);

}  // namespace sparflow
