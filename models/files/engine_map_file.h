#pragma once
/// Reads the map of an engine and its pump (YAML; docs/audit.md).
#include <string>

#include "models/hydraulics/engine_map.h"

namespace sparflow {

/// @throws InputError with file:line:column for what is missing, not ascending, of another shape or out of range
EngineMap load_engine_map(const std::string& path);
/// From memory. @param path name for messages  @throws InputError as above
EngineMap parse_engine_map(const std::string& path, const std::string& text);

}  // namespace sparflow
