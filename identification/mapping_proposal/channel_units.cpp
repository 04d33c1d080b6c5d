/// Units of channels: spellings, quantities, and what may be meant where none is given.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "identification/mapping_proposal/channel_words.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Of = ChannelUnit::Of;

struct Spelling {
  std::string_view text;  ///< lower case, but for those in which the case decides
  ChannelUnit unit;
};

const std::vector<Spelling>& spellings() {
  constexpr double kPsi = 6894.757293168361, kLitre = units::kLitrePerMinute;
  static const std::vector<Spelling> all = {
      {"s", {Of::kTime, 1.0, 0.0, "s"}},
      {"sec", {Of::kTime, 1.0, 0.0, "s"}},
      {"ms", {Of::kTime, 1e-3, 0.0, "ms"}},
      {"us", {Of::kTime, 1e-6, 0.0, "us"}},
      {"µs", {Of::kTime, 1e-6, 0.0, "us"}},
      {"ns", {Of::kTime, 1e-9, 0.0, "ns"}},
      {"min", {Of::kTime, 60.0, 0.0, "min"}},
      {"rad", {Of::kAngle, 1.0, 0.0, "rad"}},
      {"mrad", {Of::kAngle, 1e-3, 0.0, "mrad"}},
      {"deg", {Of::kAngle, units::kDegree, 0.0, "deg"}},
      {"degree", {Of::kAngle, units::kDegree, 0.0, "deg"}},
      {"degrees", {Of::kAngle, units::kDegree, 0.0, "deg"}},
      {"grad", {Of::kAngle, units::kDegree, 0.0, "deg"}},
      {"°", {Of::kAngle, units::kDegree, 0.0, "deg"}},
      {"m", {Of::kLength, 1.0, 0.0, "m"}},
      {"cm", {Of::kLength, 1e-2, 0.0, "cm"}},
      {"mm", {Of::kLength, 1e-3, 0.0, "mm"}},
      {"%", {Of::kShare, 0.01, 0.0, "%"}},
      {"percent", {Of::kShare, 0.01, 0.0, "%"}},
      {"prozent", {Of::kShare, 0.01, 0.0, "%"}},
      {"pct", {Of::kShare, 0.01, 0.0, "%"}},
      {"permille", {Of::kShare, 1e-3, 0.0, "permille"}},
      {"-", {Of::kShare, 1.0, 0.0, "1"}},
      {"1", {Of::kShare, 1.0, 0.0, "1"}},
      {"bar", {Of::kPressure, units::kBar, 0.0, "bar"}},
      {"mbar", {Of::kPressure, 100.0, 0.0, "mbar"}},
      {"pa", {Of::kPressure, 1.0, 0.0, "Pa"}},
      {"kpa", {Of::kPressure, 1e3, 0.0, "kPa"}},
      {"mpa", {Of::kPressure, 1e6, 0.0, "MPa"}},
      {"psi", {Of::kPressure, kPsi, 0.0, "psi"}},
      {"n", {Of::kForce, 1.0, 0.0, "N"}},
      {"kn", {Of::kForce, 1e3, 0.0, "kN"}},
      {"lpm", {Of::kFlow, kLitre, 0.0, "l/min"}},
      {"l/min", {Of::kFlow, kLitre, 0.0, "l/min"}},
      {"l_min", {Of::kFlow, kLitre, 0.0, "l/min"}},
      {"l/s", {Of::kFlow, 1e-3, 0.0, "l/s"}},
      {"m3/s", {Of::kFlow, 1.0, 0.0, "m3/s"}},
      {"m^3/s", {Of::kFlow, 1.0, 0.0, "m3/s"}},
      {"m3/h", {Of::kFlow, 1.0 / 3600.0, 0.0, "m3/h"}},
      {"kg", {Of::kMass, 1.0, 0.0, "kg"}},
      {"t", {Of::kMass, 1e3, 0.0, "t"}},
      {"lb", {Of::kMass, 0.45359237, 0.0, "lb"}},
      {"c", {Of::kTemperature, 1.0, 0.0, "degC"}},
      {"°c", {Of::kTemperature, 1.0, 0.0, "degC"}},
      {"degc", {Of::kTemperature, 1.0, 0.0, "degC"}},
      {"k", {Of::kTemperature, 1.0, -273.15, "K"}},
      {"°f", {Of::kTemperature, 5.0 / 9.0, -160.0 / 9.0, "F"}},
      {"m/s", {Of::kSpeed, 1.0, 0.0, "m/s"}},
      {"mm/s", {Of::kSpeed, 1e-3, 0.0, "mm/s"}},
      {"rad/s", {Of::kAngularSpeed, 1.0, 0.0, "rad/s"}},
      {"deg/s", {Of::kAngularSpeed, units::kDegree, 0.0, "deg/s"}},
      {"°/s", {Of::kAngularSpeed, units::kDegree, 0.0, "deg/s"}},
  };
  return all;
}

const ChannelUnit& spelt(std::string_view text) {
  for (const Spelling& s : spellings()) {
    if (s.text == text) return s.unit;
  }
  SPARFLOW_CHECK(false, "every unit named in this file is in its table");
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  return out;
}

const ChannelUnit* find(std::string_view written) {
  const std::string text = lower(written);
  for (const Spelling& s : spellings()) {
    if (s.text == text) return &s.unit;
  }
  return nullptr;
}

/// Last letters of a name that are units only where the file says so: "valve_s", "sensor_t", "gain_k".
bool may_end_a_name(std::string_view suffix) {
  static constexpr std::array<std::string_view, 5> kLetters = {"s", "t", "k", "1", "c"};
  return std::find(kLetters.begin(), kLetters.end(), lower(suffix)) == kLetters.end();
}

Of quantity_of(const Meaning& meaning, const Machine& machine) {
  const bool turns =
      meaning.role == Role::kJointPosition &&
      machine.joints[static_cast<std::size_t>(meaning.index)].type == JointType::kRevolute;
  if (meaning.kind == MeaningKind::kSpeed) return turns ? Of::kAngularSpeed : Of::kSpeed;
  switch (meaning.role) {
    case Role::kJointPosition:
      return turns ? Of::kAngle : Of::kLength;
    case Role::kStroke:
      return Of::kLength;
    case Role::kCommand:
      return Of::kShare;
    case Role::kForce:
      return Of::kForce;
    case Role::kFlow:
      return Of::kFlow;
    case Role::kPayload:
      return Of::kMass;
    case Role::kOilTemperature:
      return Of::kTemperature;
    case Role::kCandidate:
      return Of::kNothing;
    default:
      return Of::kPressure;
  }
}

}  // namespace

ChannelUnit channel_unit(const std::string& name, const std::string& unit) {
  if (!unit.empty()) {
    if (const ChannelUnit* found = find(unit)) return *found;
    return {Of::kOther, 1.0, 0.0, unit};
  }
  const std::size_t open = name.find_last_of("[(");
  if (open != name.npos && open > 0 && (name.back() == ']' || name.back() == ')')) {
    const std::string inside = name.substr(open + 1, name.size() - open - 2);
    // The second element of a list is called `x[1]`, a share without unit `x [1]`.
    if (inside == "1" && name[open - 1] != ' ' && name[open - 1] != '_') return {};
    if (const ChannelUnit* found = find(inside)) return *found;
    return {};
  }
  const std::size_t mark = name.find_last_of("_ .");
  if (mark == name.npos || mark == 0) return {};
  const std::string_view suffix = std::string_view(name).substr(mark + 1);
  const ChannelUnit* found = find(suffix);
  if (found == nullptr) return {};
  // "gain_k" has no unit, "oil_C" and "TempTank_K" have one.
  const bool meant = may_end_a_name(suffix) ||
                     (found->of == Of::kTemperature && names_a_temperature(name.substr(0, mark)));
  return meant ? *found : ChannelUnit{};
}

const std::vector<ChannelUnit>& possible_units(const Meaning& meaning, const Machine& machine) {
  static const std::vector<ChannelUnit> kAngles = {spelt("rad"), spelt("deg")};
  static const std::vector<ChannelUnit> kLengths = {spelt("m"), spelt("mm"), spelt("cm")};
  static const std::vector<ChannelUnit> kPressures = {spelt("bar"), spelt("pa"), spelt("mpa"),
                                                      spelt("psi"), spelt("kpa")};
  static const std::vector<ChannelUnit> kForces = {spelt("n"), spelt("kn")};
  static const std::vector<ChannelUnit> kFlows = {spelt("l/min"), spelt("m3/s"), spelt("l/s")};
  static const std::vector<ChannelUnit> kMasses = {spelt("kg"), spelt("t")};
  static const std::vector<ChannelUnit> kTemperatures = {spelt("c"), spelt("k"), spelt("°f")};
  static const std::vector<ChannelUnit> kSpeeds = {spelt("m/s"), spelt("mm/s")};
  static const std::vector<ChannelUnit> kTurns = {spelt("rad/s"), spelt("deg/s")};
  static const std::vector<ChannelUnit> kShares = {spelt("1"), spelt("%"), spelt("permille")};
  switch (quantity_of(meaning, machine)) {
    case Of::kAngle:
      return kAngles;
    case Of::kLength:
      return kLengths;
    case Of::kPressure:
      return kPressures;
    case Of::kForce:
      return kForces;
    case Of::kFlow:
      return kFlows;
    case Of::kMass:
      return kMasses;
    case Of::kTemperature:
      return kTemperatures;
    case Of::kSpeed:
      return kSpeeds;
    case Of::kAngularSpeed:
      return kTurns;
    default:
      return kShares;
  }
}

WordEvidence unit_evidence(const ChannelUnit& unit, const Meaning& meaning, const Machine& machine,
                           const WordOptions& o) {
  if (unit.of == Of::kNothing) return {};
  const Of wanted = quantity_of(meaning, machine);
  if (unit.of == wanted) return {o.right_unit, fmt::format("its unit is {}", unit.word)};
  // A lever or a valve is logged in many units (mA, mV, digits), "-" means all sorts of things.
  if (wanted == Of::kShare && unit.of == Of::kOther) return {};
  if (unit.of == Of::kShare && unit.factor == 1.0) return {-0.5 * o.right_unit, "it has no unit"};
  return {-o.wrong_unit, fmt::format("its unit is {}", unit.word)};
}

}  // namespace sparflow
