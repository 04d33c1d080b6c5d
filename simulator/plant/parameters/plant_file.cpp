#include "simulator/plant/parameters/plant_file.h"

#include <fmt/format.h>

#include <functional>

#include "models/math/error.h"
#include "models/yaml/yaml_reader.h"
#include "simulator/plant/parameters/parameter_table.h"

namespace sparflow::plant {
namespace {

std::vector<std::string> keys_of(Place place, std::vector<std::string> further = {}) {
  for (const ParameterRow& row : parameter_table())
    if (row.place == place) further.emplace_back(row.key);
  return further;
}

/// Sets one number. @param indices of the cylinders or pumps it applies to
void set_value(const std::string& key, const YamlValue& value,
               const std::vector<std::size_t>& indices, PlantParameters& parameters) {
  const ParameterRow& row = *find_parameter(key);
  const std::string text(row.text), unit(row.unit);
  const Quantity what{text.c_str(), unit.c_str(), Quantity::Sign::kAny, 1.0, 0.0};
  const double number = value.number(what);
  if (number < row.lowest || number > row.highest)
    value.fail(fmt::format("got {:g}, expected {} from {:g} to {:g} [{}]", number, row.text,
                           row.lowest, row.highest, row.unit));
  for (const std::size_t i : indices) row.value(parameters, i) = number * row.scale;
}

/// The part of the file for cylinders or pumps. @param index_of of a name, -1 when unknown
void read_places(const YamlValue& value, Place place, std::size_t count,
                 const std::function<int(const std::string&)>& index_of,
                 PlantParameters& parameters) {
  const std::vector<std::string> keys = keys_of(place);
  std::vector<std::size_t> every(count);
  for (std::size_t i = 0; i < count; ++i) every[i] = i;
  const YamlMap map = value.map("names, or all", {});
  // `all` first, wherever it stands, so that a name's own numbers prevail
  for (const bool all : {true, false}) {
    for (const auto& [name, numbers] : map.entries()) {
      if ((name == "all") != all) continue;
      std::vector<std::size_t> indices = every;
      if (!all) {
        const int i = index_of(name);
        if (i < 0) numbers.fail(fmt::format("the machine has no \"{}\" here", name));
        indices = {static_cast<std::size_t>(i)};
      }
      for (const auto& [key, number] : numbers.map("parameters", keys).entries())
        set_value(key, number, indices, parameters);
    }
  }
}

}  // namespace

void parse_plant_file(const std::string& text, const std::string& name, const Machine& machine,
                      PlantParameters& parameters) {
  const YamlMap file = parse_yaml(text, name).map("a plant file", {"plant"});
  const YamlMap plant =
      file.need("plant", "the plant's parameters")
          .map("the plant's parameters", keys_of(Place::kPlant, {"cylinders", "pumps"}));
  for (const auto& [key, value] : plant.entries()) {
    if (key == "cylinders") {
      read_places(
          value, Place::kCylinder, machine.cylinders.size(),
          [&](const std::string& n) { return machine.cylinder_index(n); }, parameters);
    } else if (key == "pumps") {
      read_places(
          value, Place::kPump, machine.pumps.size(),
          [&](const std::string& n) { return machine.pump_index(n); }, parameters);
    } else {
      set_value(key, value, {0}, parameters);
    }
  }
}

void load_plant_file(const std::string& path, const Machine& machine, PlantParameters& parameters) {
  parse_plant_file(read_file(path), path, machine, parameters);
}

}  // namespace sparflow::plant
