#include "models/effects/formula/unit_algebra.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "models/math/error.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

struct Named {
  const char* name;
  Dimension dimension;
  double si;
};

constexpr Dimension kEnergy{{4, 2, -4, 0}};
constexpr Dimension kPower{{4, 2, -6, 0}};
constexpr Dimension kVolume{{6, 0, 0, 0}};

const std::vector<Named>& named_units() {
  namespace dim = dimensions;
  static const std::vector<Named> units = {
      {"m", dim::kLength, 1.0},
      {"mm", dim::kLength, 1e-3},
      {"cm", dim::kLength, 1e-2},
      {"km", dim::kLength, 1e3},
      {"kg", dim::kMass, 1.0},
      {"t", dim::kMass, 1e3},
      {"s", dim::kTime, 1.0},
      {"ms", dim::kTime, 1e-3},
      {"min", dim::kTime, 60.0},
      {"h", dim::kTime, 3600.0},
      {"K", dim::kTemperature, 1.0},
      {"degC", dim::kTemperature, 1.0},
      {"rad", dim::kNone, 1.0},
      {"mrad", dim::kNone, 1e-3},
      {"deg", dim::kNone, units::kDegree},
      {"%", dim::kNone, 0.01},
      {"N", dim::kForce, 1.0},
      {"kN", dim::kForce, 1e3},
      {"MN", dim::kForce, 1e6},
      {"Pa", dim::kPressure, 1.0},
      {"mPa", dim::kPressure, 1e-3},
      {"kPa", dim::kPressure, 1e3},
      {"MPa", dim::kPressure, 1e6},
      {"GPa", dim::kPressure, 1e9},
      {"mbar", dim::kPressure, 1e2},
      {"bar", dim::kPressure, units::kBar},
      {"psi", dim::kPressure, 6894.757293168361},  // NIST SP 811, appendix B.8
      {"l", kVolume, 1e-3},
      {"ml", kVolume, 1e-6},
      {"lpm", dim::kFlow, units::kLitrePerMinute},
      {"J", kEnergy, 1.0},
      {"kJ", kEnergy, 1e3},
      {"MJ", kEnergy, 1e6},
      {"W", kPower, 1.0},
      {"kW", kPower, 1e3},
      {"Hz", dim::kRate, 1.0},
      {"rpm", dim::kRate, 2.0 * std::numbers::pi / 60.0},
      {"cSt", {{4, 0, -2, 0}}, 1e-6},
  };
  return units;
}

const Named* find_unit(const std::string& name) {
  for (const Named& unit : named_units()) {
    if (name == unit.name) return &unit;
  }
  return nullptr;
}

/// Hint for a word that is no unit: "; did you mean "N m"?", or the list of known units.
std::string meant(const std::string& word) {
  struct Habit {
    const char* written;
    const char* meant;
  };
  static constexpr Habit kHabits[] = {
      {"C", "degC"},      {"°C", "degC"}, {"celsius", "degC"}, {"°", "deg"},      {"degree", "deg"},
      {"degrees", "deg"}, {"sec", "s"},   {"second", "s"},     {"seconds", "s"},  {"L", "l"},
      {"litre", "l"},     {"liter", "l"}, {"newton", "N"},     {"minute", "min"}, {"percent", "%"},
      {"ton", "t"},       {"g", "kg"},    {"hour", "h"},       {"kelvin", "K"},
  };
  std::string lower = word;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<std::string> names;
  std::string found;
  for (const Habit& habit : kHabits) {
    if (found.empty() && (word == habit.written || lower == habit.written)) found = habit.meant;
  }
  for (const Named& unit : named_units()) {  // Bar, KN, PA
    std::string known = unit.name;
    names.push_back(known);
    std::transform(known.begin(), known.end(), known.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (found.empty() && known == lower) found = unit.name;
  }
  if (found.empty() && word.size() > 3 && word.back() == 's' &&
      find_unit(word.substr(0, word.size() - 1))) {
    found = word.substr(0, word.size() - 1);  // bars
  }
  for (std::size_t i = 1; found.empty() && i < word.size(); ++i) {  // Nm, Pas
    const std::string head = word.substr(0, i), tail = word.substr(i);
    if (find_unit(head) && find_unit(tail)) found = head + " " + tail;
  }
  if (found.empty()) {
    const std::string nearest = nearest_word(word, names);
    if (word.size() > 2) found = nearest;  // Every unit is near a word of two letters.
  }
  return found.empty() ? "; known units: " + known_units()
                       : fmt::format("; did you mean \"{}\"?", found);
}

/// Recursive-descent parser of one unit text.
class UnitParser {
 public:
  explicit UnitParser(const std::string& text) : text_(text) {}

  Unit whole() {
    skip_blanks();
    if (at_end()) fail(pos_, "the unit is empty; write 1 for a pure number");
    Unit unit;
    if (text_.substr(pos_) == "-") return unit;
    const std::size_t begin = pos_;
    unit = product();
    if (!at_end()) fail(pos_, fmt::format("\"{}\" has no ( before it", text_.substr(pos_, 1)));
    const std::size_t last = text_.find_last_not_of(" \t\r\n");
    unit.reading = text_.substr(begin, last + 1 - begin) == "degC";
    return unit;
  }

 private:
  /// Parses factors up to the end or a closing parenthesis.
  Unit product() {
    if (++depth_ > kMaxDepth) fail(pos_, "too many parentheses in a unit");
    Unit unit = factor();
    bool divided = false;
    for (skip_blanks(); !at_end() && text_[pos_] != ')'; skip_blanks()) {
      const std::size_t at = pos_;
      if (text_[pos_] == '/') {
        ++pos_;
        const Unit below = factor();
        unit.dimension = unit.dimension / below.dimension;
        unit.si /= below.si;
        divided = true;
        continue;
      }
      if (text_[pos_] == '*') {
        ++pos_;
      } else {
        eat("·");
      }
      if (divided) {
        fail(at, fmt::format("it is not clear whether \"{}\" stands above or below the /; put what "
                             "stands below in parentheses, as in J/(kg K)",
                             text_.substr(at)));
      }
      const Unit next = factor();
      unit.dimension = unit.dimension * next.dimension;
      unit.si *= next.si;
    }
    --depth_;
    return unit;
  }

  Unit factor() {
    skip_blanks();
    const std::size_t at = pos_;
    Unit unit;
    if (at_end()) fail(at, "the unit ends where a name should follow");
    if (text_[pos_] == '(') {
      ++pos_;
      unit = product();
      if (at_end()) fail(at, "this ( is never closed");
      ++pos_;
    } else if (text_[pos_] == '1' && !digit(pos_ + 1)) {
      ++pos_;
    } else {
      const std::string word = name();
      if (word.empty()) {
        fail(at, fmt::format("\"{}\" is no unit; expected a name such as bar or l/min",
                             text_.substr(at)));
      }
      const Named* named = find_unit(word);
      if (named == nullptr) fail(at, fmt::format("unknown unit \"{}\"{}", word, meant(word)));
      unit.dimension = named->dimension;
      unit.si = named->si;
    }
    const double exponent = this->exponent();
    if (exponent != 1.0) {
      try {
        unit.dimension = unit.dimension.power(exponent);
      } catch (const TextError& error) {
        fail(at, error.what());
      }
      unit.si = std::pow(unit.si, exponent);
    }
    return unit;
  }

  double exponent() {
    if (eat("²")) return 2.0;
    if (eat("³")) return 3.0;
    skip_blanks();
    if (at_end() || text_[pos_] != '^') {
      if (digit(pos_)) {
        fail(pos_, fmt::format("a number here means nothing; write an exponent as ^{}",
                               text_.substr(pos_, 1)));
      }
      return 1.0;
    }
    ++pos_;
    skip_blanks();
    double value = 0.0;
    const char* begin = text_.data() + pos_;
    const auto [stop, error] =
        std::from_chars(begin, text_.data() + text_.size(), value, std::chars_format::fixed);
    if (error != std::errc() || !std::isfinite(value) || std::abs(value) > kMaxExponent) {
      fail(pos_, fmt::format("expected an exponent from -{0} to {0} after ^, as in m^2 or s^-1",
                             kMaxExponent));
    }
    pos_ += static_cast<std::size_t>(stop - begin);
    return value;
  }

  /// Reads letters, % and bytes beyond ASCII other than the three marks that this grammar uses.
  std::string name() {
    const std::size_t begin = pos_;
    while (!at_end()) {
      const auto c = static_cast<unsigned char>(text_[pos_]);
      const bool mark = starts("²") || starts("³") || starts("·");
      if (mark || !(std::isalpha(c) != 0 || c == '%' || c >= 0x80)) break;
      ++pos_;
    }
    return text_.substr(begin, pos_ - begin);
  }

  bool at_end() const { return pos_ >= text_.size(); }
  bool digit(std::size_t at) const {
    return at < text_.size() && std::isdigit(static_cast<unsigned char>(text_[at])) != 0;
  }
  bool starts(const std::string& mark) const { return text_.compare(pos_, mark.size(), mark) == 0; }
  bool eat(const std::string& mark) {
    if (!starts(mark)) return false;
    pos_ += mark.size();
    return true;
  }
  void skip_blanks() {
    while (!at_end() && std::isspace(static_cast<unsigned char>(text_[pos_])) != 0) ++pos_;
  }
  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    const auto before =
        std::count_if(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at),
                      [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
    throw TextError(static_cast<int>(before) + 1, message);
  }

  static constexpr int kMaxDepth = 20;
  static constexpr int kMaxExponent = 12;
  const std::string& text_;
  std::size_t pos_ = 0;
  int depth_ = 0;
};

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
    if (std::abs(exact) > 1000.0 || exact != std::round(exact)) {
      throw TextError(0, fmt::format("{} to the power {} has no exponents that are whole or half",
                                     in_brackets(*this), exponent));
    }
    r.twice[i] = static_cast<int>(exact);
  }
  return r;
}

std::string Dimension::text() const {
  // Masses and densities are written in kg and the rest in N or Pa, whichever is shorter, as is usual in the field.
  const int mass = twice[1];
  const bool in_kg = twice[2] == 0 && std::abs(twice[0]) <= 6;
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

Unit parse_unit(const std::string& text) { return UnitParser(text).whole(); }

std::string known_units() {
  std::string all;
  for (const Named& unit : named_units()) all += (all.empty() ? "" : ", ") + std::string(unit.name);
  return all;
}

}  // namespace sparflow
