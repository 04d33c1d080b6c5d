#pragma once
/// Reads the section `plant:` of a file of its own (YAML): numbers that replace default_parameters. Keys, units and bounds are
/// those of parameter_table.h; `cylinders:` and `pumps:` hold names of the machine file, or `all`.
#include <string>

#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow::plant {

/// @throws InputError with file:line:column, key, what was found and what was expected
void load_plant_file(const std::string& path, const Machine& machine, PlantParameters& parameters);
/// The same from text. @param name of the text in messages
void parse_plant_file(const std::string& text, const std::string& name, const Machine& machine,
                      PlantParameters& parameters);

}  // namespace sparflow::plant
