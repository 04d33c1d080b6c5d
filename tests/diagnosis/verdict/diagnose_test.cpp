/// Diagnosis end to end, from logs with a simulated effect to a verdict.
#include "diagnosis/verdict/diagnose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "diagnosis/verdict/diagnosed_effect.h"
#include "identification/learning/fit.h"
#include "models/math/error.h"
#include "tests/diagnosis/hidden_case.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using simulator::HiddenEffect;
using simulator::LogChannels;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::UnorderedElementsAre;
using testing_support::drawn_machine;
using testing_support::hidden_case;
using testing_support::HiddenCase;

constexpr double kSeconds = 100.0;
/// The crane and its seed, from which every simulated effect and base law follows.
constexpr std::uint64_t kSeed = 7;

const Machine& crane() {
  static const Machine machine = drawn_machine("loader_crane");
  return machine;
}

CraneModel learned(const Machine& machine, const Log& log) {
  FitOptions options;
  options.hold_out_every = 0;
  return fit(machine, {log}, {}, options).model;
}

/// A model learned from a reference log of the same crane, in which no effect acts.
const CraneModel& reference_model() {
  static const CraneModel model =
      learned(crane(), hidden_case(crane(), {}, {kSeed, kSeconds}).reference);
  return model;
}

struct Answer {
  HiddenCase logs;
  Diagnosis diagnosis;
  std::vector<std::string> keys() const {
    std::vector<std::string> all;
    for (const DiagnosedEffect& e : diagnosis.effects) all.push_back(e.key());
    return all;
  }
  const DiagnosedEffect* find(const std::string& key) const {
    for (const DiagnosedEffect& e : diagnosis.effects) {
      if (e.key() == key) return &e;
    }
    return nullptr;
  }
  double value(const std::string& key, const std::string& parameter) const {
    const DiagnosedEffect* e = find(key);
    if (e == nullptr) return NAN;
    const std::vector<EffectParameter>& p = e->effect.effect->info().parameters;
    for (std::size_t k = 0; k < p.size(); ++k) {
      if (p[k].name == parameter) return e->applied.values[k];
    }
    return NAN;
  }
  /// Relative error of a parameter.
  double error(const std::string& key, const std::string& parameter) const {
    const std::string id = key.substr(0, key.find(':'));
    return std::abs(value(key, parameter) / logs.truth(id, parameter) - 1.0);
  }
};

/// A diagnosis with the reference log.
Answer with_reference(const std::vector<HiddenEffect>& effects) {
  Answer a{hidden_case(crane(), effects, {kSeed, kSeconds}), {}};
  a.diagnosis = diagnose(reference_model(), {a.logs.train}, {a.logs.reference});
  return a;
}

/// A diagnosis from the suspect log alone.
Answer alone(const std::vector<HiddenEffect>& effects, const LogChannels& channels = {}) {
  Answer a{hidden_case(crane(), effects, {kSeed, kSeconds, channels}), {}};
  a.diagnosis = diagnose(learned(crane(), a.logs.train), {a.logs.train});
  return a;
}

/// Used by several tests.
const Answer& friction_of_bristles() {
  static const Answer a = alone({{"coulomb_friction", "boom", 1.0, 1}});
  return a;
}
const Answer& late_pump() {
  static const Answer a = with_reference({{"pump_lag", "main", 1.0, 0}});
  return a;
}

TEST(Diagnose, NothingIsMissingWhereNothingIs) {
  const Answer with = with_reference({});
  EXPECT_EQ(with.diagnosis.verdict, Verdict::kNone) << with.diagnosis.table();
  EXPECT_THAT(with.diagnosis.effects, IsEmpty());
  EXPECT_GE(with.diagnosis.p_value, 0.05);  // SearchOptions::false_alarm
  EXPECT_THAT(with.diagnosis.table(), HasSubstr("no more than noise would"));
  Diagnosis more = with.diagnosis;
  more.p_value = 0.001;
  EXPECT_THAT(more.table(), HasSubstr("but the references show it as well"));
  // Alone by several seeds: two of eight below 0.05 have a probability of 6 % if chance is as told, three of 0.6 %.
  int below = 0;
  for (std::uint64_t seed = kSeed; seed < kSeed + 8; ++seed) {
    const HiddenCase logs = hidden_case(crane(), {}, {seed, kSeconds});
    const Diagnosis d = diagnose(learned(crane(), logs.train), {logs.train});
    EXPECT_EQ(d.verdict, Verdict::kNone) << seed << '\n' << d.table();
    EXPECT_THAT(d.effects, IsEmpty()) << seed;
    below += d.p_value < 0.05 ? 1 : 0;
  }
  EXPECT_LE(below, 2);
}

// In every test of this file parameters are within 10 %, as required for a clear effect in five minutes of motion, here from
// less than two minutes.
TEST(Diagnose, CoulombFriction) {
  const Answer& a = friction_of_bristles();  // not the sign function, which is the catalogue's law
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing);
  ASSERT_THAT(a.keys(), ElementsAre("coulomb_friction:boom"));
  EXPECT_LT(a.error("coulomb_friction:boom", "Fc"), 0.1);
  const DiagnosedEffect& e = a.diagnosis.effects[0];
  EXPECT_EQ(e.stage, "force");
  // Less than one half would make another effect the likelier one.
  EXPECT_GE(e.probability, 0.5);
  EXPECT_LT(e.parameters[0].lower95, e.parameters[0].value);
  EXPECT_GT(e.parameters[0].upper95, e.parameters[0].value);
  EXPECT_LT(e.absorbed, 1e-9) << "nothing is learned at the force stage";
  ASSERT_FALSE(e.channels.empty());
  // A clear effect at least halves the squared error of its channel.
  EXPECT_LT(e.channels[0].rmse_after, 0.7 * e.channels[0].rmse_before);
}

/// A long log proves what no error shows: an effect must reduce one of them by a factor (two percent, here a thousandfold).
TEST(Diagnose, WhatLowersNoErrorIsNotNamed) {
  const HiddenCase logs =
      hidden_case(crane(), {{"coulomb_friction", "boom", 1.0, 1}}, {kSeed, kSeconds});
  DiagnoseOptions options;
  options.verdict.least_reduction = 1000.0;
  const Diagnosis d = diagnose(learned(crane(), logs.train), {logs.train}, {}, options);
  EXPECT_THAT(d.effects, IsEmpty());
  EXPECT_NE(d.verdict, Verdict::kMissing);
  EXPECT_THAT(
      d.table(),
      HasSubstr("coulomb_friction:boom is not named: it lowers no error by more than 99.9 %"));
}
TEST(Diagnose, Mass) {
  const Answer a = alone({{"unmodelled_mass", "jib", 1.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing);
  ASSERT_FALSE(a.diagnosis.effects.empty());
  const DiagnosedEffect& e = a.diagnosis.effects[0];
  EXPECT_THAT(a.diagnosis.effects, testing::SizeIs(1));
  ASSERT_EQ(e.key(), "unmodelled_mass:jib");
  EXPECT_LT(a.error(e.key(), "mass"), 0.1);
  EXPECT_LT(a.error(e.key(), "moment"), 0.1);
}

/// Hoses or a valve block on top of a link: without the moment across the link, an angle offset is found in its place.
TEST(Diagnose, AMassBesideItsLink) {
  const Answer a = alone({{"unmodelled_mass", "jib", 1.0, 2}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
  ASSERT_THAT(a.keys(), ElementsAre("unmodelled_mass:jib")) << a.diagnosis.table();
  EXPECT_LT(a.error("unmodelled_mass:jib", "moment"), 0.1);
  EXPECT_LT(a.error("unmodelled_mass:jib", "cross_moment"), 0.1);
}

/// A load attachment that the log does not contain, and a scale that reads 1 % too little.
TEST(Diagnose, AScaleErrorBesideAnUnloggedLoad) {
  const Answer a = alone({{"payload_error", "", 1.0, 1}});
  ASSERT_THAT(a.diagnosis.effects, testing::SizeIs(1)) << a.diagnosis.table();
  const DiagnosedEffect& e = a.diagnosis.effects[0];
  EXPECT_EQ(e.key(), "payload_error");
  EXPECT_LT(a.error(e.key(), "mass"), 0.1);
  EXPECT_NEAR(a.value(e.key(), "scale"), 0.01, 0.005) << "share of the load";
}

TEST(Diagnose, PumpLag) {
  const Answer own = alone({{"pump_lag", "main", 1.0, 0}});
  for (const Answer* a : {&own, &late_pump()}) {
    EXPECT_EQ(a->diagnosis.verdict, Verdict::kMissing) << a->diagnosis.table();
    ASSERT_THAT(a->keys(), ElementsAre("pump_lag:main"));
    EXPECT_LT(a->error("pump_lag:main", "tau"), 0.1);
  }
}

TEST(Diagnose, ReturnBackPressure) {
  const Answer a = with_reference({{"return_back_pressure", "", 1.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
  ASSERT_THAT(a.keys(), ElementsAre("return_back_pressure"));
  EXPECT_LT(a.error("return_back_pressure", "k"), 0.1);
}

TEST(Diagnose, DeadBand) {
  for (const int law : {0, 2}) {  // a sharp knee and a smooth one
    const Answer a = alone({{"valve_deadband", "boom", 1.0, law}});
    EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
    ASSERT_THAT(a.keys(), ElementsAre("valve_deadband:boom"));
    EXPECT_LT(a.error("valve_deadband:boom", "u0_extend"), 0.1);
    EXPECT_LT(a.error("valve_deadband:boom", "u0_retract"), 0.1);
  }
}

// The rod side's sensor has an offset, and so has the measured force. While extending, the bore side's pressure then
// seems inconsistent with the force, but no valve on that side causes it.
TEST(Diagnose, APressureSensorsOffsetIsNoValveOnTheOtherSide) {
  const Answer a = with_reference({{"pressure_offset", "jib", 1.0 / 3.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
  ASSERT_THAT(a.keys(), ElementsAre("pressure_offset:jib"));
  EXPECT_LT(a.error("pressure_offset:jib", "offset"), 0.1);
}

// The pump follows a spool that closes late, so its error is large, but a pump lag explains little of it.
TEST(Diagnose, AValveLagIsNoPumpLag) {
  const Answer a = with_reference({{"valve_lag", "boom", 1.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
  EXPECT_THAT(a.keys(), ElementsAre("valve_lag:boom"));
}

TEST(Diagnose, AStickingSpoolIsNotInTheCatalogue) {
  for (const int law : {0, 1}) {
    const Answer a = with_reference({{"spool_hysteresis", "boom", 1.0, law}});
    EXPECT_EQ(a.diagnosis.verdict, Verdict::kUnknown) << a.diagnosis.table();
    ASSERT_TRUE(a.diagnosis.unexplained.has_value());
  }
}

TEST(Diagnose, APair) {
  const Answer a =
      with_reference({{"coulomb_friction", "jib", 1.0, 0}, {"pump_lag", "main", 1.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kMissing) << a.diagnosis.table();
  EXPECT_THAT(a.keys(), UnorderedElementsAre("coulomb_friction:jib", "pump_lag:main"));
  EXPECT_LT(a.error("coulomb_friction:jib", "Fc"), 0.1);
  EXPECT_LT(a.error("pump_lag:main", "tau"), 0.1);
}

TEST(Diagnose, RippleOfThePumpIsNotInTheCatalogue) {
  const Answer a = alone({{"pump_ripple", "", 1.0, 0}});
  EXPECT_EQ(a.diagnosis.verdict, Verdict::kUnknown) << a.diagnosis.table();
  ASSERT_TRUE(a.diagnosis.unexplained.has_value());
  EXPECT_EQ(a.diagnosis.unexplained->stage, "pump");
  EXPECT_EQ(a.diagnosis.unexplained->at, "main");
  EXPECT_THAT(a.diagnosis.unexplained->depends_on, Contains(HasSubstr("time")));
  EXPECT_THAT(a.diagnosis.headline(), Not(IsEmpty()));
}

TEST(Diagnose, ADriftingSensorIsNotInTheCatalogue) {
  // the apparent effect in pressures and pump is the smaller part of a structure in the force, from the same sensor
  for (const int law : {0, 1}) {
    const Answer a = with_reference({{"pressure_drift", "boom", 1.0, law}});
    EXPECT_EQ(a.diagnosis.verdict, Verdict::kUnknown) << a.diagnosis.table();
    ASSERT_TRUE(a.diagnosis.unexplained.has_value());
    EXPECT_EQ(a.diagnosis.unexplained->at, "boom") << a.diagnosis.table();
  }
}

TEST(Diagnose, APositionThatIsSetAsideForSecondsDoesNotStopTheLaws) {
  HiddenCase logs = hidden_case(crane(), {}, {kSeed, kSeconds});
  const auto q = std::find_if(logs.train.channels.begin(), logs.train.channels.end(),
                              [](const Channel& c) { return c.signal == "q_jib"; });
  ASSERT_NE(q, logs.train.channels.end());
  const Eigen::Index from = logs.train.samples() / 3, count = logs.train.samples() / 5;
  q->values.segment(from, count).setConstant(q->values[from]);  // stuck for twenty seconds
  const Diagnosis d = diagnose(reference_model(), {logs.train}, {logs.reference});
  ASSERT_EQ(d.set_aside.size(), 1u) << d.table();
  EXPECT_EQ(d.set_aside.front().channel, "q_jib");
  EXPECT_EQ(d.verdict, Verdict::kNone) << d.table();
}

TEST(Diagnose, AFaultInAReferenceIsSetAsideAndNamed) {
  HiddenCase logs = hidden_case(crane(), {}, {kSeed, kSeconds});
  const auto p = std::find_if(logs.reference.channels.begin(), logs.reference.channels.end(),
                              [](const Channel& c) { return c.signal == "pA_jib"; });
  ASSERT_NE(p, logs.reference.channels.end());
  const Eigen::Index from = logs.reference.samples() / 3, count = logs.reference.samples() / 5;
  p->values.segment(from, count).setConstant(p->values[from]);  // stuck for twenty seconds
  const Diagnosis d = diagnose(reference_model(), {logs.train}, {logs.reference});
  ASSERT_EQ(d.set_aside.size(), 1u) << d.table();
  EXPECT_EQ(d.set_aside.front().channel, "pA_jib");
  EXPECT_EQ(d.set_aside.front().file, logs.reference.file);
  EXPECT_EQ(d.verdict, Verdict::kNone) << d.table();
  EXPECT_THAT(d.table(), HasSubstr("Set aside: " + logs.reference.file + ": pA_jib"));
}

TEST(Diagnose, ARipplingPositionIsSetAsideInItsStretch) {
  HiddenCase logs = hidden_case(crane(), {}, {kSeed, kSeconds});
  EXPECT_TRUE(diagnosis_signals(crane(), {logs.train}, {}, {}).set_aside.empty());
  const auto q = std::find_if(logs.train.channels.begin(), logs.train.channels.end(),
                              [](const Channel& c) { return c.signal == "q_jib"; });
  ASSERT_NE(q, logs.train.channels.end());
  for (Eigen::Index k = 0; k < logs.train.samples(); ++k) {
    const double t = logs.train.time[k];
    if (t > 20.0 && t < 32.0) q->values[k] += 8e-3 * std::sin(2.0 * M_PI * 11.0 * t);
  }
  const DiagnosisSignals signals = diagnosis_signals(crane(), {logs.train}, {}, {});
  ASSERT_EQ(signals.set_aside.size(), 1u);
  const BadChannel& bad = signals.set_aside.front().channel;
  EXPECT_EQ(bad.channel, "q_jib");
  EXPECT_EQ(bad.kind, BadDataKind::kRippling);
  EXPECT_NEAR(bad.from_s, 20.0, 1.5);
  EXPECT_NEAR(bad.to_s, 32.0, 1.5);
  // the rest takes part as before
  const Mask& usable = signals.suspects.front().usable;
  for (Eigen::Index k = 0; k < usable.size(); ++k) {
    const double t = logs.train.time[k];
    EXPECT_EQ(usable[k], t < bad.from_s || t > bad.to_s) << t;
  }
}

TEST(Diagnose, AShareWhoseIntervalExcludesOneIsSaidToBeAPartOfTheLaw) {
  DiagnosedEffect e;
  e.parameters = {{"share", "-", "", 0.52, 0.48, 0.56}, {"delay", "s", "", 0.2, 0.1, 0.3}};
  EXPECT_THAT(partial_law(e), testing::HasSubstr("0.520 (0.480 to 0.560), not one"));
  e.parameters[0].upper95 = 1.04;
  EXPECT_EQ(partial_law(e), "");
  e.parameters[0] = {"share", "-", "", 1.87, 1.7, 2.0};
  EXPECT_NE(partial_law(e), "");
  e.parameters[0].determined = false;
  EXPECT_EQ(partial_law(e), "") << "no value of it is shown";
  e.parameters.erase(e.parameters.begin());
  EXPECT_EQ(partial_law(e), "") << "an effect without a share";
}

TEST(Diagnose, ABrokenSensorIsSetAsideAndTheRestIsJudged) {
  for (const int law : {0, 1, 2}) {
    const HiddenCase logs =
        hidden_case(crane(), {{"sensor_fault", "pA_jib", 1.0, law}}, {kSeed, kSeconds});
    const Diagnosis d = diagnose(reference_model(), {logs.train});
    EXPECT_EQ(d.verdict, Verdict::kNone) << "law " << law << "\n" << d.table();
    ASSERT_EQ(d.set_aside.size(), 1u) << "law " << law;
    EXPECT_EQ(d.set_aside.front().channel, "pA_jib");
    EXPECT_FALSE(d.table().empty());
  }
}

TEST(Diagnose, MissingColumnsAreNotedAndTheRestIsJudged) {
  LogChannels few;
  few.pumps = false;
  few.oil = false;
  Answer a = alone({{"coulomb_friction", "boom", 1.0, 0}}, few);
  EXPECT_THAT(a.keys(), ElementsAre("coulomb_friction:boom")) << a.diagnosis.table();
  EXPECT_THAT(a.diagnosis.notes, Contains(HasSubstr("pump main")));
  few = {};
  few.pressure_b = false;
  a = alone({{"valve_deadband", "boom", 1.0, 0}}, few);
  EXPECT_THAT(a.keys(), ElementsAre("valve_deadband:boom")) << a.diagnosis.table();
  EXPECT_THAT(a.diagnosis.notes, Contains(HasSubstr("force effects cannot be judged")));
}

TEST(Diagnose, WithoutCommandsForcesAreStillJudged) {
  LogChannels channels;
  channels.commands = false;
  const Answer a = alone({{"coulomb_friction", "boom", 1.0, 0}}, channels);
  EXPECT_THAT(a.keys(), ElementsAre("coulomb_friction:boom")) << a.diagnosis.table();
  EXPECT_LT(a.error("coulomb_friction:boom", "Fc"), 0.1);
  EXPECT_THAT(a.diagnosis.notes, Contains(HasSubstr("valve effects cannot be judged")));
}

TEST(Diagnose, ALogInWhichNothingMovesDecidesNothing) {
  const std::string whole = simulator::csv_text(
      testing_support::hidden_case(reference_model().machine, {}, {5, 90.0}).logs.train);
  std::size_t end = 0;
  for (int line = 0; line < 40; ++line)
    end = whole.find('\n', end) + 1;  // 0.8 s before the first motion
  const Diagnosis d =
      diagnose(reference_model(),
               {log_from_text("rest.csv", whole.substr(0, end), reference_model().machine)});
  EXPECT_EQ(d.verdict, Verdict::kUnknown);
  EXPECT_THAT(d.headline(), HasSubstr("Nothing can be judged"));
  EXPECT_THAT(d.table(), testing::Not(HasSubstr("Probability of this evidence")));
  EXPECT_THAT(d.notes, testing::Not(Contains(HasSubstr("no command is logged"))));
  EXPECT_THAT(d.notes, Contains(HasSubstr("too short")));
}

TEST(Diagnose, AnotherMachine) {
  const Machine machine = drawn_machine("excavator");
  const std::string at = machine.cylinders[1].name;
  HiddenCase logs = hidden_case(machine, {{"viscous_friction", at, 1.0, 0}}, {11, kSeconds});
  const Diagnosis d = diagnose(learned(machine, logs.train), {logs.train});
  EXPECT_EQ(d.verdict, Verdict::kMissing) << d.table();
  ASSERT_THAT(d.effects, testing::SizeIs(1));
  EXPECT_EQ(d.effects[0].key(), "viscous_friction:" + at);
  EXPECT_LT(std::abs(d.effects[0].applied.values[0] / logs.truth("viscous_friction", "B") - 1.0),
            0.1);
}

TEST(Diagnose, WhatTheModelHasIsNotMissing) {
  const Answer& a = friction_of_bristles();
  ASSERT_FALSE(a.diagnosis.effects.empty());
  CraneModel model = reference_model();
  model.effects = {a.diagnosis.effects[0].applied};
  const Diagnosis again = diagnose(model, {a.logs.train});
  EXPECT_EQ(again.verdict, Verdict::kNone) << again.table();
}

TEST(Diagnose, SameLogsSameAnswerAndJsonOfTheContract) {
  const Answer& a = late_pump();
  const Diagnosis again = diagnose(reference_model(), {a.logs.train}, {a.logs.reference});
  nlohmann::json one = test_support::parsed_json(a.diagnosis.json()),
                 two = test_support::parsed_json(again.json());
  one.erase("seconds");
  two.erase("seconds");
  EXPECT_EQ(one, two);
  EXPECT_EQ(one.at("verdict"), "missing");
  for (const char* key : {"p_value", "effects", "indistinguishable"})
    EXPECT_TRUE(one.contains(key));
  ASSERT_FALSE(one.at("effects").empty());
  const nlohmann::json& e = one.at("effects").at(0);
  for (const char* key : {"id", "at", "stage", "probability", "parameters", "rmse_before",
                          "rmse_after", "rmse_noise_floor", "absorbed"}) {
    EXPECT_TRUE(e.contains(key)) << key;
  }
  EXPECT_EQ(e.at("parameters").at(0).at("ci95").size(), 2u);
}

TEST(Diagnose, ChanceIsGivenAsABoundWhereTheSimulationsEnd) {
  Diagnosis d;
  d.search.simulations = 60;
  d.p_value = 1.0 / 61.0;
  EXPECT_EQ(d.p_value_text(), "below 0.016");
  EXPECT_THAT(d.table(), HasSubstr("below 0.016"));
  d.p_value = 2.0 / 61.0;
  EXPECT_EQ(d.p_value_text(), "0.033");
  d.search.simulations = 300;
  d.p_value = 1.0 / 301.0;
  EXPECT_EQ(d.p_value_text(), "below 0.0033");
}

TEST(Diagnose, NeedsALog) { EXPECT_THROW(diagnose(reference_model(), {}), InputError); }

// ------------------------------------------------------------------------------------------- real logs

const std::string kBeside = SPARFLOW_SOURCE_DIR "/../shared/";

TEST(DiagnoseRealCrane, MassThenCoulombNeverViscous) {
  if (!std::filesystem::exists(kBeside + "data/hmf_2020_k4"))
    GTEST_SKIP() << "no logs of the real crane beside the source tree";
  const Machine machine = load_machine(kBeside + "machines/hmf_2020_k4.yaml");
  std::vector<Log> logs;
  for (const char* name : {"MainSTDTest1_270325", "MainSineTest_230425", "Dual2SineTest_230425",
                           "Dual1SineRun_230425"}) {
    logs.push_back(load_log(kBeside + "data/hmf_2020_k4/" + name + ".csv", machine));
  }
  FitOptions options;
  options.hold_out_every = 0;
  const Diagnosis d = diagnose(fit(machine, logs, {}, options).model, logs);
  std::vector<std::string> in_order;  // in the order in which they were found
  double coulomb = NAN;
  for (const FoundEffect& f : d.search.found) {
    in_order.push_back(effect_key(f.design.effect.effect->info(), machine, f.design.effect.at));
    if (in_order.back() == "coulomb_friction:main") coulomb = f.values[0];
  }
  const auto position = [&](const std::string& start) {
    for (std::size_t i = 0; i < in_order.size(); ++i) {
      if (in_order[i].rfind(start, 0) == 0) return i;
    }
    return in_order.size();
  };
  const std::size_t mass = std::min(position("unmodelled_mass"), position("payload_error"));
  EXPECT_LT(mass, position("coulomb_friction:main")) << d.table();
  EXPECT_LT(position("coulomb_friction:main"), in_order.size()) << d.table();
  EXPECT_EQ(position("viscous_friction"), in_order.size()) << d.table();
  EXPECT_NEAR(coulomb, 4000.0, 400.0) << "as measured by the crane's authors";
}

TEST(DiagnoseRealDrive, InertiaViscousCoulombOffset) {
  const std::string path = kBeside + "data/emps/estimation.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no log of the drive beside the source tree";
  const Machine machine = load_machine(kBeside + "machines/emps.yaml");
  const Diagnosis d = diagnose(CraneModel::untrained(machine), {load_log(path, machine)});
  std::vector<std::string> keys;
  std::map<std::string, double> value;
  for (const DiagnosedEffect& e : d.effects) {
    keys.push_back(e.key());
    value[e.id] = e.applied.values[0];
  }
  EXPECT_THAT(keys, UnorderedElementsAre("inertia", "viscous_friction:axis",
                                         "coulomb_friction:axis", "force_offset:axis"))
      << d.table();
  // published: 203.50 N s/m, 20.394 N, -3.165 N, 95.109 kg (the machine file's 95.11)
  // 2 %, because they differ by 1.4 %. The drive's friction is not exactly linear in speed, so both depend on the
  // filter: with that of the publication (100 Hz, starts and stops kept) the same regression gives 204.3 and 20.32.
  EXPECT_NEAR(value["viscous_friction"], 203.5, 0.02 * 203.5);
  EXPECT_NEAR(value["coulomb_friction"], 20.394, 0.02 * 20.394);
  // 10 %: starts and stops, which count less here than in that regression, move it by 7.5 %, or by 1 % of the friction
  EXPECT_NEAR(value["force_offset"], -3.165, 0.1 * 3.165);
  EXPECT_NEAR(value["inertia"], 1.0, 0.01);
}

/// The mass found first explains both causes; once the tilt is found, two masses explain what the true one does alone.
TEST(Diagnose, OneMassForTwo) {
  const HiddenCase logs = hidden_case(
      crane(), {{"unmodelled_mass", "jib", 1.0, 0}, {"base_tilt", "", 1.0, 0}}, {3, kSeconds});
  const Diagnosis d = diagnose(learned(crane(), logs.reference), {logs.train}, {logs.reference});
  std::vector<std::string> keys;
  for (const DiagnosedEffect& e : d.effects) keys.push_back(e.key());
  EXPECT_THAT(keys, UnorderedElementsAre("unmodelled_mass:jib", "base_tilt")) << d.table();
}

/// "..., where 93 % of what ..." -> 93
double share_there(const std::string& sentence) {
  const std::size_t at = sentence.find("where ");
  return at == std::string::npos ? 0.0 : std::stod(sentence.substr(at + 6));
}

/// In one short stroke only, the boom is held back as if by friction.
TEST(Diagnose, AnIsolatedEventIsNeitherALawNorNoise) {
  HiddenCase logs = hidden_case(crane(), {}, {kSeed, kSeconds});
  simulator::GeneratedLog& train = logs.logs.train;
  const auto column = [&](const std::string& name) -> std::vector<double>& {
    const auto at = std::find(train.names.begin(), train.names.end(), name);
    return train.columns.at(static_cast<std::size_t>(at - train.names.begin()));
  };
  const std::vector<double>& lever = column("u_boom");
  std::size_t from = 0, to = 0;
  for (std::size_t k = 1; k < train.rows(); ++k) {
    if (lever[k] > 0.0 && lever[k - 1] == 0.0) from = k;
    if (lever[k] == 0.0 && lever[k - 1] > 0.0 && k - from >= 50 && k - from <= 100) {
      to = k;
      break;
    }
  }
  ASSERT_GT(to, from) << "no stroke of one to two seconds";
  for (std::size_t k = from; k < to; ++k) column("pA_boom_bar")[k] += 15.0;
  logs.train = log_from_text("train.csv", simulator::csv_text(train), crane());
  const Diagnosis d = diagnose(reference_model(), {logs.train}, {logs.reference});
  EXPECT_EQ(d.verdict, Verdict::kUnknown) << d.table();
  ASSERT_TRUE(d.unexplained) << d.table();
  EXPECT_TRUE(d.unexplained->few_places) << d.table();
  EXPECT_THAT(d.headline(), HasSubstr("no law can be tested: force of boom"));
  EXPECT_GT(share_there(d.headline()), 80.0) << d.headline();
  const double when = column("t_s")[from];
  EXPECT_NEAR(std::stod(d.headline().substr(d.headline().find("from ") + 5)), when, 1.0)
      << d.headline();
  // a reference that ends before the boom moves twice cannot tell whether that is new
  simulator::GeneratedLog& reference = logs.logs.reference;
  const auto boom = std::find(reference.names.begin(), reference.names.end(), "u_boom");
  const std::vector<double>& u =
      reference.columns.at(static_cast<std::size_t>(boom - reference.names.begin()));
  std::size_t end = 1;
  for (int starts = 0; end < u.size(); ++end)
    if (u[end] != 0.0 && u[end - 1] == 0.0 && ++starts == 2) break;
  for (std::vector<double>& values : reference.columns) values.resize(end);
  const Log short_reference =
      log_from_text("reference.csv", simulator::csv_text(reference), crane());
  const Diagnosis untold = diagnose(reference_model(), {logs.train}, {short_reference});
  EXPECT_EQ(untold.verdict, Verdict::kNone) << untold.table();
  EXPECT_THAT(untold.notes, testing::Contains(testing::AllOf(HasSubstr("force of boom"),
                                                             HasSubstr("too few motions there"))));
}

}  // namespace
}  // namespace sparflow
