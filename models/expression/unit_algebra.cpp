#include "models/expression/unit_algebra.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "models/expression/expression.h"
#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

struct Named {
  const char* name;
  Dimension dimension;
  double si;
};

const std::vector<Named>& named_units() {
  namespace dim = dimensions;
  static const std::vector<Named> units = [] {
    std::vector<Named> all;
    const auto add = [&](const Dimension& of,
                         const std::vector<std::pair<const char*, double>>& list) {
      for (const auto& [name, si] : list) all.push_back({name, of, si});
    };
    add(dim::kLength, {{"m", 1.0}, {"mm", 1e-3}, {"cm", 1e-2}, {"km", 1e3}});
    add(dim::kMass, {{"kg", 1.0}, {"t", 1e3}});
    add(dim::kTime, {{"s", 1.0}, {"ms", 1e-3}, {"min", 60.0}, {"h", 3600.0}});
    add(dim::kTemperature, {{"K", 1.0}, {"degC", 1.0}});
    add(dim::kNone, {{"rad", 1.0}, {"mrad", 1e-3}, {"deg", units::kDegree}, {"%", 0.01}});
    add(dim::kForce, {{"N", 1.0}, {"kN", 1e3}, {"MN", 1e6}});
    add(dim::kPressure, {{"Pa", 1.0}, {"mPa", 1e-3}, {"kPa", 1e3}, {"MPa", 1e6}, {"GPa", 1e9}});
    // psi: NIST SP 811, appendix B.8
    add(dim::kPressure, {{"mbar", 1e2}, {"bar", units::kBar}, {"psi", 6894.757293168361}});
    add({{6, 0, 0, 0}}, {{"l", 1e-3}, {"ml", 1e-6}});
    add(dim::kFlow, {{"lpm", units::kLitrePerMinute}});
    add({{4, 2, -4, 0}}, {{"J", 1.0}, {"kJ", 1e3}, {"MJ", 1e6}});
    add({{4, 2, -6, 0}}, {{"W", 1.0}, {"kW", 1e3}});
    add(dim::kRate, {{"Hz", 1.0}, {"rpm", 2.0 * std::numbers::pi / 60.0}});
    add({{4, 0, -2, 0}}, {{"cSt", 1e-6}});
    return all;
  }();
  return units;
}

constexpr const char* kExponent = "expected an exponent from -12 to 12 after ^, as in m^2 or s^-1";
/// Largest exponent of a unit.
/// @threshold [1] 2..100; chosen: higher ones do not occur
constexpr double kMaxExponent = 12.0;

const Named* find_unit(const std::string& name) {
  for (const Named& unit : named_units()) {
    if (name == unit.name) return &unit;
  }
  return nullptr;
}

/// Hint for a word that is no unit: "; did you mean "N m"?", or the list of known units.
std::string meant(const std::string& word) {
  static const std::vector<std::array<const char*, 2>> kHabits = {
      {"c", "degC"},      {"°c", "degC"}, {"celsius", "degC"}, {"°", "deg"},      {"degree", "deg"},
      {"degrees", "deg"}, {"sec", "s"},   {"second", "s"},     {"seconds", "s"},  {"L", "l"},
      {"litre", "l"},     {"liter", "l"}, {"newton", "N"},     {"minute", "min"}, {"percent", "%"},
      {"ton", "t"},       {"g", "kg"},    {"hour", "h"},       {"kelvin", "K"}};
  const auto lower = [](std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
  };
  std::string found;
  const auto take = [&](bool fits, const std::string& unit) {
    if (fits && found.empty()) found = unit;
  };
  std::vector<std::string> names;
  for (const auto& [written, unit] : kHabits) take(lower(word) == lower(written), unit);
  for (const Named& unit : named_units()) {  // Bar, KN, PA; bars
    names.emplace_back(unit.name);
    take(lower(unit.name) == lower(word) || (word.size() > 3 && word == names.back() + "s"),
         unit.name);
  }
  for (std::size_t i = 1; i < word.size(); ++i) {  // Nm, Pas
    const std::string head = word.substr(0, i), tail = word.substr(i);
    take(find_unit(head) && find_unit(tail), head + " " + tail);
  }
  take(word.size() > 2, nearest_word(word, names));  // Every unit is near a word of two letters.
  return found.empty() ? "; known units: " + known_units()
                       : fmt::format("; did you mean \"{}\"?", found);
}

/// Reads letters, % and bytes beyond ASCII other than the three signs that units are written with.
std::optional<ExpressionNode> unit_name(const std::string& text, std::size_t& at) {
  const std::size_t begin = at;
  const auto in_name = [&](std::size_t k) {
    for (const char* sign : {"²", "³", "·"}) {
      if (text.compare(k, 2, sign) == 0) return false;
    }
    const auto c = static_cast<unsigned char>(text[k]);
    return std::isalpha(c) != 0 || c == '%' || c >= 0x80;
  };
  while (at < text.size() && in_name(at)) ++at;
  if (at == begin) return std::nullopt;
  const std::size_t before = begin == 0 ? begin : text.find_last_not_of(" \t\r\n", begin - 1);
  if (before < begin && text[before] == '^') fail_at(text, begin, kExponent);
  const std::string word = text.substr(begin, at - begin);
  const Named* named = find_unit(word);
  if (named == nullptr) {
    fail_at(text, begin, fmt::format("unknown unit \"{}\"{}", word, meant(word)));
  }
  if (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0) {
    fail_at(text, at,
            fmt::format("a number here means nothing; write an exponent as ^{}", text[at]));
  }
  return ExpressionNode{.op = ExpressionNode::Op::kName,
                        .index = static_cast<std::size_t>(named - named_units().data())};
}

struct Power {
  std::string name;
  int twice;
};

std::string product_text(const std::vector<Power>& powers) {
  std::string above, below;
  int count_below = 0;
  for (const Power& p : powers) {
    if (p.twice == 0) continue;
    std::string& side = p.twice > 0 ? above : below;
    const int twice = std::abs(p.twice);
    if (!side.empty()) side += ' ';
    side += p.name;
    if (twice != 2) side += fmt::format("^{}", twice / 2.0);
    if (p.twice < 0) ++count_below;
  }
  if (below.empty()) return above.empty() ? "1" : above;
  if (count_below > 1) below = "(" + below + ")";
  return (above.empty() ? "1" : above) + "/" + below;
}

}  // namespace

Dimension operator*(const Dimension& a, const Dimension& b) {
  Dimension r;
  for (std::size_t i = 0; i < r.twice.size(); ++i) r.twice[i] = a.twice[i] + b.twice[i];
  return r;
}

Dimension operator/(const Dimension& a, const Dimension& b) {
  Dimension r;
  for (std::size_t i = 0; i < r.twice.size(); ++i) r.twice[i] = a.twice[i] - b.twice[i];
  return r;
}

Dimension Dimension::power(double exponent) const {
  Dimension r;
  for (std::size_t i = 0; i < r.twice.size(); ++i) {
    const double exact = twice[i] * exponent;
    /// Twice the largest exponent of a dimension.
    /// @threshold [1] 100..1e5; chosen: far beyond any unit, far within a whole number
    constexpr double kLargestPower = 1000.0;
    const bool large = std::abs(exact) > kLargestPower;
    if (large || exact != std::round(exact)) {
      throw TextError(
          0, fmt::format("{} to the power {} has {}", in_brackets(*this), exponent,
                         large ? "exponents beyond 500" : "no exponents that are whole or half"));
    }
    r.twice[i] = static_cast<int>(exact);
  }
  return r;
}

std::string Dimension::text() const {
  // Masses and densities are written in kg and the rest in N or Pa, whichever is shorter, as is usual in the field.
  const int mass = twice[1];
  /// Twice the largest power of a length that stands beside kg.
  /// @threshold [1] 2..12; derived: kg/m^3 and kg m^3
  constexpr int kHeaviestLength = 6;
  const bool in_kg = twice[2] == 0 && std::abs(twice[0]) <= kHeaviestLength;
  struct Head {
    const char* name;
    Dimension dimension;
  };
  static const Head kHeads[] = {
      {"kg", dimensions::kMass}, {"N", dimensions::kForce}, {"Pa", dimensions::kPressure}};
  std::string best;
  int best_length = 0;
  for (const Head& head : kHeads) {
    if (head.name == kHeads[0].name && !in_kg) continue;
    Dimension rest = *this;
    int length = 0;
    for (std::size_t i = 0; i < rest.twice.size(); ++i) {
      rest.twice[i] -= head.dimension.twice[i] * mass / 2;
      length += std::abs(rest.twice[i]);
    }
    if (!best.empty() && length >= best_length) continue;
    best_length = length;
    best = product_text(
        {{head.name, mass}, {"m", rest.twice[0]}, {"s", rest.twice[2]}, {"K", rest.twice[3]}});
  }
  return best;
}

std::string in_brackets(const Dimension& dimension) {
  return dimension.none() ? "no unit" : "[" + dimension.text() + "]";
}

Unit parse_unit(const std::string& text) {
  using Op = ExpressionNode::Op;
  const std::size_t begin = skip_blanks(text, 0);
  if (begin == text.size()) fail_at(text, begin, "the unit is empty; write 1 for a pure number");
  const std::string word = text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
  if (word == "-") return {};
  const Expression read = Expression::parse(text, {"unit", unit_name, false, true});
  Expression folded(text);  // whose exponents are numbers
  for (const ExpressionNode& node : read.nodes()) folded.fold(node);
  std::vector<Unit> stack;
  for (const ExpressionNode& node : folded.nodes()) {
    Unit unit;
    if (node.op == Op::kName) {
      unit = {named_units()[node.index].dimension, named_units()[node.index].si, false};
    } else if (node.op == Op::kRaise) {
      if (std::abs(node.number) > kMaxExponent) fail_at(text, node.at + 1, kExponent);
      try {
        unit.dimension = stack.back().dimension.power(node.number);
      } catch (const TextError& error) {
        fail_at(text, node.begin, error.what());
      }
      unit.si = std::pow(stack.back().si, node.number);
      stack.pop_back();
    } else if (node.op == Op::kMultiply || node.op == Op::kDivide) {
      const Unit right = stack.back(), left = stack[stack.size() - 2];
      stack.resize(stack.size() - 2);
      unit = node.op == Op::kMultiply ? Unit{left.dimension * right.dimension, left.si * right.si}
                                      : Unit{left.dimension / right.dimension, left.si / right.si};
    } else if (node.op != Op::kNumber || node.number != 1.0) {
      fail_at(text, node.at,
              fmt::format("\"{}\" is no unit; expected a name such as bar or l/min",
                          text.substr(node.at)));
    }
    if (!std::isfinite(unit.si) || unit.si == 0.0) {
      fail_at(text, node.begin,
              "this unit is beyond what a computer can hold, 1e-307 to 1e308 in SI");
    }
    stack.push_back(unit);
  }
  stack.back().reading = word == "degC";
  return stack.back();
}

std::string known_units() {
  std::string all;
  for (const Named& unit : named_units()) all += (all.empty() ? "" : ", ") + std::string(unit.name);
  return all;
}

}  // namespace sparflow
