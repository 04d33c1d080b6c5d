/// User effects from YAML: what is read, and wrong files with the whole message that the user sees.
#include "models/effects/formula/effect_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cctype>
#include <filesystem>
#include <ostream>

#include "models/effects/formula/user_effect.h"
#include "models/effects/user_effect_scope.h"
#include "models/files/machine_file.h"
#include "models/math/error.h"
#include "models/math/jet.h"
#include "tests/models/files/broken_model_support.h"

namespace sparflow {
namespace {

// clang-format off
const std::string kGoodEffects =
/* 1*/ "effects:\n"
/* 2*/ "  - id: rod_friction\n"
/* 3*/ "    title: Seal friction of the rod\n"
/* 4*/ "    stage: force\n"
/* 5*/ "    at: cylinder\n"
/* 6*/ "    law: \"Fc * tanh(v / v0)\"\n"
/* 7*/ "    parameters:\n"
/* 8*/ "      Fc: {unit: kN, bounds: [0, 20], typical: 3, meaning: friction force}\n"
/* 9*/ "      v0: {unit: mm/s, bounds: [0.5, 50], typical: 5}\n"
/*10*/ "    citation: Andersson, Soderberg, Bjorklund (2007), Tribology International 40\n"
/*11*/ "    confused_with: [coulomb_friction, viscous_friction]\n"
/*12*/ "    separated_by: slow moves\n"
/*13*/ "  - id: cold_hose\n"
/*14*/ "    stage: pressure\n"
/*15*/ "    at: machine\n"
/*16*/ "    law: k * Q * exp(-beta * (oil - 40[degC]))\n"
/*17*/ "    parameters:\n"
/*18*/ "      k: {unit: bar/(l/min), bounds: [0, 1], typical: 0.1}\n"
/*19*/ "      beta: {unit: 1/degC, bounds: [0, 0.1], typical: 0.03, grid: [0.01, 0.03, 0.06]}\n"
/*20*/ "  - id: pump_ripple\n"
/*21*/ "    stage: pump\n"
/*22*/ "    law: dp * square(Q_pump / Q0) + slope * (p_pump - 20[bar])\n"
/*23*/ "    equation: dp grows with the square of the flow\n"
/*24*/ "    parameters:\n"
/*25*/ "      slope: {unit: \"%\", bounds: [-10, 10], typical: 2}\n"
/*26*/ "      dp: {unit: bar, bounds: [0, 50], typical: 10}\n"
/*27*/ "      Q0: {unit: l/min, bounds: [50, 200], typical: 100}\n";
// clang-format on

std::vector<UserEffectSpec> parse(const std::string& text) {
  return parse_user_effects(text, "mine.yaml", nullptr, {"coulomb_friction", "inertia"});
}

TEST(EffectFile, WhatIsWrittenIsRead) {
  const std::vector<UserEffectSpec> specs = parse(kGoodEffects);
  ASSERT_EQ(specs.size(), 3u);
  const UserEffectSpec& rod = specs[0];
  EXPECT_EQ(rod.info.id, "rod_friction");
  EXPECT_EQ(rod.info.title, "Seal friction of the rod");
  EXPECT_EQ(rod.info.stage, EffectStage::kForce);
  EXPECT_EQ(rod.info.place, EffectPlace::kCylinder);
  EXPECT_EQ(rod.info.equation, "Fc * tanh(v / v0)");
  EXPECT_EQ(rod.info.citation,
            "Andersson, Soderberg, Bjorklund (2007), Tribology International 40");
  EXPECT_EQ(rod.info.confused_with,
            (std::vector<std::string>{"coulomb_friction", "viscous_friction"}));
  EXPECT_EQ(rod.info.separated_by, "slow moves");
  EXPECT_EQ(rod.where.line, 2);
  ASSERT_EQ(rod.info.parameters.size(), 2u);
  const EffectParameter& fc = rod.info.parameters[0];
  EXPECT_EQ(fc.name, "Fc");
  EXPECT_EQ(fc.unit, "kN");
  EXPECT_EQ(fc.meaning, "friction force");
  EXPECT_EQ(fc.si, 1e3);
  EXPECT_EQ(fc.lower, 0.0);
  EXPECT_EQ(fc.upper, 20e3);
  EXPECT_EQ(fc.typical, 3e3);
  EXPECT_TRUE(fc.linear);
  EXPECT_TRUE(fc.grid.empty());
  const EffectParameter& v0 = rod.info.parameters[1];
  EXPECT_FALSE(v0.linear);
  ASSERT_EQ(v0.grid.size(), 7u);  // two decades by ratio
  EXPECT_NEAR(v0.grid[0], 0.5e-3, 1e-18);
  EXPECT_NEAR(v0.grid[3], 5e-3, 1e-17);
  EXPECT_NEAR(v0.grid[6], 50e-3, 1e-16);
  ASSERT_EQ(rod.signals.size(), 1u);
  EXPECT_STREQ(rod.signals[0]->name, "v");
  EXPECT_TRUE(rod.in_motion());

  const UserEffectSpec& hose = specs[1];
  EXPECT_EQ(hose.info.stage, EffectStage::kPressure);
  EXPECT_EQ(hose.info.place, EffectPlace::kMachine);
  EXPECT_EQ(hose.info.title, "cold_hose");
  EXPECT_EQ(hose.info.parameters[1].grid, (std::vector<double>{0.01, 0.03, 0.06}));
  EXPECT_STREQ(hose.signals[1]->name, "oil");

  const UserEffectSpec& pump = specs[2];
  EXPECT_EQ(pump.info.place,
            EffectPlace::kPump);  // default place of an effect of stage pump
  EXPECT_EQ(pump.info.equation, "dp grows with the square of the flow");
  EXPECT_EQ(pump.info.parameters[0].typical, 0.02);
  EXPECT_TRUE(pump.info.parameters[0].linear);
  EXPECT_TRUE(pump.info.parameters[1].linear);
  EXPECT_FALSE(pump.info.parameters[2].linear);
  EXPECT_EQ(pump.info.parameters[2].grid.size(), 7u);
}

TEST(EffectFile, LawsGiveSiValuesAndDerivatives) {
  const std::vector<UserEffectSpec> specs = parse(kGoodEffects);
  const std::vector<double> p = {3e3, 5e-3};
  const std::vector<Jet> v = {Jet::variable(4e-3, 0, 1)};
  const Jet force = specs[0].law.evaluate<Jet>(v, p);
  const double t = std::tanh(0.8);
  EXPECT_DOUBLE_EQ(force.value, 3e3 * t);
  EXPECT_DOUBLE_EQ(force.gradient(0), 3e3 / 5e-3 * (1.0 - t * t));
  // 0.1 bar/(l/min) at 60 l/min and ten degrees below 40: 6 bar exp(0.3)
  const std::vector<double> k_beta = {0.1e5 * 6e4, 0.03}, flow_oil = {1e-3, 30.0};
  EXPECT_DOUBLE_EQ(specs[1].law.evaluate<double>(flow_oil, k_beta), 6e5 * std::exp(0.3));
}

// Each signal of the table can be used at its stage, has its unit, and is known where the table states it.
TEST(EffectFile, EverySignalOfTheTableIsUnderstood) {
  for (const SignalInfo& info : user_effect_signals()) {
    const bool joint = info.owner == SignalInfo::Owner::kJoint;
    const std::string name = std::string(info.name) + (joint ? "arm" : "");
    for (const char* stage : {"force", "flow", "pressure", "pump"}) {
      SCOPED_TRACE(name + " " + stage);
      const std::string unit =
          stage_dimension(std::string(stage) == "force"  ? EffectStage::kForce
                          : std::string(stage) == "flow" ? EffectStage::kFlow
                                                         : EffectStage::kPressure)
              .text();
      const std::string zero = name == "oil" ? "0[degC]" : "0";
      const std::string text = "effects:\n  - id: e\n    stage: " + std::string(stage) +
                               "\n    law: c * step(" + name + " > " + zero +
                               ")\n    parameters: {c: {unit: " + unit +
                               ", bounds: [0, 1], typical: 1}}\n";
      if (info.owner == SignalInfo::Owner::kCylinder && std::string(stage) == "pump") {
        EXPECT_THROW(parse(text), InputError);
        continue;
      }
      const UserEffectSpec spec = parse(text)[0];
      ASSERT_EQ(spec.signals.size(), 1u);
      EXPECT_EQ(spec.signals[0], &info);
      EXPECT_EQ(spec.in_motion(), info.in_motion() && info.motion_stage <= spec.info.stage);
    }
    if (!joint) {
      EXPECT_NO_THROW(parse_unit(info.unit)) << info.name;
    }
  }
}

TEST(EffectFile, JointsOfAMachineGiveTheUnitsOfTheirSignals) {
  Machine machine = parse_machine(small_machine_yaml(), "lift.yaml", "");
  machine.joints.push_back(machine.joints[0]);
  machine.joints[1].name = "out-2";
  machine.joints[1].type = JointType::kPrismatic;
  const auto law = [&](const std::string& text) {
    return parse_user_effects("effects:\n  - {id: e, stage: force, law: \"" + text +
                                  "\", parameters: {c: {unit: N, bounds: [0, 1], typical: 1}}}\n",
                              "mine.yaml", &machine)[0];
  };
  const UserEffectSpec spec = law("c * cos(q.arm) * step(qd.arm > 0[1/s]) * q.'out-2' / 1[m]");
  ASSERT_EQ(spec.signals.size(), 3u);
  EXPECT_EQ(spec.joints, (std::vector<std::string>{"arm", "arm", "out-2"}));
  EXPECT_STREQ(spec.signals[1]->name, "qd.");
  EXPECT_THROW(law("c * sin(q.'out-2')"), InputError);
  EXPECT_THROW(law("c * q.arm / 1[m]"), InputError);
  EXPECT_NO_THROW(law("c * qdd.'out-2' / 9.81[m/s^2]"));
  try {
    law("c * sin(q.amr)");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "mine.yaml:2:32: effects[e].law: got \"c * sin(q.amr)\": column 9: unknown name "
                 "\"q.amr\"; did you mean \"q.arm\"?");
  }
}

struct BrokenEffects {
  std::string what;
  std::string find,
      replace;  ///< one edit of the good file; `find` empty: `replace` is the whole file
  std::string message;
};

void PrintTo(const BrokenEffects& broken, std::ostream* out) { *out << broken.what; }

std::string broken_effect_name(const ::testing::TestParamInfo<BrokenEffects>& info) {
  std::string name = info.param.what;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

class BrokenEffectFile : public ::testing::TestWithParam<BrokenEffects> {};

TEST_P(BrokenEffectFile, IsExplained) {
  const BrokenEffects& broken = GetParam();
  std::string text = broken.replace;
  if (!broken.find.empty()) {
    const std::size_t at = kGoodEffects.find(broken.find);
    ASSERT_NE(at, std::string::npos);
    text = kGoodEffects;
    text.replace(at, broken.find.size(), broken.replace);
  }
  try {
    parse(text);
    FAIL() << "was read";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), broken.message);
  }
}

// clang-format off
INSTANTIATE_TEST_SUITE_P(All, BrokenEffectFile, ::testing::Values(
  BrokenEffects{"empty file", "", "",
    "mine.yaml: the file is empty; expected `key: value` lines"},
  BrokenEffects{"no list", "", "effects: friction\n",
    "mine.yaml:1:10: effects: got \"friction\", expected a list of effects, each beginning with - id: ..."},
  BrokenEffects{"empty list", "", "effects: []\n",
    "mine.yaml:1:10: effects: the list is empty; expected at least one effect"},
  BrokenEffects{"other top key", "effects:", "effect:",
    "mine.yaml:1:1: unknown key \"effect\"; did you mean \"effects\"?"},
  BrokenEffects{"unknown key", "    stage: force", "    phase: force",
    "mine.yaml:4:5: effects[rod_friction]: unknown key \"phase\"; known here: id, title, stage, at, law, parameters, equation, citation, confused_with, separated_by"},
  BrokenEffects{"no id", "  - id: rod_friction\n    title", "  - title",
    "mine.yaml:2:5: effects[0].id: missing; expected a name for the effect, such as my_friction"},
  BrokenEffects{"id with a colon", "id: rod_friction", "id: \"rod:friction\"",
    "mine.yaml:2:9: effects[rod:friction].id: got \"rod:friction\", expected an id of letters, digits and _ that does not begin with a digit"},
  BrokenEffects{"id of the catalogue", "id: rod_friction", "id: coulomb_friction",
    "mine.yaml:2:9: effects[coulomb_friction].id: an effect \"coulomb_friction\" exists already; choose another id, such as my_coulomb_friction"},
  BrokenEffects{"id twice", "id: cold_hose", "id: rod_friction",
    "mine.yaml:13:5: effects[rod_friction]: the id \"rod_friction\" is taken by the effect on line 2; choose another"},
  BrokenEffects{"unknown stage", "stage: force", "stage: froce",
    "mine.yaml:4:12: effects[rod_friction].stage: got \"froce\", expected one of force, flow, pressure, pump; did you mean \"force\"?"},
  BrokenEffects{"stage missing", "    stage: force\n", "",
    "mine.yaml:2:5: effects[rod_friction].stage: missing; expected one of force, flow, pressure, pump"},
  BrokenEffects{"unknown place", "at: cylinder", "at: boom",
    "mine.yaml:5:9: effects[rod_friction].at: got \"boom\", expected one of cylinder, pump, machine"},
  BrokenEffects{"force at a pump", "at: cylinder", "at: pump",
    "mine.yaml:5:9: effects[rod_friction].at: got pump, expected cylinder or machine: stage force adds to each cylinder"},
  BrokenEffects{"law missing", "    law: \"Fc * tanh(v / v0)\"\n", "",
    "mine.yaml:2:5: effects[rod_friction].law: missing; expected a formula such as Fc * sign(v)"},
  BrokenEffects{"law without value", "    law: \"Fc * tanh(v / v0)\"\n", "    law:\n",
    "mine.yaml:6:5: effects[rod_friction].law: has no value; give one or remove the key"},
  BrokenEffects{"unknown name", "tanh(v / v0)", "tanh(w / v0)",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(w / v0)\": column 11: unknown name \"w\"; known here: Fc, v0, v, a, x, stroke, F, Q, Q_return, u, direction, pA, pB, payload, oil, t, Q_pump, p_pump, Q_return_sum, q.*, qd.*, qdd.*"},
  BrokenEffects{"unknown parameter", "tanh(v / v0)", "tanh(v / vs0)",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(v / vs0)\": column 15: unknown name \"vs0\"; did you mean \"v0\"?"},
  BrokenEffects{"unknown function", "tanh(v / v0)", "tahn(v / v0)",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tahn(v / v0)\": column 6: unknown function \"tahn\"; did you mean \"tanh\"?"},
  BrokenEffects{"parenthesis", "tanh(v / v0)", "tanh(v / v0",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(v / v0\": column 10: this ( is never closed"},
  BrokenEffects{"units do not meet", "Fc * tanh(v / v0)", "Fc + v / v0",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc + v / v0\": column 4: adds \"v / v0\" (no unit) to \"Fc\" [N]; both must have the same unit"},
  BrokenEffects{"function with a unit", "tanh(v / v0)", "tanh(v) * v0",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(v) * v0\": column 11: tanh() needs a number without unit, \"v\" has [m/s]; divide it by a parameter or a number of that unit"},
  BrokenEffects{"unit of the stage", "Fc * tanh(v / v0)", "Fc * v / v0^2",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * v / v0^2\", which gives [N s/m], expected [N], the unit of stage force; it lacks a factor of [m/s]"},
  BrokenEffects{"pressure where a force is due", "unit: kN", "unit: bar",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(v / v0)\", which gives [Pa], expected [N], the unit of stage force; it lacks a factor of [m^2]"},
  BrokenEffects{"a cylinder signal at a pump", "(p_pump - 20[bar])", "(pA - 20[bar])",
    "mine.yaml:22:10: effects[pump_ripple].law: got \"dp * square(Q_pump / Q0) + slope * (pA - 20[bar])\": column 37: pA is a signal of a cylinder, and a law of stage pump is about a pump; use Q_pump, p_pump or signals of the machine"},
  BrokenEffects{"oil as a factor", "(oil - 40[degC])", "oil",
    "mine.yaml:16:10: effects[cold_hose].law: got \"k * Q * exp(-beta * oil)\": column 21: \"oil\" is a reading on the Celsius scale and is multiplied; take a difference first, as in (oil - 20[degC]), and give differences in K"},
  BrokenEffects{"unit missing", "{unit: kN, bounds", "{bounds",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc.unit: missing; expected a unit such as N, bar/(l/min)^2 or 1 for a pure number"},
  BrokenEffects{"unit misspelt", "unit: kN", "unit: KN",
    "mine.yaml:8:18: effects[rod_friction].parameters.Fc.unit: got \"KN\": column 1: unknown unit \"KN\"; did you mean \"kN\"?"},
  BrokenEffects{"unit ambiguous", "unit: bar/(l/min)", "unit: bar/l min",
    "mine.yaml:18:17: effects[cold_hose].parameters.k.unit: got \"bar/l min\": column 7: it is not clear whether \"min\" stands above or below the /; put what stands below in parentheses, as in J/(kg K)"},
  BrokenEffects{"bounds missing", "bounds: [0, 20], ", "",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc.bounds: missing; expected the plausible range [lo, hi], each a number [kN]"},
  BrokenEffects{"bounds swapped", "bounds: [0, 20]", "bounds: [20, 0]",
    "mine.yaml:8:30: effects[rod_friction].parameters.Fc.bounds: got [20, 0], expected [lo, hi] with lo < hi; swap the two"},
  BrokenEffects{"bounds with a unit", "bounds: [0, 20]", "bounds: [0, 20 kN]",
    "mine.yaml:8:34: effects[rod_friction].parameters.Fc.bounds[1]: got \"20 kN\", expected a number [kN]; write the number alone, in kN"},
  BrokenEffects{"bounds infinite", "bounds: [0, 20]", "bounds: [0, .inf]",
    "mine.yaml:8:34: effects[rod_friction].parameters.Fc.bounds[1]: got .inf, expected a number [kN]; give a finite number"},
  BrokenEffects{"typical missing", ", typical: 3,", ",",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc.typical: missing; expected the value at which the effect is clearly seen [kN]"},
  BrokenEffects{"typical outside", "typical: 3,", "typical: 3000,",
    "mine.yaml:8:48: effects[rod_friction].parameters.Fc.typical: got 3000, expected a number inside the bounds [0, 20] kN"},
  BrokenEffects{"typical zero", "typical: 3,", "typical: 0,",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc: got typical 0, at which the effect is absent; give the value at which it is clearly seen"},
  BrokenEffects{"grid for a size", "typical: 3,", "typical: 3, grid: [1, 2],",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc: has a grid, but the law is proportional to it, so it is found without a search; remove the grid"},
  BrokenEffects{"grid of one", "grid: [0.01, 0.03, 0.06]", "grid: [0.01]",
    "mine.yaml:19:67: effects[cold_hose].parameters.beta.grid: expected two values or more, from which the search starts"},
  BrokenEffects{"grid outside", "grid: [0.01, 0.03, 0.06]", "grid: [0.01, 0.3]",
    "mine.yaml:19:74: effects[cold_hose].parameters.beta.grid[1]: got 0.3, expected a number inside the bounds [0, 0.1] 1/degC"},
  BrokenEffects{"unused parameter", "tanh(v / v0)", "sign(v)",
    "mine.yaml:9:11: effects[rod_friction].parameters.v0: does not stand in the law; use it or remove it"},
  BrokenEffects{"never absent", "Fc * tanh(v / v0)", "Fc * tanh(v / v0) + 100[N]",
    "mine.yaml:6:10: effects[rod_friction].law: got \"Fc * tanh(v / v0) + 100[N]\", which is proportional to none of its parameters, so the effect could never be absent; multiply all of it by one, as in size * (...), size: {unit: 1, bounds: [0, 2], typical: 1}"},
  BrokenEffects{"parameter named like a signal", "      Fc:", "      F:",
    "mine.yaml:8:10: effects[rod_friction].parameters.F: \"F\" is a signal: static force, positive when the load pushes the rod in; give the parameter another name, such as F0"},
  BrokenEffects{"parameter named like a function", "      Fc:", "      exp:",
    "mine.yaml:8:12: effects[rod_friction].parameters.exp: \"exp\" is a function; give the parameter another name"},
  BrokenEffects{"parameter with a dash", "      Fc:", "      F-c:",
    "mine.yaml:8:12: effects[rod_friction].parameters.F-c: \"F-c\" cannot stand in a law; expected a parameter's name of letters, digits and _ that does not begin with a digit"},
  BrokenEffects{"no parameters", "    parameters:\n      Fc: {unit: kN, bounds: [0, 20], typical: 3, meaning: friction force}\n      v0: {unit: mm/s, bounds: [0.5, 50], typical: 5}\n", "    parameters: {}\n",
    "mine.yaml:7:17: effects[rod_friction].parameters: an effect needs at least one parameter, its size"},
  BrokenEffects{"parameter as a number", "Fc: {unit: kN, bounds: [0, 20], typical: 3, meaning: friction force}", "Fc: 3000",
    "mine.yaml:8:11: effects[rod_friction].parameters.Fc: got 3000, expected a parameter {unit, bounds, typical}"},
  BrokenEffects{"confused with a word", "confused_with: [coulomb_friction, viscous_friction]", "confused_with: coulomb_friction",
    "mine.yaml:11:20: effects[rod_friction].confused_with: got \"coulomb_friction\", expected a list of ids of effects or words"}
), broken_effect_name);
// clang-format on

// The example of docs/user_effects.md is read, and its tables agree with the program.
TEST(EffectFile, DocumentationAgreesWithTheProgram) {
  const std::string page = read_file(SPARFLOW_SOURCE_DIR "/docs/user_effects.md");
  const std::size_t begin = page.find("```yaml\n") + 8;
  const std::vector<UserEffectSpec> specs =
      parse(page.substr(begin, page.find("```", begin) - begin));
  EXPECT_EQ(specs.size(), 3u);
  for (const UserEffectSpec& spec : specs) EXPECT_TRUE(spec.in_motion()) << spec.info.id;
  for (const SignalInfo& s : user_effect_signals()) {
    const bool joint = s.owner == SignalInfo::Owner::kJoint;
    const std::string row =
        "| `" + std::string(s.name) + (joint ? "NAME" : "") + "` | " + s.unit + " | " + s.meaning;
    EXPECT_THAT(page, ::testing::HasSubstr(row));
    const std::size_t at = page.find(row);
    const std::string line = page.substr(at, page.find('\n', at) - at);
    const std::string motion = !s.in_motion()                          ? "| log only |"
                               : s.motion_stage == EffectStage::kForce ? "| yes |"
                               : s.motion_stage == EffectStage::kPump
                                   ? "| in stage pump |"
                                   : "| from stage pressure on |";
    EXPECT_TRUE(line.ends_with(motion)) << line;
  }
  for (const ExpressionFunction& function : expression_functions()) {
    EXPECT_THAT(page, ::testing::HasSubstr("`" + std::string(function.name) + "("));
  }
  EXPECT_THAT(page, ::testing::HasSubstr("\n" + known_units() + "\n"));
}

TEST(EffectFile, ALawTooLongOrDeepIsRefusedInOneSentence) {
  for (const std::size_t depth : {200u, 100000u}) {
    std::string text = kGoodEffects;
    text.replace(text.find("Fc * tanh"), 2,
                 std::string(depth, '(') + "Fc" + std::string(depth, ')'));
    try {
      parse(text);
      ADD_FAILURE() << "was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.place.line, 6);
      EXPECT_THAT(error.what(), ::testing::HasSubstr(depth > 200 ? "longer than 10000 characters"
                                                                 : "nested more than 100 deep"));
      EXPECT_LT(std::string(error.what()).size(), 600u);
    }
  }
}

TEST(EffectFile, AFileThatCannotBeReadIsNamed) {
  try {
    register_user_effects_file("/no/such/effects.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "/no/such/effects.yaml: cannot read: No such file or directory; check the path");
  }
}

TEST(EffectFile, LoadsFromDisk) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("effects_" + std::to_string(::getpid()) + ".yaml"))
          .string();
  const UserEffectScope scope;
  write_file_atomically(path, kGoodEffects);
  EXPECT_EQ(register_user_effects_file(path).size(), 3u);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace sparflow
