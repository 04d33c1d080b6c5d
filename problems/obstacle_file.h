#pragma once
/// One entry of a problem file's `obstacles`.
#include "models/yaml/yaml_reader.h"
#include "problems/problem.h"

namespace sparflow {

/// @param number position in the list, from 1; names an obstacle that has no name
/// @throws InputError
Obstacle read_obstacle(const YamlValue& value, int number);

}  // namespace sparflow
