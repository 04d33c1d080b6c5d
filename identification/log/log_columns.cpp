#include "identification/log/log_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "identification/log/log_dialect.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

struct ColumnUnit {
  std::string_view spelling;
  double factor;
  double offset = 0.0;
};

struct ColumnQuantity {
  std::string_view what;  ///< with article, for messages
  std::string_view si;
  std::string_view usual;  ///< suffix of the usual column name
  std::vector<ColumnUnit> units;
};

// Spellings are compared after `plain_unit`.
const ColumnQuantity kTime = {
    "a time", "s", "s", {{"s", 1.0}, {"sec", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"min", 60.0}}};
const ColumnQuantity kAngle = {
    "an angle", "rad", "rad", {{"rad", 1.0}, {"deg", units::kDegree}, {"mrad", 1e-3}}};
const ColumnQuantity kLength = {"a length", "m", "m", {{"m", 1.0}, {"mm", 1e-3}, {"cm", 1e-2}}};
const ColumnQuantity kCommand = {
    "a command",
    "",
    "",
    {{"", 1.0}, {"1", 1.0}, {"percent", 0.01}, {"pct", 0.01}, {"permille", 1e-3}}};
const ColumnQuantity kPressure = {"a pressure",
                                  "Pa",
                                  "bar",
                                  {{"bar", units::kBar},
                                   {"mbar", 100.0},
                                   {"Pa", 1.0},
                                   {"kPa", 1e3},
                                   {"MPa", 1e6},
                                   {"psi", 6894.757293168361}}};
const ColumnQuantity kForce = {"a force", "N", "N", {{"N", 1.0}, {"kN", 1e3}}};
const ColumnQuantity kFlow = {
    "a flow",
    "m^3/s",
    "lpm",
    {{"lpm", units::kLitrePerMinute}, {"m3_s", 1.0}, {"l_s", 1e-3}, {"m3_h", 1.0 / 3600.0}}};
const ColumnQuantity kMass = {
    "a mass", "kg", "kg", {{"kg", 1.0}, {"t", 1e3}, {"g", 1e-3}, {"lb", 0.45359237}}};
const ColumnQuantity kTemperature = {
    "a temperature",
    "degC",
    "C",
    {{"C", 1.0}, {"K", 1.0, -273.15}, {"F", 5.0 / 9.0, -160.0 / 9.0}}};

/// Converts common spellings of units to those of column suffixes: "l/min" -> "lpm", "°" -> "deg".
std::string plain_unit(std::string_view written) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 26> kSpellings = {
      {{"l/min", "lpm"},  {"L/min", "lpm"}, {"l_min", "lpm"},  {"LPM", "lpm"},     {"Lpm", "lpm"},
       {"m^3/s", "m3_s"}, {"m3/s", "m3_s"}, {"m³/s", "m3_s"},  {"l/s", "l_s"},     {"m3/h", "m3_h"},
       {"m^3/h", "m3_h"}, {"°", "deg"},     {"degree", "deg"}, {"degrees", "deg"}, {"Deg", "deg"},
       {"°C", "C"},       {"degC", "C"},    {"°F", "F"},       {"%", "percent"},   {"Bar", "bar"},
       {"BAR", "bar"},    {"pa", "Pa"},     {"mpa", "MPa"},    {"µs", "us"},       {"Rad", "rad"},
       {"-", ""}}};
  for (const auto& [from, to] : kSpellings) {
    if (written == from) return std::string(to);
  }
  return std::string(written);
}

const ColumnUnit* find_unit(const ColumnQuantity& quantity, std::string_view written) {
  const std::string plain = plain_unit(written);
  for (const ColumnUnit& unit : quantity.units) {
    if (unit.spelling == plain) return &unit;
  }
  return nullptr;
}

std::string unit_list(const ColumnQuantity& quantity) {
  std::string list;
  for (const ColumnUnit& unit : quantity.units) {
    if (unit.spelling == "1") continue;
    if (!list.empty()) list += ", ";
    list += unit.spelling.empty() ? "none" : unit.spelling;
  }
  return list;
}

/// Splits "pA_boom [bar]" into "pA_boom" and the unit "bar".
std::string without_bracket(const std::string& name, std::string* unit) {
  const std::string_view text = trimmed(name);
  if (text.size() < 3 || (text.back() != ']' && text.back() != ')')) return std::string(text);
  const std::size_t open = text.rfind(text.back() == ']' ? '[' : '(');
  if (open == text.npos || open == 0) return std::string(text);
  *unit = std::string(trimmed(text.substr(open + 1, text.size() - open - 2)));
  return std::string(trimmed(text.substr(0, open)));
}

/// A family of columns: a prefix and the names of the machine's parts that may follow it.
struct Family {
  Role role;
  std::string_view prefix;
  std::vector<std::string> parts;
};

std::vector<Family> families(const Machine& machine) {
  std::vector<std::string> joints, cylinders, pumps;
  for (const Joint& joint : machine.joints) joints.push_back(joint.name);
  for (const Cylinder& cylinder : machine.cylinders) cylinders.push_back(cylinder.name);
  for (const Pump& pump : machine.pumps) pumps.push_back(pump.name);
  return {{Role::kJointPosition, "q_", joints}, {Role::kStroke, "x_", cylinders},
          {Role::kCommand, "u_", cylinders},    {Role::kPressureA, "pA_", cylinders},
          {Role::kPressureB, "pB_", cylinders}, {Role::kForce, "force_", cylinders},
          {Role::kFlow, "Q_", cylinders},       {Role::kPumpPressure, "p_", pumps}};
}

struct Single {
  std::string_view name;
  Role role;
};
constexpr std::array<Single, 3> kSingles = {{{"payload", Role::kPayload},
                                             {"oil", Role::kOilTemperature},
                                             {"p_return", Role::kReturnPressure}}};

const ColumnQuantity& quantity_of(Role role, int index, const Machine& machine) {
  switch (role) {
    case Role::kJointPosition:
      return machine.joints[static_cast<std::size_t>(index)].type == JointType::kRevolute ? kAngle
                                                                                          : kLength;
    case Role::kStroke:
      return kLength;
    case Role::kPressureA:
    case Role::kPressureB:
    case Role::kPumpPressure:
    case Role::kReturnPressure:
      return kPressure;
    case Role::kForce:
      return kForce;
    case Role::kFlow:
      return kFlow;
    case Role::kPayload:
      return kMass;
    case Role::kOilTemperature:
      return kTemperature;
    case Role::kCommand:
    case Role::kCandidate:
      break;
  }
  return kCommand;
}

/// @return the suffix of `name` after `stem`, without its underscore; nullopt when `name` does not continue so
std::optional<std::string_view> suffix_behind(std::string_view name, std::string_view stem) {
  if (!name.starts_with(stem)) return std::nullopt;
  name.remove_prefix(stem.size());
  if (name.empty()) return name;
  if (name.front() != '_') return std::nullopt;
  return name.substr(1);
}

/// Determines the unit of a column whose quantity is known.
/// @return false when the suffix shows that it is another signal: "pA_boom_valve_bar", "u_boom_filtered_percent"
bool settle_unit(const ColumnQuantity& quantity, std::string_view suffix, const std::string& beside,
                 const std::string& column, ColumnMeaning* meaning) {
  const ColumnUnit* unit = find_unit(quantity, suffix);
  meaning->unit = quantity.si;
  if (suffix.empty()) {
    unit = beside.empty() ? find_unit(quantity, "") : find_unit(quantity, beside);
    if (unit == nullptr) {
      meaning->error = beside.empty()
                           ? fmt::format("no unit, expected e.g. \"{}_{}\"", column, quantity.usual)
                           : fmt::format("unit \"{}\" is not known for {}, expected one of: {}",
                                         beside, quantity.what, unit_list(quantity));
      return true;
    }
  } else if (unit == nullptr) {
    const std::size_t last = suffix.rfind('_');
    if (last != suffix.npos) return false;
    meaning->error = fmt::format("unit \"{}\" is not known for {}, expected one of: {}", suffix,
                                 quantity.what, unit_list(quantity));
    return true;
  } else if (!beside.empty()) {
    const ColumnUnit* other = find_unit(quantity, beside);
    if (other != unit) {
      meaning->error = fmt::format(
          "the name says \"{}\" and the unit given with it is \"{}\"; "
          "rename the column or correct the unit",
          suffix, beside);
      return true;
    }
  }
  meaning->factor = unit->factor;
  meaning->offset = unit->offset;
  return true;
}

/// Interprets a column without a role: it keeps its name, and a unit that is recognised is converted.
void settle_candidate(const std::string& column, const std::string& beside,
                      ColumnMeaning* meaning) {
  *meaning = ColumnMeaning{};
  meaning->signal = column;
  std::string_view suffix = beside;
  if (beside.empty()) {
    const std::size_t mark = column.rfind('_');
    if (mark == column.npos || mark == 0) return;
    suffix = std::string_view(column).substr(mark + 1);
    if (suffix == "s" && column.ends_with("_m3_s")) suffix = "m3_s";
  }
  for (const ColumnQuantity* quantity :
       {&kPressure, &kAngle, &kLength, &kForce, &kFlow, &kTemperature}) {
    const ColumnUnit* unit = find_unit(*quantity, suffix);
    // "_K" and "_F" after an unknown name may equally mean a gain or a force.
    if (unit == nullptr || (beside.empty() && unit->offset != 0.0)) continue;
    meaning->unit = quantity->si;
    meaning->factor = unit->factor;
    meaning->offset = unit->offset;
    if (beside.empty()) meaning->signal = column.substr(0, column.size() - suffix.size() - 1);
    return;
  }
  meaning->unit = beside;
}

/// @return the standard name that the column resembles (misspelled part, prefix in the wrong case), or ""
std::string suggest(const std::string& column, const Machine& machine) {
  const auto lower = [](std::string text) {
    for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    return text;
  };
  for (const std::string& usual : usual_names(machine)) {
    if (lower(usual) == lower(column)) return usual;
  }
  for (const Family& family : families(machine)) {
    if (!column.starts_with(family.prefix)) continue;
    const std::string rest = column.substr(family.prefix.size());
    const std::string part = rest.substr(0, rest.rfind('_'));
    const std::string near = nearest_word(part, family.parts);
    // Short names resemble many words, so for them the length must be equal.
    if (near.empty() || (near.size() < 4 && near.size() != part.size())) continue;
    const auto index = std::find(family.parts.begin(), family.parts.end(), near);
    return usual_name(family.role, static_cast<int>(index - family.parts.begin()), machine);
  }
  return "";
}

}  // namespace

ColumnMeaning column_meaning(const std::string& name, const std::string& unit_below,
                             const Machine& machine) {
  std::string beside = unit_below;
  const std::string column = without_bracket(name, &beside);
  ColumnMeaning meaning;
  if (const auto suffix = suffix_behind(column, "t")) {
    meaning.is_time = true;
    meaning.signal = "t";
    if (settle_unit(kTime, *suffix, beside, column, &meaning)) return meaning;
  }
  // The longest matching name is taken, because a machine may have both "boom" and "boom_2".
  std::string_view best_suffix;
  std::size_t best_length = 0;
  const auto consider = [&](const std::string& stem, Role role, int index) {
    const auto suffix = suffix_behind(column, stem);
    if (!suffix || stem.size() <= best_length) return;
    best_length = stem.size();
    best_suffix = *suffix;
    meaning.role = role;
    meaning.index = index;
    meaning.signal = stem;
  };
  meaning = ColumnMeaning{};
  for (const Family& family : families(machine)) {
    for (std::size_t i = 0; i < family.parts.size(); ++i) {
      consider(std::string(family.prefix) + family.parts[i], family.role, static_cast<int>(i));
    }
  }
  for (const Single& single : kSingles) consider(std::string(single.name), single.role, -1);
  if (best_length > 0 && settle_unit(quantity_of(meaning.role, meaning.index, machine), best_suffix,
                                     beside, column, &meaning)) {
    return meaning;
  }
  const bool had_part = best_length > 0;
  settle_candidate(column, beside, &meaning);
  if (!had_part) meaning.suggestion = suggest(column, machine);
  return meaning;
}

std::string usual_name(Role role, int index, const Machine& machine) {
  for (const Single& single : kSingles) {
    if (single.role == role) {
      return fmt::format("{}_{}", single.name, quantity_of(role, index, machine).usual);
    }
  }
  for (const Family& family : families(machine)) {
    if (family.role != role) continue;
    const ColumnQuantity& quantity = quantity_of(role, index, machine);
    return fmt::format("{}{}{}{}", family.prefix, family.parts[static_cast<std::size_t>(index)],
                       quantity.usual.empty() ? "" : "_", quantity.usual);
  }
  return "";
}

std::vector<std::string> usual_names(const Machine& machine) {
  std::vector<std::string> names = {"t_s"};
  for (const Family& family : families(machine)) {
    for (std::size_t i = 0; i < family.parts.size(); ++i) {
      names.push_back(usual_name(family.role, static_cast<int>(i), machine));
    }
  }
  for (const Single& single : kSingles) names.push_back(usual_name(single.role, -1, machine));
  return names;
}

}  // namespace sparflow
