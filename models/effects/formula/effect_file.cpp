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

using Stage = UserEffectStage;
using Place = UserEffectPlace;

constexpr int kGridPoints = 7;

bool plain_name(const std::string& word) {
  return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) == 0 &&
         std::all_of(word.begin(), word.end(), [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
         });
}

std::string identifier(const YamlValue& value, const std::string& what) {
  const std::string word = value.text(what);
  if (!plain_name(word)) {
    value.fail(
        fmt::format("got \"{}\", expected {} of letters, digits and _ that does not begin "
                    "with a digit",
                    word, what));
  }
  return word;
}

/// Dimension of a joint's coordinate or of its first or second time derivative.
Dimension joint_dimension(JointType type, SignalKind kind) {
  const Dimension q = type == JointType::kPrismatic ? dimensions::kLength : dimensions::kNone;
  return kind == SignalKind::kJointPosition ? q
         : kind == SignalKind::kJointSpeed  ? q * dimensions::kRate
                                            : q * dimensions::kRateOfRate;
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
    spec.where = value.place();
    const YamlValue id = map.need("id", "a name for the effect, such as my_friction");
    spec.id = identifier(id, "an id");
    if (std::find(reserved_.begin(), reserved_.end(), spec.id) != reserved_.end()) {
      id.fail(fmt::format("an effect \"{0}\" exists already; choose another id, such as my_{0}",
                          spec.id));
    }
    spec.stage = static_cast<Stage>(map.need("stage", "one of force, flow, pressure, pump")
                                        .choice({"force", "flow", "pressure", "pump"}));
    spec.place = place(map, spec.stage);
    const auto text_or = [&](const char* key, const std::string& what, const std::string& other) {
      const auto found = map.find(key);
      return found ? found->text(what) : other;
    };
    spec.title = text_or("title", "a title", spec.id);
    const YamlValue parameters = map.need(
        "parameters", "a mapping such as Fc: {unit: N, bounds: [0, 20000], typical: 3000}");
    std::vector<std::pair<std::string, YamlValue>> places;
    std::vector<Symbol> symbols;
    for (const auto& [name, entry] :
         parameters.map("a mapping from names to parameters", {}).entries()) {
      check_name(name, entry);
      symbols.push_back({name, {}, true});
      spec.parameters.push_back(parameter(name, entry, symbols.back().unit));
      places.emplace_back(name, entry);
    }
    if (places.empty()) parameters.fail("an effect needs at least one parameter, its size");
    const YamlValue law = map.need("law", "a formula such as Fc * sign(v)");
    read_law(law, symbols, spec);
    judge_parameters(places, law, spec);
    spec.equation = text_or("equation", "one line of text", spec.law.text());
    spec.citation = text_or("citation", "author (year), where", "");
    spec.separated_by = text_or("separated_by", "the motion that distinguishes it", "");
    if (const auto list = map.find("confused_with")) {
      for (const YamlValue& word : list->list("ids of effects or words")) {
        spec.confused_with.push_back(word.text("the id of an effect or words"));
      }
    }
    return spec;
  }

 private:
  static Place place(const YamlMap& map, Stage stage) {
    const Place own = stage == Stage::kPump ? Place::kPump : Place::kCylinder;
    const auto value = map.find("at");
    if (!value) return own;
    const auto found = static_cast<Place>(value->choice({"cylinder", "pump", "machine"}));
    if (found != own && found != Place::kMachine) {
      value->fail(fmt::format("got {}, expected {} or machine: stage {} adds to each {}",
                              user_effect_place_name(found), user_effect_place_name(own),
                              user_effect_stage_name(stage), user_effect_place_name(own)));
    }
    return found;
  }

  static void check_name(const std::string& name, const YamlValue& at) {
    if (!plain_name(name)) {
      at.fail(
          fmt::format("\"{}\" cannot stand in a law; expected a parameter's name of letters, "
                      "digits and _ that does not begin with a digit",
                      name));
    }
    for (const SignalInfo& signal : user_effect_signals()) {
      if (name == signal.name) {
        at.fail(fmt::format("\"{}\" is a signal: {}; give the parameter another name, such as {}0",
                            name, signal.meaning, name));
      }
    }
    const std::vector<std::string> functions = Expression::functions();
    if (std::find(functions.begin(), functions.end(), name) != functions.end()) {
      at.fail(fmt::format("\"{}\" is a function; give the parameter another name", name));
    }
  }

  static UserParameter parameter(const std::string& name, const YamlValue& value, Unit& unit) {
    const YamlMap map = value.map("a parameter {unit, bounds, typical}",
                                  {"unit", "bounds", "typical", "meaning", "grid"});
    UserParameter p;
    p.name = name;
    const YamlValue unit_value =
        map.need("unit", "a unit such as N, bar/(l/min)^2 or 1 for a pure number");
    p.unit = unit_value.text("a unit such as N, bar/(l/min)^2 or 1 for a pure number");
    try {
      unit = parse_unit(p.unit);
    } catch (const TextError& error) {
      unit_value.fail(fmt::format("got \"{}\": column {}: {}", p.unit, error.column, error.what()));
    }
    p.si = unit.si;
    const Quantity number{"number", p.unit.c_str(), Quantity::Sign::kAny, p.si};
    const Range bounds =
        map.need("bounds", fmt::format("the plausible range [lo, hi], each a number [{}]", p.unit))
            .range(number);
    p.lower = bounds.lo;
    p.upper = bounds.hi;
    const YamlValue typical = map.need(
        "typical", fmt::format("the value at which the effect is clearly seen [{}]", p.unit));
    p.typical = within(typical, number, p);
    if (const auto grid = map.find("grid")) {
      for (const YamlValue& point : grid->list("values to search from")) {
        p.grid.push_back(within(point, number, p));
      }
      if (p.grid.size() < 2)
        grid->fail("expected two values or more, from which the search starts");
    }
    if (const auto meaning = map.find("meaning")) p.meaning = meaning->text("a few words");
    return p;
  }

  /// A number in the parameter's unit, checked to be inside its bounds; returned in SI.
  static double within(const YamlValue& value, const Quantity& what, const UserParameter& p) {
    const double si = value.number(what);
    if (!(si >= p.lower && si <= p.upper)) {
      value.fail(fmt::format("got {}, expected a number inside the bounds [{:g}, {:g}] {}",
                             value.word(), p.lower / p.si, p.upper / p.si, p.unit));
    }
    return si;
  }

  /// The names that a law of this stage may contain.
  std::vector<Symbol> vocabulary(Stage stage) const {
    std::vector<Symbol> symbols;
    for (const SignalInfo& signal : user_effect_signals()) {
      if (signal.of_cylinder && stage == Stage::kPump) continue;
      if (signal.kind < SignalKind::kJointPosition) {
        symbols.push_back({signal.name, parse_unit(signal.unit), true});
      } else if (machine_ == nullptr) {
        symbols.push_back({std::string(signal.name) + "*", {}, false});
      } else {
        for (const Joint& joint : machine_->joints) {
          symbols.push_back({signal.name + joint.name,
                             {joint_dimension(joint.type, signal.kind), 1.0, false},
                             true});
        }
      }
    }
    return symbols;
  }

  void read_law(const YamlValue& value, const std::vector<Symbol>& parameters,
                UserEffectSpec& spec) const {
    const std::string text = value.text("a formula such as Fc * sign(v)");
    try {
      spec.law = Expression::compile(text, vocabulary(spec.stage), parameters);
    } catch (const TextError& error) {
      value.fail(fmt::format("got \"{}\": column {}: {}", text, error.column,
                             explained(text, error, spec.stage)));
    }
    const Dimension expected = user_effect_dimension(spec.stage);
    const Dimension found = spec.law.dimension();
    if (spec.law.dimension_known() && found != expected) {
      value.fail(fmt::format(
          "got \"{}\", which gives {}, expected {}, the unit of stage {}; it lacks a factor of {}",
          text, in_brackets(found), in_brackets(expected), user_effect_stage_name(spec.stage),
          in_brackets(expected / found)));
    }
    for (const std::string& name : spec.law.signals()) {
      spec.signals.push_back(signal_of(name, spec.stage));
    }
  }

  /// The message when a pump's law uses a cylinder's signal; otherwise the parser's own message.
  static std::string explained(const std::string& law, const TextError& error, Stage stage) {
    const std::size_t begin = static_cast<std::size_t>(error.column) - 1;
    std::size_t end = begin;
    while (end < law.size() &&
           (std::isalnum(static_cast<unsigned char>(law[end])) != 0 || law[end] == '_')) {
      ++end;
    }
    const std::string word = begin < end ? law.substr(begin, end - begin) : "";
    for (const SignalInfo& signal : user_effect_signals()) {
      if (stage == Stage::kPump && signal.of_cylinder && word == signal.name) {
        return fmt::format(
            "{} is a signal of a cylinder, and a law of stage pump is about a pump; "
            "use Q_pump, p_pump or signals of the machine",
            word);
      }
    }
    return error.what();
  }

  UserSignal signal_of(const std::string& name, Stage stage) const {
    for (const SignalInfo& info : user_effect_signals()) {
      const bool joint = info.kind >= SignalKind::kJointPosition;
      if (joint ? !name.starts_with(info.name) : name != info.name) continue;
      UserSignal signal{info.kind, name, "", -1, info.in_motion && info.motion_stage <= stage};
      if (joint) {
        signal.joint = name.substr(std::string(info.name).size());
        if (machine_ != nullptr) signal.joint_index = machine_->joint_index(signal.joint);
      }
      return signal;
    }
    check_failed("signal", __FILE__, __LINE__, "a law has a signal outside the table: " + name);
  }

  /// Checks that every parameter occurs in the law and that the effect can be absent; gives the nonlinear ones a grid.
  static void judge_parameters(const std::vector<std::pair<std::string, YamlValue>>& places,
                               const YamlValue& law, UserEffectSpec& spec) {
    const std::vector<std::string> sizes = spec.law.proportional_parameters();
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto& [name, value] = places[i];
      UserParameter& p = spec.parameters[i];
      if (!spec.law.uses_parameter(name)) {
        value.fail("does not stand in the law; use it or remove it");
      }
      p.proportional = std::find(sizes.begin(), sizes.end(), name) != sizes.end();
      if (p.proportional) {
        if (!p.grid.empty()) {
          value.fail(
              "has a grid, but the law is proportional to it, so it is found without a "
              "search; remove the grid");
        }
        if (p.typical == 0.0) {
          value.fail(
              "got typical 0, at which the effect is absent; give the value at which it is "
              "clearly seen");
        }
      } else if (p.grid.empty()) {
        p.grid = default_grid(p);
      }
    }
    if (!sizes.empty()) return;
    law.fail(fmt::format(
        "got \"{}\", which is proportional to none of its parameters, so the effect could never be "
        "absent; multiply all of it by one, as in size * (...), size: {{unit: 1, bounds: [0, 2], "
        "typical: 1}}",
        spec.law.text()));
  }

  /// Values at equal steps over the bounds, at equal ratios where they are positive and span more than a decade.
  static std::vector<double> default_grid(const UserParameter& p) {
    std::vector<double> grid;
    const bool by_ratio = p.lower > 0.0 && p.upper > 10.0 * p.lower;
    for (int i = 0; i < kGridPoints; ++i) {
      const double f = static_cast<double>(i) / (kGridPoints - 1);
      grid.push_back(by_ratio ? p.lower * std::pow(p.upper / p.lower, f)
                              : p.lower + f * (p.upper - p.lower));
    }
    return grid;
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

bool UserEffectSpec::in_motion() const {
  return std::all_of(signals.begin(), signals.end(),
                     [](const UserSignal& signal) { return signal.in_motion; });
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
      if (earlier.id == spec.id) {
        value.fail(fmt::format("the id \"{}\" is taken by the effect on line {}; choose another",
                               spec.id, earlier.where.line));
      }
    }
    spec.source_text = text;
    spec.definition = alone(value);
    specs.push_back(std::move(spec));
  }
  if (specs.empty()) list.fail("the list is empty; expected at least one effect");
  return specs;
}

std::vector<UserEffectSpec> load_user_effects(const std::string& path, const Machine* machine,
                                              const std::vector<std::string>& reserved) {
  return parse_user_effects(read_file(path), path, machine, reserved);
}

}  // namespace sparflow
