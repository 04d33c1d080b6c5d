#include "diagnosis/extension/extend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "diagnosis/selection/effect_estimate.h"
#include "models/files/model_file.h"
#include "models/math/error.h"
#include "tests/identification/arm_log.h"
#include "tests/parsed_json.h"

namespace sparflow {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing_support::arm_log;
using testing_support::arm_log_with_friction;
using testing_support::arm_machine;
using testing_support::arm_model;

constexpr double kFriction = 5e3;  // [N]

EffectAt coulomb() { return parse_effect("coulomb_friction:arm", arm_machine()); }

/// A model learned from a log with friction, without that effect.
const CraneModel& ignorant_model() {
  static const CraneModel model = fit(arm_machine(), {arm_log_with_friction(kFriction, 1)}).model;
  return model;
}

ExtendLogs logs_with_friction() {
  return {{arm_log_with_friction(kFriction, 1)}, {}, {arm_log_with_friction(kFriction, 2)}};
}

const ExtendResult& extended() {
  static const ExtendResult result = extend(ignorant_model(), {coulomb()}, logs_with_friction());
  return result;
}

double force_error(const CompareResult& r) { return r.find("force", "arm")->rmse; }

TEST(EstimateEffects, RecoversTheForce) {
  const CraneModel model = arm_model();
  const std::vector<MachineSignals> signals = {
      make_signals(model.machine, arm_log_with_friction(kFriction))};
  const EffectEstimate e = estimate_effects(model, {coulomb()}, {signals});
  ASSERT_THAT(e.effects, SizeIs(1));
  // 0.8 bar on 113 cm^2 is 0.9 kN for each of about a hundred independent samples: 2 % of 5 kN is two deviations
  EXPECT_NEAR(e.effects[0].values[0], kFriction, 0.03 * kFriction);
  EXPECT_LT(e.effects[0].lower95[0], e.effects[0].values[0]);
  EXPECT_LT(e.effects[0].upper95[0] - e.effects[0].lower95[0], 0.2 * kFriction);
  EXPECT_THAT(e.notes, IsEmpty());
}

TEST(EstimateEffects, AllEffectsTogether) {
  // an unmodelled mass and friction together: each alone would be estimated wrongly
  CraneModel model = arm_model();
  model.machine.links[0].mass -= 60.0;  // the log was made with this mass
  const std::vector<MachineSignals> signals = {
      make_signals(model.machine, arm_log_with_friction(kFriction))};
  const EffectEstimate e = estimate_effects(
      model, {coulomb(), parse_effect("unmodelled_mass:arm", model.machine)}, {signals});
  ASSERT_THAT(e.effects, SizeIs(2));
  // The mass takes part of the data, so that the friction is less certain than alone (3 % above).
  EXPECT_NEAR(e.effects[0].values[0], kFriction, 0.05 * kFriction);
  // one joint determines only its moment: 60 kg at 1.5 m
  EXPECT_NEAR(e.effects[1].values[1], 90.0, 9.0);
}

TEST(EstimateEffects, AnEffectThatTheLogDoesNotHaveIsNotSignificant) {
  const CraneModel model = arm_model();
  const std::vector<MachineSignals> signals = {
      make_signals(model.machine, arm_log_with_friction(kFriction))};
  const EffectEstimate e = estimate_effects(
      model, {coulomb(), parse_effect("unmodelled_mass:arm", model.machine)}, {signals});
  EXPECT_THAT(e.significant, ElementsAre(true, false))
      << "the log has friction and no unmodelled mass";
}

TEST(EstimateEffects, SamplesLeftOutTakeNoPart) {
  const CraneModel model = arm_model();
  Log log = arm_log_with_friction(kFriction);
  // the second half has another friction, which must have no influence when it is left out
  const Eigen::Index n = log.time.size(), half = n / 2;
  const Eigen::VectorXd& u = testing_support::channel(log, "u_arm").values;
  const double area = arm_machine().cylinders[0].area_piston();
  for (Eigen::Index k = half; k < n; ++k) {
    const double side = u[k] > 0.0 ? 1.0 : u[k] < 0.0 ? -1.0 : 0.0;
    testing_support::channel(log, "pA_arm").values[k] += side * 20e3 / area;
  }
  const std::vector<MachineSignals> signals = {make_signals(model.machine, log)};
  Mask second = Mask::Constant(n, false);
  second.tail(n - half).setConstant(true);
  const EffectEstimate e = estimate_effects(model, {coulomb()}, {signals, {}, {second}});
  // Half of the samples make the 3 % of the whole log larger by sqrt(2). The other half would add 20 kN.
  EXPECT_NEAR(e.effects[0].values[0], kFriction, 0.05 * kFriction);
}

TEST(EstimateEffects, AnErrorNamesTheSignalsThatTheLogsLack) {
  Log log = arm_log();
  testing_support::remove_channel(log, "pA_arm");
  testing_support::remove_channel(log, "pB_arm");
  const CraneModel model = arm_model();
  const std::vector<MachineSignals> signals = {make_signals(model.machine, log)};
  try {
    estimate_effects(model, {coulomb()}, {signals});
    FAIL() << "friction from a log without a force";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("coulomb_friction:arm"));
    EXPECT_THAT(e.what(), HasSubstr("it needs"));
  }
}

TEST(Extend, ErrorFallsOnTestLogsAndNothingElseRises) {
  const ExtendResult& r = extended();
  ASSERT_THAT(r.steps, SizeIs(1));
  const ExtendStep& step = r.steps[0];
  EXPECT_EQ(step.added, "coulomb_friction:arm");
  EXPECT_EQ(step.judged_on, "test logs");
  // from 5 kN to the noise of one sample, 0.8 bar on both chambers: 1.1 kN
  EXPECT_NEAR(force_error(step.before), kFriction, 0.15 * kFriction);
  // 1.1 kN is 0.22 of 5 kN; a third more for starts and stops.
  EXPECT_LT(force_error(step.after), 0.3 * kFriction);
  EXPECT_LT(step.change.own, 0.3);
  EXPECT_FALSE(step.change.worse());
  for (const StageScore& after : step.after.scores) {
    const StageScore* before = step.before.find(after.stage, after.at, after.regime);
    ASSERT_NE(before, nullptr);
    // the pressure models are learned again from the same samples with other forces
    EXPECT_LT(after.rmse, 1.05 * before->rmse) << after.stage << " " << after.regime;
  }
}

TEST(Extend, ModelKeepsEffectAndRecordAndSurvivesItsFile) {
  const CraneModel& model = extended().model;
  ASSERT_THAT(model.effects, SizeIs(1));
  // As in EstimateEffects.RecoversTheForce, which estimates from the same amount of data.
  EXPECT_NEAR(model.effects[0].values[0], kFriction, 0.03 * kFriction);
  ASSERT_THAT(model.steps, SizeIs(1));
  EXPECT_EQ(model.steps[0].added, "coulomb_friction:arm");
  EXPECT_THAT(model.steps[0].data, SizeIs(2));
  EXPECT_EQ(model.steps[0].before.size(), model.steps[0].after.size());
  EXPECT_FALSE(model.steps[0].stopped_because.empty());
  const CraneModel again = model_from_json(model_to_json(model), "model.json");
  EXPECT_EQ(again.steps[0].added, "coulomb_friction:arm");
  EXPECT_EQ(again.effects[0].values, model.effects[0].values);
}

TEST(Extend, WithoutTestLogsMotionsAreHeldOut) {
  const ExtendResult r =
      extend(ignorant_model(), {coulomb()}, {{arm_log_with_friction(kFriction, 1)}});
  ASSERT_THAT(r.steps, SizeIs(1));
  EXPECT_EQ(r.steps[0].judged_on, "held-out motions");
  // fewer samples than the log has: only every fourth motion counts
  EXPECT_LT(r.steps[0].after.find("force", "arm")->n, 1500);
  EXPECT_LT(r.steps[0].change.own, 0.3);
}

TEST(Extend, WithReferencesWhatWasLearnedStays) {
  ExtendLogs logs = logs_with_friction();
  logs.references = {arm_log(0.8, 3)};
  const CraneModel model = fit(arm_machine(), logs.references).model;
  const ExtendResult r = extend(model, {coulomb()}, logs);
  EXPECT_NEAR(r.model.effects[0].values[0], kFriction, 0.03 * kFriction);
  EXPECT_EQ(r.model.cylinders[0].margin, model.cylinders[0].margin);
  EXPECT_EQ(r.model.cylinders[0].extend.mean(1e-3, 5e4), model.cylinders[0].extend.mean(1e-3, 5e4));
}

TEST(Extend, EffectTheModelHasIsRefused) {
  EXPECT_THROW(extend(extended().model, {coulomb()}, {{arm_log_with_friction(kFriction, 1)}}),
               InputError);
}

TEST(Extend, JsonHasTheContractsKeys) {
  const nlohmann::json j = test_support::parsed_json(extended().json());
  const nlohmann::json& step = j.at("steps").at(0);
  EXPECT_EQ(step.at("added"), "coulomb_friction:arm");
  const nlohmann::json& force = step.at("stages").at("force").at("arm");
  EXPECT_LT(force.at("after").at("rmse").get<double>(),
            force.at("before").at("rmse").get<double>());
  EXPECT_EQ(force.at("after").at("unit"), "N");
  EXPECT_TRUE(step.at("stages").at("pressure").at("arm").contains("extend"));
  EXPECT_TRUE(step.at("stages").at("energy").at("main").at("after").contains("relative_error"));
  EXPECT_TRUE(j.contains("stopped_because"));
  EXPECT_EQ(step.at("parameters").at(0).at("ci95").size(), 2u);
}

TEST(Extend, TableIsOneScreenWithUnits) {
  const std::string table = extended().table();
  EXPECT_THAT(table, HasSubstr(" N"));
  EXPECT_THAT(table, HasSubstr("->"));
  EXPECT_THAT(table, HasSubstr("stopped because"));
  EXPECT_LE(std::count(table.begin(), table.end(), '\n'), 24);
}

TEST(TakeBack, RestoresTheErrorAndKeepsTheRecord) {
  const ExtendResult r = take_back(extended().model, coulomb(), logs_with_friction());
  EXPECT_THAT(r.model.effects, IsEmpty());
  ASSERT_THAT(r.model.steps, SizeIs(2));
  EXPECT_EQ(r.model.steps[1].removed, "coulomb_friction:arm");
  EXPECT_TRUE(r.model.steps[1].added.empty());
  // without the effect, the same logs give the same model as before it was added
  EXPECT_NEAR(force_error(r.steps[0].after), force_error(extended().steps[0].before), 1.0);
  EXPECT_TRUE(r.steps[0].change.worse());
}

TEST(TakeBack, EffectTheModelDoesNotHaveIsRefused) {
  EXPECT_THROW(take_back(ignorant_model(), coulomb(), {{arm_log_with_friction(kFriction, 1)}}),
               InputError);
}

TEST(Improve, AddsTheFrictionAndStops) {
  const ExtendResult r = improve(ignorant_model(), logs_with_friction());
  ASSERT_FALSE(r.steps.empty());
  EXPECT_THAT(r.steps[0].added, HasSubstr("friction:arm"));
  // As in Extend.ErrorFallsOnTestLogsAndNothingElseRises.
  EXPECT_LT(force_error(r.steps.back().after), 0.3 * kFriction);
  for (const ExtendStep& s : r.steps) EXPECT_FALSE(s.change.worse()) << s.added;
  EXPECT_FALSE(r.stopped_because.empty());
  ASSERT_NE(r.last, nullptr);
  // its evidence still refers to an existing machine
  EXPECT_EQ(r.last->evidence.series.front().machine->name, "lift");
  EXPECT_EQ(r.model.steps.back().stopped_because, r.stopped_because);
}

TEST(Improve, WhatTheDataChecksSetAsideTakesPartInNoEstimate) {
  ExtendLogs logs = logs_with_friction();
  Eigen::VectorXd& pressure = testing_support::channel(logs.suspects[0], "pA_arm").values;
  const Eigen::Index from = pressure.size() / 2, count = pressure.size() / 10;
  // a loose shield: noise of 10 bar in a tenth of the log
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 10e5);
  for (Eigen::Index k = from; k < from + count; ++k) pressure[k] += normal(random);
  const ExtendResult r = improve(ignorant_model(), logs);
  EXPECT_THAT(r.notes, ::testing::Contains(HasSubstr("set aside: arm.csv: pA_arm is noisy")));
  const ExtendResult sound = improve(ignorant_model(), logs_with_friction());
  ASSERT_EQ(r.model.effects.size(), sound.model.effects.size()) << r.stopped_because;
  for (std::size_t i = 0; i < sound.model.effects.size(); ++i) {
    const AppliedEffect &with = r.model.effects[i], &without = sound.model.effects[i];
    EXPECT_EQ(with.effect, without.effect);
    // a tenth of the log less, so that the estimates differ by a part of their own intervals
    for (std::size_t k = 0; k < without.values.size(); ++k)
      EXPECT_NEAR(with.values[k], without.values[k],
                  0.5 * (without.upper95[k] - without.lower95[k]));
  }
}

TEST(Improve, AddsNothingWhereNothingIsMissing) {
  const CraneModel model = fit(arm_machine(), {arm_log(0.8, 4)}).model;
  ExtendOptions options;
  // the log's positions are exact, so a valve effect would explain rounding only
  for (const char* key : {"coulomb_friction:arm", "viscous_friction:arm", "unmodelled_mass:arm"})
    options.diagnose.candidates.push_back(parse_effect(key, model.machine));
  const ExtendResult r = improve(model, {{arm_log(0.8, 4)}, {}, {arm_log(0.8, 5)}}, options);
  EXPECT_THAT(r.steps, IsEmpty());
  EXPECT_THAT(r.model.effects, IsEmpty());
  EXPECT_THAT(r.stopped_because, HasSubstr("nothing more is missing"));
}

TEST(Diagnose, ReportsTheValuesThatExtendPutsIntoTheModel) {
  // one effect that changes the machine and one that does not: both have the same values and intervals in both results
  CraneModel model = arm_model();
  model.machine.links[0].mass -= 60.0;  // the log was made with this mass
  const Log log = arm_log_with_friction(kFriction, 1);
  DiagnoseOptions options;
  options.candidates = {coulomb(), parse_effect("unmodelled_mass:arm", model.machine)};
  const Diagnosis d = diagnose(model, {log}, {}, options);
  ASSERT_THAT(d.effects, SizeIs(2));
  std::vector<EffectAt> found;
  for (const DiagnosedEffect& e : d.effects) found.push_back(e.effect);
  const ExtendResult r = extend(model, found, {{log}});
  ASSERT_THAT(r.model.effects, SizeIs(2));
  for (std::size_t i = 0; i < 2; ++i) {
    const AppliedEffect& a = d.effects[i].applied;
    const AppliedEffect& b = r.model.effects[i];
    for (std::size_t p = 0; p < a.values.size(); ++p) {
      // one regression over the same rows; the second step starts from the result of the first, with rounding errors
      const double width = a.upper95[p] - a.lower95[p];
      EXPECT_NEAR(a.values[p], b.values[p], 0.02 * width) << d.effects[i].key() << " " << p;
      EXPECT_NEAR(a.lower95[p], b.lower95[p], 0.02 * width) << d.effects[i].key() << " " << p;
      EXPECT_NEAR(a.upper95[p], b.upper95[p], 0.02 * width) << d.effects[i].key() << " " << p;
    }
  }
}

TEST(EstimateEffects, VariantsOfALawAreNotRefinedBetween) {
  // the variant of a law is an integer: there is no value between two of them, and no interval
  const CraneModel model = arm_model();
  Log log = arm_log(0.8, 6);
  testing_support::channel(log, "pA_arm").values.array() += 4e5;  // [Pa]
  const EffectAt offset = parse_effect("pressure_offset:arm", model.machine);
  const EffectEstimate e = estimate_effects(model, {offset}, {{make_signals(model.machine, log)}});
  const auto& parameters = offset.effect->info().parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const AppliedEffect& a = e.effects[0];
    if (!parameters[p].choice) {
      EXPECT_NEAR(a.values[p], 4e5,
                  0.1e5);  // 0.8 bar for each of about a hundred independent samples
      continue;
    }
    EXPECT_EQ(a.values[p], std::round(a.values[p]));
    EXPECT_EQ(a.lower95[p], a.values[p]);
    EXPECT_EQ(a.upper95[p], a.values[p]);
  }
  EXPECT_THAT(e.notes, ::testing::Each(::testing::Not(HasSubstr("lies on the bound"))));
}

TEST(Improve, DoesNotKeepWhatMakesTheErrorWorse) {
  // the test log is of a machine without friction, so an effect must not be kept whatever the diagnosis names
  ExtendOptions options;
  options.diagnose.candidates = {coulomb()};
  const ExtendResult r = improve(
      ignorant_model(), {{arm_log_with_friction(kFriction, 1)}, {}, {arm_log(0.8, 2)}}, options);
  EXPECT_THAT(r.steps, IsEmpty());
  EXPECT_THAT(r.model.effects, IsEmpty());
  ASSERT_THAT(r.rejected, SizeIs(1));
  EXPECT_GT(r.rejected[0].change.own, 1.0);
  EXPECT_EQ(r.rejected[0].judged_on, "test logs");
  EXPECT_THAT(r.stopped_because, HasSubstr("not kept"));
  EXPECT_THAT(r.table(), HasSubstr("not kept"));
}

TEST(Extend, BeforeIsLearnedFromTheSameLogs) {
  // the model was learned from logs of a machine with other margins: a change by refitting alone is no improvement
  CraneModel other = ignorant_model();
  other.cylinders[0].margin += 20e5;
  other.data.clear();
  const ExtendResult r = extend(other, {coulomb()}, logs_with_friction());
  EXPECT_THAT(r.notes, ::testing::Contains(HasSubstr("not learned from these logs")));
  const double before = r.steps[0].before.find("pump", "main")->rmse;
  EXPECT_LT(before, 5e5);  // [Pa] not the 20 bar of the other machine's margin
}

}  // namespace
}  // namespace sparflow
