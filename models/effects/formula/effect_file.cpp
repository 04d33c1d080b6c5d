#include "models/effects/formula/effect_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <sstream>

#include "models/math/error.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

using Stage = EffectStage;
using Place = EffectPlace;

/// Values of a shape parameter that are searched where the file gives none.
/// @threshold [1] 2..100; chosen: a refinement follows
constexpr int kGridPoints = 7;
/// Longest part of a law that a message quotes.
/// @threshold [characters] 20..10000; chosen: three lines
constexpr std::size_t kQuoted = 300;

constexpr const char* kNameRule = "of letters, digits and _ that does not begin with a digit";

bool plain_name(const std::string& word) {
  return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) == 0 &&
         std::all_of(word.begin(), word.end(), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
         });
}

/// Values at equal steps over the bounds, at equal ratios where they are positive and span more than a decade.
std::vector<double> default_grid(const EffectParameter& p) {
  std::vector<double> grid;
  /// Ratio of the bounds above which values are at equal ratios.
  /// @threshold [1] 1..1000; chosen: a decade, within which equal steps cover small values as well
  constexpr double kDecade = 10.0;
  const bool by_ratio = p.lower > 0.0 && p.upper > kDecade * p.lower;
  for (int i = 0; i < kGridPoints; ++i) {
    const double f = static_cast<double>(i) / (kGridPoints - 1);
    grid.push_back(by_ratio ? p.lower * std::pow(p.upper / p.lower, f)
                            : p.lower + f * (p.upper - p.lower));
  }
  return grid;
}

/// A number in the parameter's unit, checked to be inside its bounds; returned in SI.
double within(const YamlValue& value, const EffectParameter& p) {
  const double si = value.number({"number", p.unit.c_str(), Quantity::Sign::kAny, p.si});
  if (!(si >= p.lower && si <= p.upper)) {
    value.fail(fmt::format("got {}, expected a number inside the bounds [{:g}, {:g}] {}",
                           value.word(), p.lower / p.si, p.upper / p.si, p.unit));
  }
  return si;
}

class EffectReader {
 public:
  EffectReader(const Machine* machine, const std::vector<std::string>& reserved)
      : machine_(machine), reserved_(reserved) {}

  UserEffectSpec read(const YamlValue& value) const {
    const YamlMap map = value.map("an effect {id, stage, at, law, parameters}",
                                  {"id", "title", "stage", "at", "law", "parameters", "equation",
                                   "citation", "confused_with", "separated_by"});
    UserEffectSpec spec;
    EffectInfo& info = spec.info;
    spec.where = value.place();
    info.id = id(map.need("id", "a name for the effect, such as my_friction"));
    info.stage = static_cast<Stage>(map.need("stage", "one of force, flow, pressure, pump")
                                        .choice({"force", "flow", "pressure", "pump"}));
    info.place = place(map, info.stage);
    const YamlValue parameters = map.need(
        "parameters", "a mapping such as Fc: {unit: N, bounds: [0, 20000], typical: 3000}");
    std::vector<ReadParameter> read;
    for (const auto& [name, entry] :
         parameters.map("a mapping from names to parameters", {}).entries()) {
      read.push_back(parameter(name, entry));
    }
    if (read.empty()) parameters.fail("an effect needs at least one parameter, its size");
    read_law(map.need("law", "a formula such as Fc * sign(v)"), read, spec);
    const auto text_or = [&](const char* key, const std::string& what, const std::string& other) {
      const auto found = map.find(key);
      return found ? found->text(what) : other;
    };
    info.title = text_or("title", "a title", info.id);
    info.equation = text_or("equation", "one line of text", spec.law.text());
    info.citation = text_or("citation", "author (year), where", "");
    info.separated_by = text_or("separated_by", "the motion that distinguishes it", "");
    if (const auto list = map.find("confused_with")) {
      for (const YamlValue& word : list->list("ids of effects or words")) {
        info.confused_with.push_back(word.text("the id of an effect or words"));
      }
    }
    info.in_motion = !spec.in_motion() ? "nothing: its law uses signals that only a log has"
                     : info.stage == Stage::kFlow ? "nothing: a motion prescribes flow"
                                                  : effect_stage_name(info.stage);
    return spec;
  }

 private:
  struct ReadParameter {
    YamlValue value;
    EffectParameter parameter;
    Symbol symbol;
  };

  std::string id(const YamlValue& value) const {
    const std::string word = value.text("an id");
    if (!plain_name(word))
      value.fail(fmt::format("got \"{}\", expected an id {}", word, kNameRule));
    if (std::find(reserved_.begin(), reserved_.end(), word) != reserved_.end()) {
      value.fail(
          fmt::format("an effect \"{0}\" exists already; choose another id, such as my_{0}", word));
    }
    return word;
  }

  static Place place(const YamlMap& map, Stage stage) {
    static const std::vector<std::string> kNames = {"cylinder", "pump", "machine"};
    static constexpr Place kPlaces[] = {Place::kCylinder, Place::kPump, Place::kMachine};
    const int own = stage == Stage::kPump ? 1 : 0;
    const auto value = map.find("at");
    const int found = value ? value->choice(kNames) : own;
    if (found != own && kPlaces[found] != Place::kMachine) {
      value->fail(fmt::format("got {}, expected {} or machine: stage {} adds to each {}",
                              value->word(), kNames[own], effect_stage_name(stage), kNames[own]));
    }
    return kPlaces[found];
  }

  static ReadParameter parameter(const std::string& name, const YamlValue& value) {
    if (!plain_name(name)) {
      value.fail(fmt::format("\"{}\" cannot stand in a law; expected a parameter's name {}", name,
                             kNameRule));
    }
    for (const SignalInfo& signal : user_effect_signals()) {
      if (name != signal.name) continue;
      value.fail(
          fmt::format("\"{0}\" is a signal: {1}; give the parameter another name, such as {0}0",
                      name, signal.meaning));
    }
    if (find_function(name) != nullptr) {
      value.fail(fmt::format("\"{}\" is a function; give the parameter another name", name));
    }
    const YamlMap map = value.map("a parameter {unit, bounds, typical}",
                                  {"unit", "bounds", "typical", "meaning", "grid"});
    const std::string units = "a unit such as N, bar/(l/min)^2 or 1 for a pure number";
    const YamlValue unit_value = map.need("unit", units);
    EffectParameter p{name, unit_value.text(units), 1.0, 0.0, 0.0, 0.0, "", true, {}};
    Unit unit;
    try {
      unit = parse_unit(p.unit);
    } catch (const TextError& error) {
      unit_value.fail(fmt::format("got \"{}\": column {}: {}", p.unit, error.column, error.what()));
    }
    p.si = unit.si;
    const Range bounds =
        map.need("bounds", fmt::format("the plausible range [lo, hi], each a number [{}]", p.unit))
            .range({"number", p.unit.c_str(), Quantity::Sign::kAny, p.si});
    p.lower = bounds.lo;
    p.upper = bounds.hi;
    p.typical =
        within(map.need("typical",
                        fmt::format("the value at which the effect is clearly seen [{}]", p.unit)),
               p);
    if (const auto grid = map.find("grid")) {
      for (const YamlValue& point : grid->list("values to search from")) {
        p.grid.push_back(within(point, p));
      }
      if (p.grid.size() < 2)
        grid->fail("expected two values or more, from which the search starts");
    }
    if (const auto meaning = map.find("meaning")) p.meaning = meaning->text("a few words");
    return {value, p, {name, unit}};
  }

  /// The names that a law of this stage may contain.
  std::vector<Symbol> vocabulary(Stage stage) const {
    std::vector<Symbol> symbols;
    for (const SignalInfo& signal : user_effect_signals()) {
      if (signal.owner != SignalInfo::Owner::kJoint) {
        Symbol symbol{signal.name, parse_unit(signal.unit)};
        if (stage == Stage::kPump && signal.owner == SignalInfo::Owner::kCylinder) {
          symbol.refused = symbol.name +
                           " is a signal of a cylinder, and a law of stage pump is about a pump; "
                           "use Q_pump, p_pump or signals of the machine";
        }
        symbols.push_back(symbol);
      } else if (machine_ == nullptr) {
        symbols.push_back({std::string(signal.name) + "*", {}, false});
      } else {
        const std::string units = signal.unit;  // "rad/s or m/s"
        const std::size_t either = units.find(" or ");
        for (const Joint& joint : machine_->joints) {
          const bool prismatic = joint.type == JointType::kPrismatic;
          symbols.push_back(
              {signal.name + joint.name,
               parse_unit(prismatic ? units.substr(either + 4) : units.substr(0, either))});
        }
      }
    }
    return symbols;
  }

  /// Reads the law and checks its unit, that every parameter occurs in it and that the effect can be absent.
  void read_law(const YamlValue& value, const std::vector<ReadParameter>& read,
                UserEffectSpec& spec) const {
    const std::string text = value.text("a formula such as Fc * sign(v)");
    const std::string got = text.size() > kQuoted ? text.substr(0, kQuoted) + "..." : text;
    const std::vector<Symbol> signals = vocabulary(spec.info.stage);
    std::vector<Symbol> symbols;
    symbols.reserve(read.size());
    for (const ReadParameter& r : read) symbols.push_back(r.symbol);
    try {
      spec.law = Law::compile(text, signals, symbols);
    } catch (const TextError& error) {
      value.fail(fmt::format("got \"{}\": column {}: {}", got, error.column, error.what()));
    }
    const Dimension expected = stage_dimension(spec.info.stage), found = spec.law.dimension();
    if (spec.law.dimension_known() && found != expected) {
      value.fail(fmt::format(
          "got \"{}\", which gives {}, expected {}, the unit of stage {}; it lacks a factor of {}",
          got, in_brackets(found), in_brackets(expected), effect_stage_name(spec.info.stage),
          in_brackets(expected / found)));
    }
    const std::vector<std::string> sizes = spec.law.proportional_parameters();
    symbols.clear();
    for (const bool linear : {true, false}) {  // The catalogue lists proportional parameters first.
      for (const ReadParameter& r : read) {
        const bool size = std::find(sizes.begin(), sizes.end(), r.symbol.name) != sizes.end();
        if (size != linear) continue;
        symbols.push_back(r.symbol);
        spec.info.parameters.push_back(judged(r, spec.law, size));
      }
    }
    if (sizes.empty()) {
      value.fail(fmt::format(
          "got \"{}\", which is proportional to none of its parameters, so the effect could never "
          "be "
          "absent; multiply all of it by one, as in size * (...), size: {{unit: 1, bounds: [0, 2], "
          "typical: 1}}",
          got));
    }
    spec.law = Law::compile(text, signals, symbols);
    spec.info.signals = spec.law.signals();
    for (const std::string& name : spec.law.signals()) {
      for (const SignalInfo& info : user_effect_signals()) {
        const bool joint = info.owner == SignalInfo::Owner::kJoint;
        if (joint ? !name.starts_with(info.name) : name != info.name) continue;
        spec.signals.push_back(&info);
        spec.joints.push_back(joint ? name.substr(std::string(info.name).size()) : "");
      }
    }
  }

  /// The parameter with its grid. @param size whether the law is proportional to it
  static EffectParameter judged(const ReadParameter& read, const Law& law, bool size) {
    EffectParameter p = read.parameter;
    p.linear = size;
    if (!law.uses_parameter(p.name))
      read.value.fail("does not stand in the law; use it or remove it");
    if (size && !p.grid.empty()) {
      read.value.fail(
          "has a grid, but the law is proportional to it, so it is found without a search; remove "
          "the grid");
    }
    if (size && p.typical == 0.0) {
      read.value.fail(
          "got typical 0, at which the effect is absent; give the value at which it is clearly "
          "seen");
    }
    if (!size && p.grid.empty()) p.grid = default_grid(p);
    return p;
  }

  const Machine* machine_;
  const std::vector<std::string>& reserved_;
};

/// YAML text of a file that contains this effect alone.
std::string alone(const YamlValue& effect) {
  std::string text = "effects:\n";
  std::istringstream lines(effect.yaml());
  const char* before = "  - ";
  for (std::string line; std::getline(lines, line); before = "    ") text += before + line + "\n";
  return text;
}

}  // namespace

Dimension stage_dimension(EffectStage stage) {
  return stage == Stage::kForce  ? dimensions::kForce
         : stage == Stage::kFlow ? dimensions::kFlow
                                 : dimensions::kPressure;
}

bool UserEffectSpec::in_motion() const {
  return std::all_of(signals.begin(), signals.end(), [&](const SignalInfo* signal) {
    return signal->in_motion() && signal->motion_stage <= info.stage;
  });
}

std::vector<UserEffectSpec> parse_user_effects(const std::string& text, const std::string& file,
                                               const Machine* machine,
                                               const std::vector<std::string>& reserved) {
  const YamlMap top = parse_yaml(text, file).map("a mapping with the key effects", {"effects"});
  const EffectReader reader(machine, reserved);
  const YamlValue list = top.need("effects", "a list of effects");
  std::vector<UserEffectSpec> specs;
  for (const YamlValue& value : list.list("effects, each beginning with - id: ...")) {
    UserEffectSpec spec = reader.read(value);
    for (const UserEffectSpec& earlier : specs) {
      if (earlier.info.id == spec.info.id) {
        value.fail(fmt::format("the id \"{}\" is taken by the effect on line {}; choose another",
                               spec.info.id, earlier.where.line));
      }
    }
    spec.definition = alone(value);
    specs.push_back(std::move(spec));
  }
  if (specs.empty()) list.fail("the list is empty; expected at least one effect");
  return specs;
}

}  // namespace sparflow
