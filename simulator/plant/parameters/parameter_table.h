#pragma once
/// Every parameter of the dynamic plant in one table: name, unit, bounds, typical value, meaning, source. The reader of plant
/// files, `--effects`, and docs/plant.md take their words from here.
#include <span>
#include <string>
#include <string_view>

#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow::plant {

enum class Place { kPlant, kCylinder, kPump };

struct ParameterRow {
  Place place;
  std::string_view key;      ///< in a plant file; a unit that is not SI is its last part
  std::string_view unit;     ///< of the number in the file
  double scale;              ///< SI value = number in the file * scale
  double lowest, highest;    ///< in the file's unit
  std::string_view typical;  ///< in words: value, or the rule that sizes it
  std::string_view text;     ///< what it is
  std::string_view source;
  double& (*value)(PlantParameters&, std::size_t);  ///< SI; the index of the cylinder or pump
};

std::span<const ParameterRow> parameter_table();
/// The row, or null.
const ParameterRow* find_parameter(std::string_view key);

/// The table as the Markdown of docs/plant.md.
std::string parameter_markdown();

}  // namespace sparflow::plant
