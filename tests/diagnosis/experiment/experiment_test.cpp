#include "diagnosis/experiment/experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/verdict/diagnose.h"
#include "tests/diagnosis/hidden_case.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing_support::arm_log;
using testing_support::arm_machine;
using testing_support::arm_model;
using testing_support::drawn_machine;

/// A motion with one speed and one load only, on which effects that differ in their dependence on these are
/// indistinguishable.
Log one_speed_log() {
  const CraneModel model = arm_model();
  MotionRecipe recipe;
  recipe.legs = {{{0}, 0.55, 0.4, 1.0, 0.0}, {{0}, 0.45, 0.4, 1.0, 0.0}};
  recipe.steps = true;  // speed is reached at once and held
  Log log = synthesise_motion(model, recipe, 0.02, 60.0);
  unsigned seed = 5;
  for (const char* signal : {"pA_arm", "pB_arm"}) {
    for (double& p : testing_support::channel(log, signal).values) {
      double sum = -6.0;
      for (int i = 0; i < 12; ++i) {
        seed = seed * 1664525u + 1013904223u;
        sum += static_cast<double>(seed >> 8) / 16777216.0;
      }
      p += 0.8e5 * sum;  // [Pa] as sensors have
    }
  }
  return log;
}

struct Case {
  CraneModel model = arm_model();
  Evidence evidence;
  EffectFit fit;
  explicit Case(const Log& log) {
    evidence = collect_evidence(model, {make_signals(model.machine, log)});
    FitControl control;
    control.keep_residuals = true;
    fit = fit_effects(evidence, {}, nullptr, control);
  }
};

AppliedEffect applied(const char* key, std::vector<double> values) {
  const EffectAt e = parse_effect(key, arm_machine());
  return {e.effect, e.at, std::move(values), {}, {}};
}

TEST(MotionMenu, EveryMotionStaysInsideTheMachine) {
  for (const char* name : {"loader_crane", "excavator", "swing_crane_two_pumps"}) {
    const Machine machine = drawn_machine(name);
    CraneModel model = CraneModel::untrained(machine);
    const std::vector<MotionRecipe> menu = motion_menu(machine, 500.0);
    std::size_t positions = 0, commands = 0;
    for (const MotionRecipe& recipe : menu) {
      Log log;
      try {
        log = synthesise_motion(model, recipe, 0.02, 30.0);
      } catch (const std::domain_error&) {
        continue;  // a linkage cannot take a pose: such a motion is never advised
      }
      for (const Channel& c : log.channels) {
        if (c.role == Role::kJointPosition) {
          ++positions;
          const Joint& j = machine.joints[static_cast<std::size_t>(c.index)];
          EXPECT_GE(c.values.minCoeff(), j.position.lo) << name << ": " << recipe.words;
          EXPECT_LE(c.values.maxCoeff(), j.position.hi) << name << ": " << recipe.words;
        }
        if (c.role == Role::kCommand) {
          ++commands;
          EXPECT_LE(c.values.cwiseAbs().maxCoeff(), 1.0) << name << ": " << recipe.words;
        }
      }
    }
    // the linkages of at least nine in ten motions can take every pose
    EXPECT_GE(10 * positions, 9 * menu.size() * machine.joints.size()) << name;
    EXPECT_GE(10 * commands, 9 * menu.size() * machine.cylinders.size()) << name;
  }
}

TEST(BetterMotion, OtherMotionsDistinguishDryFromViscousFriction) {
  const Case c(one_speed_log());
  const std::vector<EffectAt> rival = {parse_effect("viscous_friction:arm", c.model.machine)};
  const BetterMotion small =
      better_motion(c.model, c.evidence, c.fit, {applied("coulomb_friction:arm", {400.0}), rival});
  EXPECT_THAT(small.words, HasSubstr("arm"));
  // A motion is advised only if it is better by this factor (ExperimentOptions::better_than_here).
  EXPECT_GT(small.nats_per_minute, 1.5 * small.nats_here);
  EXPECT_THAT(small.apart, SizeIs(1));
  const BetterMotion large =
      better_motion(c.model, c.evidence, c.fit, {applied("coulomb_friction:arm", {800.0}), rival});
  EXPECT_GT(large.nats_per_minute, small.nats_per_minute)
      << "a larger effect is distinguished sooner";
}

TEST(BetterMotion, NothingIsAdvisedWhereNoMotionHelps) {
  // on the only joint a mass at the tip and a moment of the link are equivalent
  const Case c(one_speed_log());
  const BetterMotion m = better_motion(c.model, c.evidence, c.fit,
                                       {applied("payload_error", {60.0, 0.0}),
                                        {parse_effect("unmodelled_mass:arm", c.model.machine)}});
  EXPECT_THAT(m.words, IsEmpty());
}

TEST(Experiment, SentenceSaysHowLongOrThatNoMotionIsKnown) {
  const Experiment known{"distinguishes a from b", "arm up and down", 1.5, 0.1};
  EXPECT_EQ(known.sentence(), "record 3 minutes of: arm up and down (distinguishes a from b)");
  const Experiment quick{"distinguishes a from b", "arm up and down", 50.0, 0.1};
  EXPECT_THAT(quick.sentence(), HasSubstr("record 1 minute of"));
  const Experiment open{"distinguishes a from b", "known loads", 0.0, 0.0};
  EXPECT_EQ(open.sentence(), "to distinguish them, record: known loads");
}

TEST(EffectsInReferences, ThoseAddedFromOtherLogsAreNot) {
  CraneModel model = arm_model();
  const AppliedEffect own = applied("viscous_friction:arm", {1e4});      // fitted with it
  const AppliedEffect added = applied("coulomb_friction:arm", {5e3});    // from today's log
  const AppliedEffect before = applied("unmodelled_mass:arm", {10, 5});  // from the references
  model.effects = {own, added, before};
  ModelStep today, earlier;
  today.added = added.key(model.machine);
  today.data = {{"today.csv", "aa", 10, "train"}, {"new.csv", "bb", 10, "test"}};
  earlier.added = before.key(model.machine);
  earlier.data = {{"new.csv", "bb", 10, "train"}};
  model.steps = {earlier, today};
  MachineSignals reference;
  reference.sha256 = "bb";
  const std::vector<AppliedEffect> kept = effects_in_references(model, {reference});
  ASSERT_THAT(kept, SizeIs(2));
  EXPECT_EQ(kept[0].effect, own.effect);
  EXPECT_EQ(kept[1].effect, before.effect);
}

TEST(EffectsInReferences, EvidenceKeepsKnownEffectsOutOfTheReferences) {
  // friction acts in the suspect log and not in the reference; the model has it from the suspect log
  CraneModel model = arm_model();
  model.effects = {applied("coulomb_friction:arm", {5e3})};
  const std::vector<MachineSignals> suspect = {
      make_signals(model.machine, testing_support::arm_log_with_friction(5e3, 1))};
  const std::vector<MachineSignals> reference = {make_signals(model.machine, arm_log(0.8, 2))};
  const std::vector<AppliedEffect> none;
  const Evidence e = collect_evidence(model, suspect, reference, &none);
  const EvidenceChannel* force = e.find(EvidenceKind::kForce, 0);
  ASSERT_NE(force, nullptr);
  // filtered sensor noise is about 0.3 kN; a friction added or omitted by mistake is 5 kN
  EXPECT_LT(force->y.cwiseAbs().maxCoeff(), 2.5e3);
}

}  // namespace
}  // namespace sparflow
