#pragma once
/// Checks an XML text before the XML library reads it.
#include <string>

namespace sparflow {

/// Checks that elements are closed in their order, within the depth of DoorLimits, and counts those that a robot
/// description is made of. The library behind URDF calls itself at each level of nesting, without a limit, and names no
/// line in its messages.
/// @param file name of the text in messages
/// @throws InputError with the line of the first element that is not closed, closed wrongly, nested too deeply or too many
void check_xml(const std::string& text, const std::string& file);

}  // namespace sparflow
