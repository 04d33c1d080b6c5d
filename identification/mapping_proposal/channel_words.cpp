#include "identification/mapping_proposal/channel_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "identification/log/log_columns.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Of = ChannelUnit::Of;
using Words = std::vector<std::string_view>;

/// Words of one class of channels.
struct WordClass {
  std::string_view name;  ///< in sentences
  Words clear, vague;
};

enum Class {
  kPosition,
  kStroke,
  kCommand,
  kPressure,
  kForce,
  kFlow,
  kPayload,
  kOil,
  kSpeed,
  kClasses
};

const std::array<WordClass, kClasses> kClassWords = {{
    {"position",
     {"angle", "winkel", "position", "pos", "lage", "gelenk", "joint", "encoder", "drehgeber",
      "neigung", "inclination", "phi", "theta"},
     {"q", "alpha", "beta", "axis", "achse", "ist"}},
    {"stroke",
     {"stroke", "hub", "weg", "laenge", "length", "displacement", "auszug"},
     {"x", "s", "position", "pos", "wegsensor", "len"}},
    {"command",
     {"command", "cmd", "joystick", "joy", "hebel", "lever", "stell", "soll", "setpoint", "valve",
      "ventil", "spool", "schieber", "steuer", "ansteuerung", "pwm", "control"},
     {"u", "y", "ref", "input", "strom", "current", "js"}},
    {"pressure", {"pressure", "druck", "press"}, {"p", "pa", "pb", "pt", "pr", "dr"}},
    {"force", {"force", "kraft", "loadcell"}, {"f"}},
    {"flow", {"flow", "volumenstrom", "durchfluss", "foerderstrom"}, {"q", "lpm"}},
    {"payload",
     {"payload", "nutzlast", "traglast", "gewicht", "weight", "masse", "mass"},
     {"load", "last", "m"}},
    {"oil temperature",
     {"oil", "oel", "oilt", "toil", "temperature", "temperatur", "temp"},
     {"fluid", "t"}},
    {"speed",
     {"velocity", "speed", "geschwindigkeit", "drehrate", "omega", "winkelgeschwindigkeit"},
     {"v", "vel", "rate", "qd", "dq"}},
}};

enum Side { kA, kB, kPump, kReturn, kSides };

const std::array<WordClass, kSides> kSideWords = {{
    {"bore side", {"bore", "cap", "piston", "kolben", "boden"}, {"a", "pa"}},
    {"rod side", {"rod", "stange", "ring", "annulus"}, {"b", "pb"}},
    {"pump", {"pump", "pumpe", "pmp", "supply", "versorgung"}, {"system", "hd"}},
    {"return line", {"return", "tank", "ruecklauf", "drain"}, {"t", "nd"}},
}};

/// Names of machine parts that mean the same on different machines.
const std::array<Words, 8> kPartWords = {{
    {"boom", "main", "hauptarm", "hubarm", "hubzylinder", "hubzyl", "ausleger", "mast", "lift",
     "heben"},
    {"jib", "knickarm", "knick", "knickzylinder", "wippe", "outer"},
    {"stick", "stiel", "arm", "dipper", "stielzylinder"},
    {"bucket", "loeffel", "schaufel", "loeffelzylinder"},
    {"extension", "telescope", "teleskop", "tele", "ausschub", "schub", "reach", "ausfahr"},
    {"slew", "swing", "schwenk", "schwenkwerk", "drehwerk", "dreh", "slewing", "turntable"},
    {"cross", "quer"},
    {"grapple", "greifer"},
}};

/// Words of signals that no machine file asks for.
const Words kForeignWords = {"engine",   "coolant",  "kuehlwasser", "kuehlmittel", "drehzahl",
                             "rpm",      "voltage",  "spannung",    "battery",     "batterie",
                             "fuel",     "diesel",   "ambient",     "umgebung",    "gps",
                             "latitude", "longitude"};

/// Shortest beginning of a part's name that may stand for it ("ext" for extension).
/// @threshold [1] 2..5; chosen: as column names abbreviate
constexpr std::size_t kShortestBeginning = 3;

/// Shortest word that may be part of a longer one, as in "Kolbendruck".
/// @threshold [1] 3..8; chosen: shorter ones occur in words by chance
constexpr std::size_t kShortestPart = 4;

bool holds(const std::vector<std::string>& words, std::string_view word) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& w) {
    return w == word || (word.size() >= kShortestPart && w.find(word) != w.npos);
  });
}

/// @return the first of the class's words that the name has, "" when it has none
std::string_view found_in(const Words& vocabulary, const std::vector<std::string>& words) {
  for (const std::string_view word : vocabulary) {
    if (holds(words, word)) return word;
  }
  return {};
}

Class class_of(const Meaning& meaning) {
  if (meaning.kind == MeaningKind::kSpeed) return kSpeed;
  switch (meaning.role) {
    case Role::kJointPosition:
      return kPosition;
    case Role::kStroke:
      return kStroke;
    case Role::kCommand:
      return kCommand;
    case Role::kForce:
      return kForce;
    case Role::kFlow:
      return kFlow;
    case Role::kPayload:
      return kPayload;
    case Role::kOilTemperature:
      return kOil;
    default:
      return kPressure;
  }
}

int side_of(const Meaning& meaning) {
  if (meaning.kind == MeaningKind::kSpeed) return -1;
  switch (meaning.role) {
    case Role::kPressureA:
      return kA;
    case Role::kPressureB:
      return kB;
    case Role::kPumpPressure:
      return kPump;
    case Role::kReturnPressure:
      return kReturn;
    default:
      return -1;
  }
}

/// What the name says of one vocabulary among others that exclude each other.
template <std::size_t N>
WordEvidence vocabulary_evidence(const std::array<WordClass, N>& all, std::size_t own,
                                 const std::vector<std::string>& words, const WordOptions& o) {
  if (const auto word = found_in(all[own].clear, words); !word.empty()) {
    return {o.clear_word, fmt::format("\"{}\" in its name means {}", word, all[own].name)};
  }
  const auto vague = found_in(all[own].vague, words);
  for (std::size_t k = 0; k < N; ++k) {
    if (k == own) continue;
    if (const auto word = found_in(all[k].clear, words); !word.empty()) {
      return {vague.empty() ? -o.clear_word : 0.5 * (o.vague_word - o.clear_word),
              fmt::format("\"{}\" in its name means {}", word, all[k].name)};
    }
  }
  if (!vague.empty()) {
    return {o.vague_word, fmt::format("\"{}\" in its name may mean {}", vague, all[own].name)};
  }
  for (std::size_t k = 0; k < N; ++k) {
    if (k == own) continue;
    if (const auto word = found_in(all[k].vague, words); !word.empty()) {
      return {-0.5 * o.vague_word,
              fmt::format("\"{}\" in its name may mean {}", word, all[k].name)};
    }
  }
  return {};
}

/// How well a name names a part: by the part's own words, or by a synonym.
double part_score(const std::string& part, const std::vector<std::string>& words,
                  const WordOptions& o, std::string* word) {
  const std::vector<std::string> own = name_words(part);
  if (!own.empty() &&
      std::search(words.begin(), words.end(), own.begin(), own.end()) != words.end()) {
    *word = part;
    return o.part_name;
  }
  if (own.size() == 1 && std::any_of(words.begin(), words.end(), [&](const std::string& w) {
        return w.size() >= kShortestBeginning && w.size() < own.front().size() &&
               own.front().starts_with(w);
      })) {
    *word = part.substr(0, kShortestBeginning);
    return o.part_synonym;
  }
  for (const Words& set : kPartWords) {
    if (std::none_of(own.begin(), own.end(), [&](const std::string& w) {
          return std::find(set.begin(), set.end(), w) != set.end();
        })) {
      continue;
    }
    if (const auto found = found_in(set, words); !found.empty()) {
      *word = found;
      return o.part_synonym;
    }
  }
  return 0.0;
}

/// Names of the part that a meaning belongs to, one list for each part of its kind.
std::vector<std::vector<std::string>> part_names(const Meaning& meaning, const Machine& machine) {
  std::vector<std::vector<std::string>> parts;
  if (meaning.role == Role::kPumpPressure) {
    for (const Pump& pump : machine.pumps) parts.push_back({pump.name});
    return parts;
  }
  const auto joint_names = [&](int j) {
    std::vector<std::string> names = {machine.joints[static_cast<std::size_t>(j)].name};
    const int c = machine.cylinder_of_joint(j);
    if (c >= 0) names.push_back(machine.cylinders[static_cast<std::size_t>(c)].name);
    return names;
  };
  if (meaning.role == Role::kJointPosition) {
    for (int j = 0; j < machine.joint_count(); ++j) parts.push_back(joint_names(j));
  } else {
    for (const Cylinder& c : machine.cylinders) parts.push_back(joint_names(c.joint));
  }
  return parts;
}

WordEvidence part_evidence(const Meaning& meaning, const Machine& machine,
                           const std::vector<std::string>& words, const WordOptions& o) {
  if (meaning.index < 0) return {};
  const auto parts = part_names(meaning, machine);
  WordEvidence best;
  double others = 0.0;
  std::string other_word;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (const std::string& name : parts[k]) {
      std::string word;
      const double score = part_score(name, words, o, &word);
      if (static_cast<int>(k) == meaning.index) {
        if (score > best.log_odds) best = {score, fmt::format("\"{}\" names {}", word, name)};
      } else if (score > others) {
        others = score;
        other_word = fmt::format("\"{}\" in its name names {}", word, name);
      }
    }
  }
  if (best.log_odds > others) return best;
  if (others > best.log_odds) return {-others, other_word};
  return {};
}

}  // namespace

std::vector<std::string> name_words(const std::string& name) {
  std::string folded;
  folded.reserve(name.size() + 8);
  // Umlauts in UTF-8, then everything else that is no letter or digit as a blank.
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    if (c == 0xC3 && i + 1 < name.size()) {
      const auto d = static_cast<unsigned char>(name[++i]);
      folded += d == 0xA4   ? "ae"
                : d == 0xB6 ? "oe"
                : d == 0xBC ? "ue"
                : d == 0x9F ? "ss"
                : d == 0x84 ? "Ae"
                : d == 0x96 ? "Oe"
                : d == 0x9C ? "Ue"
                            : " ";
    } else {
      folded += c < 0x80 ? static_cast<char>(c) : ' ';
    }
  }
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto upper = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::vector<std::string> words;
  char before = ' ';
  for (const char c : folded) {
    const bool letter = lower(c) || upper(c);
    if (letter || digit(c)) {
      const bool same = digit(c) ? digit(before)
                                 : (lower(before) || upper(before)) && !(lower(before) && upper(c));
      if (!same || words.empty()) words.emplace_back();
      words.back() += upper(c) ? static_cast<char>(c + 32) : c;
    }
    before = c;
  }
  return words;
}

WordEvidence name_evidence(const std::string& name, const Meaning& meaning, const Machine& machine,
                           const WordOptions& o) {
  const ColumnMeaning own = column_meaning(name, "", machine);
  if (!own.is_time && own.role != Role::kCandidate && own.error.empty()) {
    if (meaning.kind == MeaningKind::kRole && own.role == meaning.role &&
        own.index == meaning.index) {
      return {o.own_name, "its name is the one that the program uses"};
    }
    return {-o.own_name, fmt::format("its name is the program's for {}",
                                     meaning_words({own.role, own.index}, machine))};
  }
  const std::vector<std::string> words = name_words(name);
  std::vector<WordEvidence> parts = {vocabulary_evidence(kClassWords, class_of(meaning), words, o)};
  if (const int side = side_of(meaning); side >= 0) {
    parts.push_back(vocabulary_evidence(kSideWords, static_cast<std::size_t>(side), words, o));
  }
  parts.push_back(part_evidence(meaning, machine, words, o));
  if (!found_in(kForeignWords, words).empty()) parts.push_back({-2.0 * o.clear_word, ""});
  WordEvidence sum;
  for (const WordEvidence& e : parts) {
    sum.log_odds += e.log_odds;
    if (e.words.empty()) continue;
    if (!sum.words.empty()) sum.words += ", ";
    sum.words += e.words;
  }
  return sum;
}

std::string looks_like(const std::string& name, const ChannelUnit& unit) {
  const std::vector<std::string> words = name_words(name);
  // The unit decides where it names one quantity; names say the rest.
  static const std::vector<std::pair<Of, std::string>> kByUnit = {
      {Of::kPressure, "pressure"},
      {Of::kForce, "force"},
      {Of::kFlow, "flow"},
      {Of::kMass, "payload"},
      {Of::kTemperature, "temperature"},
      {Of::kSpeed, "speed"},
      {Of::kAngularSpeed, "speed"},
      {Of::kAngle, "position"},
      {Of::kLength, "position or stroke"}};
  std::string what;
  for (const auto& [of, word] : kByUnit) {
    if (unit.of == of) what = word;
  }
  for (std::size_t k = 0; what.empty() && k < kClassWords.size(); ++k) {
    if (!found_in(kClassWords[k].clear, words).empty()) what = kClassWords[k].name;
  }
  if (what != "pressure") return what;
  for (const WordClass& side : kSideWords) {
    if (!found_in(side.clear, words).empty()) return fmt::format("{} ({})", what, side.name);
  }
  return what;
}

std::string meaning_words(const Meaning& m, const Machine& machine) {
  const auto at = static_cast<std::size_t>(std::max(m.index, 0));
  const auto joint = [&] { return machine.joints[at].name; };
  const auto cylinder = [&] { return machine.cylinders[at].name; };
  const std::string_view rate = m.kind == MeaningKind::kSpeed ? "speed" : "";
  switch (m.role) {
    case Role::kJointPosition:
      return fmt::format("{} of joint {}", rate.empty() ? "position" : rate, joint());
    case Role::kStroke:
      return fmt::format("{} of cylinder {}", rate.empty() ? "stroke" : rate, cylinder());
    case Role::kCommand:
      return fmt::format("command of cylinder {}", cylinder());
    case Role::kPressureA:
      return fmt::format("bore-side pressure of cylinder {}", cylinder());
    case Role::kPressureB:
      return fmt::format("rod-side pressure of cylinder {}", cylinder());
    case Role::kForce:
      return fmt::format("measured force of cylinder {}", cylinder());
    case Role::kFlow:
      return fmt::format("flow of cylinder {}", cylinder());
    case Role::kPumpPressure:
      return fmt::format("pressure of pump {}", machine.pumps[at].name);
    case Role::kReturnPressure:
      return "return pressure";
    case Role::kPayload:
      return "payload";
    case Role::kOilTemperature:
      return "oil temperature";
    case Role::kCandidate:
      break;
  }
  return "another signal";
}

bool names_a_temperature(const std::string& name) {
  return !found_in(kClassWords[kOil].clear, name_words(name)).empty();
}

bool names_a_clock(const std::string& name) {
  const std::vector<std::string> words = name_words(name);
  static const Words kClock = {"time", "zeit", "timestamp", "zeitstempel", "uhrzeit"};
  return !found_in(kClock, words).empty() || (!words.empty() && words.front() == "t");
}

}  // namespace sparflow
