#include "studies/mapping/disguise.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "identification/log/log_columns.h"
#include "models/math/units.h"

namespace sparflow::study {
namespace {

using simulator::Random;

struct Unit {
  std::string word;
  double factor;  ///< SI of one unit
};

struct Quantity {
  std::vector<Unit> units;  ///< the usual first
};

std::string german_part(const std::string& part) {
  static const std::vector<std::array<const char*, 2>> kParts = {
      {"boom", "Hubarm"},        {"main", "Hauptarm"},      {"jib", "Knickarm"},
      {"extension", "Teleskop"}, {"telescope", "Teleskop"}, {"slew", "Schwenkwerk"},
      {"swing", "Drehwerk"},     {"stick", "Stiel"},        {"bucket", "Löffel"},
      {"lift", "Heben"},         {"cross", "Quer"},         {"reach", "Ausschub"}};
  for (const auto& [own, german] : kParts) {
    if (part == own) return german;
  }
  return part;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 32 : c);
  return text;
}

std::string part_of(const Meaning& m, const Machine& machine) {
  if (m.index < 0) return "";
  const auto at = static_cast<std::size_t>(m.index);
  if (m.role == Role::kJointPosition) return machine.joints[at].name;
  if (m.role == Role::kPumpPressure) return machine.pumps[at].name;
  return machine.cylinders[at].name;
}

/// A name in one of three ways of writing, without unit.
// Over 80 lines because it is a table of names.
std::string other_name(const Meaning& m, const Machine& machine, Names names) {
  const std::string part = part_of(m, machine);
  const bool one_pump = machine.pump_count() == 1;
  if (names == Names::kGerman) {
    const std::string p = german_part(part);
    switch (m.role) {
      case Role::kJointPosition:
        return machine.joints[static_cast<std::size_t>(m.index)].type == JointType::kRevolute
                   ? "Winkel " + p
                   : "Weg " + p;
      case Role::kStroke:
        return "Hub Zylinder " + p;
      case Role::kCommand:
        return "Joystick " + p;
      case Role::kPressureA:
        return "Druck Kolben " + p;
      case Role::kPressureB:
        return "Druck Stange " + p;
      case Role::kFlow:
        return "Volumenstrom " + p;
      case Role::kForce:
        return "Kraft " + p;
      case Role::kPumpPressure:
        return one_pump ? "Pumpendruck" : "Pumpendruck " + p;
      case Role::kReturnPressure:
        return "Druck Rücklauf";
      case Role::kPayload:
        return "Nutzlast";
      default:
        return "Öltemperatur";
    }
  }
  std::string p = part;
  if (!p.empty()) p[0] = upper(p.substr(0, 1))[0];
  if (names == Names::kEnglish) {
    switch (m.role) {
      case Role::kJointPosition:
        return p + " Position";
      case Role::kStroke:
        return p + " Cylinder Stroke";
      case Role::kCommand:
        return p + " Lever";
      case Role::kPressureA:
        return p + " Cyl Bore Pressure";
      case Role::kPressureB:
        return p + " Cyl Rod Pressure";
      case Role::kFlow:
        return p + " Flow";
      case Role::kForce:
        return p + " Force";
      case Role::kPumpPressure:
        return one_pump ? "Pump Pressure" : p + " Pump Pressure";
      case Role::kReturnPressure:
        return "Tank Line Pressure";
      case Role::kPayload:
        return "Payload";
      default:
        return "Hydraulic Oil Temp";
    }
  }
  const std::string s = upper(part.substr(0, 3));
  switch (m.role) {
    case Role::kJointPosition:
      return "POS_" + s;
    case Role::kStroke:
      return "LEN_" + s;
    case Role::kCommand:
      return "JOY_" + s;
    case Role::kPressureA:
      return "P_" + s + "_A";
    case Role::kPressureB:
      return "P_" + s + "_B";
    case Role::kFlow:
      return "Q_" + s;
    case Role::kForce:
      return "F_" + s;
    case Role::kPumpPressure:
      return one_pump ? "P_PMP" : "P_PMP_" + s;
    case Role::kReturnPressure:
      return "P_T";
    case Role::kPayload:
      return "LOAD";
    default:
      return "OILT";
  }
}

Quantity quantity_of_meaning(const Meaning& m, const Machine& machine) {
  switch (m.role) {
    case Role::kJointPosition:
      if (machine.joints[static_cast<std::size_t>(m.index)].type == JointType::kRevolute)
        return {{{"rad", 1.0}, {"deg", units::kDegree}}};
      return {{{"m", 1.0}, {"mm", 1e-3}}};
    case Role::kStroke:
      return {{{"m", 1.0}, {"mm", 1e-3}}};
    case Role::kCommand:
      return {{{"-", 1.0}, {"%", 0.01}, {"mA", 0.125}}};
    case Role::kFlow:
      return {{{"l/min", units::kLitrePerMinute}, {"l/s", 1e-3}}};
    case Role::kForce:
      return {{{"N", 1.0}, {"kN", 1e3}}};
    case Role::kPayload:
      return {{{"kg", 1.0}, {"t", 1e3}}};
    case Role::kOilTemperature:
      return {{{"degC", 1.0}}};
    default:
      return {{{"bar", units::kBar}, {"psi", 6894.757293168361}, {"MPa", 1e6}}};
  }
}

struct Made {
  RecordedChannel channel;
  Meaning meaning;
  bool meant = false;
  double factor = 0.0;
};

/// Noise, slow drift and copies that have no meaning of their own.
void add_distractors(const std::vector<double>& time, bool named, Random& random,
                     std::vector<Made>* all) {
  const std::size_t n = time.size();
  const auto add = [&](const std::string& name, const std::string& unit, auto value) {
    Made made;
    made.channel.name = name;
    made.channel.unit = unit;
    made.channel.time = time;
    made.channel.values.reserve(n);
    for (std::size_t i = 0; i < n; ++i) made.channel.values.push_back(value(i));
    all->push_back(std::move(made));
  };
  double speed = 1500.0;
  add("Engine Speed", "rpm", [&](std::size_t) {
    speed += 0.02 * (1600.0 - speed) + 6.0 * random.normal();
    return std::round(speed);
  });
  add("Battery", "V", [&](std::size_t) { return 27.6 + 0.05 * random.normal(); });
  const double start = random.uniform(60.0, 80.0);
  add("Coolant Temperature", "degC", [&](std::size_t i) {
    return start + 8.0 * (1.0 - std::exp(-time[i] / 200.0)) + 0.1 * random.normal();
  });
  const std::size_t real = all->size() - 3;
  for (int copy = 0; copy < 2; ++copy) {
    const Made& original = (*all)[static_cast<std::size_t>(random.below(static_cast<int>(real)))];
    const auto [lo, hi] =
        std::minmax_element(original.channel.values.begin(), original.channel.values.end());
    const double noise = 0.02 * (*hi - *lo);
    const std::size_t lag =
        static_cast<std::size_t>(random.uniform(0.2, 0.6) / (time[1] - time[0]));
    const std::vector<double> values = original.channel.values;
    add(original.channel.name + (named ? " filtered" : ""), original.channel.unit,
        [&](std::size_t i) { return values[i >= lag ? i - lag : 0] + noise * random.normal(); });
    (*all).back().channel.name += copy == 0 ? "" : " 2";
  }
}

}  // namespace

DisguisedLog disguised_log(const std::vector<LogColumn>& columns, const Machine& machine,
                           const Disguise& disguise, Random random) {
  std::vector<double> time;
  std::vector<Made> all;
  const int pressure = random.below(3), angle = random.below(2), length = random.below(2),
            command = random.below(3);
  for (const LogColumn& column : columns) {
    const ColumnMeaning own = column_meaning(column.name, "", machine);
    if (own.is_time) time = column.values;
  }
  for (const LogColumn& column : columns) {
    const ColumnMeaning own = column_meaning(column.name, "", machine);
    if (own.is_time) continue;
    Made made;
    made.channel.time = time;
    made.meaning = {own.role, own.index};
    made.meant = own.role != Role::kCandidate;
    Unit unit = {"", own.factor};
    if (made.meant) {
      const std::vector<Unit> units = quantity_of_meaning(made.meaning, machine).units;
      std::size_t pick = 0;
      if (disguise.other_units) {
        const std::string& usual = units.front().word;
        pick = static_cast<std::size_t>(usual == "bar"   ? pressure
                                        : usual == "rad" ? angle
                                        : usual == "m"   ? length
                                        : usual == "-"   ? command
                                                         : 0);
      }
      unit = units[pick];
      made.factor = unit.factor;
      made.channel.name = other_name(made.meaning, machine, disguise.names);
    } else {
      made.channel.name = column.name;
    }
    made.channel.unit = unit.word == "-" ? "" : unit.word;
    // A current of 4 to 20 mA stands for the command.
    const double neutral = unit.word == "mA" ? 12.0 : 0.0;
    made.channel.values.reserve(column.values.size());
    for (const double v : column.values)
      made.channel.values.push_back(neutral + (own.factor * v + (made.meant ? own.offset : 0.0)) /
                                                  unit.factor);
    all.push_back(std::move(made));
  }
  const bool anonymous = disguise.names == Names::kUnitsOnly || disguise.names == Names::kAnonymous;
  if (disguise.distractors) add_distractors(time, !anonymous, random, &all);
  for (std::size_t k = all.size(); k > 1; --k)
    std::swap(all[k - 1], all[static_cast<std::size_t>(random.below(static_cast<int>(k)))]);
  DisguisedLog out;
  out.file.recording.file = "log";
  out.file.clock = "time";
  for (std::size_t k = 0; k < all.size(); ++k) {
    Made& made = all[k];
    if (anonymous) made.channel.name = fmt::format("ch{:02d}", k + 1);
    if (disguise.names == Names::kAnonymous) made.channel.unit.clear();
    if (disguise.names == Names::kAbbreviated && random.chance(0.5)) made.channel.unit.clear();
    if (made.meant) {
      out.truth.push_back({made.meaning, static_cast<int>(k),
                           made.meaning.role == Role::kCommand ? 0.0 : made.factor});
    }
    out.file.recording.channels.push_back(std::move(made.channel));
  }
  return out;
}

}  // namespace sparflow::study
