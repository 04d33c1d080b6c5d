/// Effects on forces that are confused with each other: `improve` ends with the one that predicts motions left out better,
/// whichever entered the model first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "diagnosis/extension/extend.h"
#include "diagnosis/selection/effect_estimate.h"
#include "identification/comparison/report_numbers.h"
#include "identification/learning/fit.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using ::testing::ElementsAre;
using testing_support::drawn_machine;
using testing_support::hidden_case;
using testing_support::HiddenCase;

/// `improve` on a log, where an earlier run has put one effect into the model and may add no other one.
std::vector<std::string> after_exchange(const Machine& machine, const Log& log,
                                        const std::string& first,
                                        const std::vector<std::string>& candidates) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("sparflow_exchange_" + std::to_string(::getpid())))
          .string();
  Journal(path, "exchange", false)
      .keep("round 1", R"({"wanted": [")" + first + R"("], "removed": [], "notes": []})");
  Journal journal(path, "exchange", true);
  ExtendOptions options;
  options.journal = &journal;
  options.max_steps = 1;
  for (const std::string& key : candidates)
    options.diagnose.candidates.push_back(parse_effect(key, machine));
  const ExtendResult r = improve(fit(machine, {log}).model, {{log}, {}, {}}, options);
  journal.remove();
  std::vector<std::string> keys;
  for (const AppliedEffect& e : r.model.effects) keys.push_back(e.key(machine));
  return keys;
}

TEST(ImproveExchange, TheBetterOfTwoConfusedEffectsStaysWhicheverCameFirst) {
  const Machine machine = drawn_machine("loader_crane");
  const std::vector<std::string> both = {"unmodelled_mass:jib", "angle_offset:jib"};
  const HiddenCase beside = hidden_case(machine, {{"unmodelled_mass", "jib", 1.0, 2}}, {7, 100.0});
  EXPECT_THAT(after_exchange(machine, beside.train, "angle_offset:jib", both),
              ElementsAre("unmodelled_mass:jib"));
  const HiddenCase offset = hidden_case(machine, {{"angle_offset", "jib", 1.0, 0}}, {7, 100.0});
  EXPECT_THAT(after_exchange(machine, offset.train, "unmodelled_mass:jib", both),
              ElementsAre("angle_offset:jib"));
}

/// Dry friction and its elastic form differ at reversals alone, which 2 % of the error do not show: the usual one stays.
TEST(ImproveExchange, TheUsualOneStaysWhereChanceMayHaveDecided) {
  const Machine machine = drawn_machine("loader_crane");
  const std::vector<std::string> both = {"coulomb_friction:boom", "presliding:boom"};
  const HiddenCase dry = hidden_case(machine, {{"coulomb_friction", "boom", 0.3, 0}}, {7, 60.0});
  EXPECT_THAT(after_exchange(machine, dry.train, "presliding:boom", both),
              ElementsAre("coulomb_friction:boom"));
  EXPECT_THAT(after_exchange(machine, dry.train, "coulomb_friction:boom", both),
              ElementsAre("coulomb_friction:boom"));
}

/// A mass at the end of the boom, on the jib's link, loads all cylinders as a moment of the boom does: the one that comes second
/// takes no part, and the first has an interval that says something.
TEST(EstimateEffects, OfTwoParametersWithTheSameActionTheSecondTakesNoPart) {
  const Machine machine = drawn_machine("loader_crane");
  const HiddenCase logs = hidden_case(machine, {{"unmodelled_mass", "jib", 1.0, 0}}, {7, 60.0});
  const EffectEstimate e = estimate_effects(
      fit(machine, {logs.train}).model,
      {parse_effect("unmodelled_mass:jib", machine), parse_effect("unmodelled_mass:boom", machine)},
      {{make_signals(machine, logs.train)}});
  const AppliedEffect &jib = e.effects[0], &boom = e.effects[1];
  const double truth = logs.truth("unmodelled_mass", "mass");
  EXPECT_NEAR(jib.values[0], truth, 0.1 * truth);
  EXPECT_LT(jib.upper95[0] - jib.lower95[0], truth);
  EXPECT_EQ(boom.values[1], 0.0);
  EXPECT_FALSE(is_determined(boom.values[1], boom.lower95[1], boom.upper95[1],
                             boom.effect->info().parameters[1].typical));
}

}  // namespace
}  // namespace sparflow
