#include "models/files/engine_map_file.h"

#include <fmt/format.h>

#include "models/files/file_quantities.h"
#include "models/math/door.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Sign = Quantity::Sign;

// no threshold: units
constexpr double kCubicMetresPerLitre = 1e-3;
constexpr double kSecondsPerHour = 3600.0;
constexpr double kGramsPerKilogram = 1e3;
constexpr double kWattsPerKilowatt = 1e3;

// no threshold: units, and sizes beyond which a value has another unit than it should
constexpr Quantity kPower{"power at the shaft", "kW", Sign::kNonNegative, kWattsPerKilowatt, 1e5};
constexpr Quantity kFuel{"fuel", "l/h", Sign::kNonNegative, kCubicMetresPerLitre / kSecondsPerHour,
                         1e5};
constexpr Quantity kConsumption{"consumption", "g/kWh", Sign::kPositive, 1.0, 1e5};
constexpr Quantity kDensity{"density", "kg/l", Sign::kPositive, 1.0, 100.0};
constexpr Quantity kMapFlow{"flow", "l/min", Sign::kNonNegative, units::kLitrePerMinute};
constexpr Quantity kMapPressure{"pressure", "bar", Sign::kNonNegative, units::kBar, 1e4};
constexpr Quantity kEfficiency{"efficiency", "", Sign::kPositive, 1.0, 1.0 + 1e-9};
/// Values of a map's row or column.
/// @threshold [values] 1..1e6; chosen: far beyond a maker's data sheet
constexpr int kMostValues = 1000;

Eigen::VectorXd numbers(const YamlValue& value, const Quantity& what) {
  const std::vector<YamlValue> list =
      value.list(fmt::format("a list of numbers [{}]", what.unit), kMostValues);
  Eigen::VectorXd out(static_cast<Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) out[static_cast<Index>(i)] = list[i].number(what);
  return out;
}

Eigen::VectorXd ascending(const YamlValue& value, const Quantity& what) {
  Eigen::VectorXd out = numbers(value, what);
  if (out.size() == 0) value.fail("the list is empty");
  for (Index i = 1; i < out.size(); ++i)
    if (out[i] <= out[i - 1])
      value.fail(fmt::format(
          "value {} is not larger than the one before; list them in ascending order", i + 1));
  return out;
}

void read_engine(const YamlMap& engine, EngineMap* map) {
  const YamlValue power = engine.need("power_kW", "powers at the shaft in ascending order [kW]");
  map->power = ascending(power, kPower);
  const auto litres = engine.find("fuel_l_h");
  const auto grams = engine.find("consumption_g_kWh");
  if (litres.has_value() == grams.has_value())
    engine.fail(
        "give either fuel_l_h [l/h] or consumption_g_kWh [g/kWh], one value for each power");
  const YamlValue& given = litres ? *litres : *grams;
  map->fuel = numbers(given, litres ? kFuel : kConsumption);
  if (map->fuel.size() != map->power.size())
    given.fail(fmt::format("has {} values, power_kW has {}; give one for each power",
                           map->fuel.size(), map->power.size()));
  if (litres) return;
  // grams for each kWh, times the power, over the density
  const double density = engine.need_number("density_kg_l", kDensity);
  for (Index i = 0; i < map->fuel.size(); ++i) {
    const double litres_per_kWh = map->fuel[i] / kGramsPerKilogram / density;
    map->fuel[i] = litres_per_kWh * kCubicMetresPerLitre * map->power[i] /
                   (kWattsPerKilowatt * kSecondsPerHour);
  }
  const double idle =
      engine.need_number("idle_l_h", kFuel);  // at no power, where grams for each kWh say nothing
  if (map->power[0] > 0.0) {
    Eigen::VectorXd powers(map->power.size() + 1), fuels(map->power.size() + 1);
    powers << 0.0, map->power;
    fuels << idle, map->fuel;
    map->power = powers;
    map->fuel = fuels;
  } else {
    map->fuel[0] = idle;
  }
}

void read_pump(const YamlMap& pump, EngineMap* map) {
  const YamlValue efficiency =
      pump.need("efficiency", "a number, or a list of lists: a row for each pressure");
  if (!efficiency.is_list()) {
    map->pressure = map->flow = Eigen::VectorXd::Zero(1);
    map->efficiency = Eigen::MatrixXd::Constant(1, 1, efficiency.number(kEfficiency));
    return;
  }
  map->pressure =
      ascending(pump.need("pressure_bar", "pressures in ascending order [bar]"), kMapPressure);
  map->flow = ascending(pump.need("flow_lpm", "flows in ascending order [l/min]"), kMapFlow);
  map->efficiency.resize(map->pressure.size(), map->flow.size());
  const std::vector<YamlValue> rows = efficiency.list("a row for each pressure", kMostValues);
  if (static_cast<Index>(rows.size()) != map->pressure.size())
    efficiency.fail(
        fmt::format("has {} rows, pressure_bar has {} values; give a row for each pressure",
                    rows.size(), map->pressure.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::VectorXd row = numbers(rows[i], kEfficiency);
    if (row.size() != map->flow.size())
      rows[i].fail(fmt::format("has {} values, flow_lpm has {}; give one for each flow", row.size(),
                               map->flow.size()));
    map->efficiency.row(static_cast<Index>(i)) = row.transpose();
  }
}

}  // namespace

EngineMap parse_engine_map(const std::string& path, const std::string& text) {
  const YamlMap file = parse_yaml(text, path).map("a map of engine and pump", {"engine", "pump"});
  EngineMap map;
  read_engine(file.need("engine", "power_kW and fuel_l_h")
                  .map("an engine",
                       {"power_kW", "fuel_l_h", "consumption_g_kWh", "density_kg_l", "idle_l_h"}),
              &map);
  read_pump(
      file.need("pump", "efficiency").map("a pump", {"efficiency", "pressure_bar", "flow_lpm"}),
      &map);
  return map;
}

EngineMap load_engine_map(const std::string& path) {
  return parse_engine_map(path, read_text(path));
}

}  // namespace sparflow
