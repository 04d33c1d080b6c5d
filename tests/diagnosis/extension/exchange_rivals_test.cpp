#include "diagnosis/extension/exchange_rivals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/effects/registry.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using testing_support::arm_log_with_friction;
using testing_support::arm_machine;
using testing_support::arm_model;

EffectAt effect_at(const char* key) { return parse_effect(key, arm_machine()); }

/// The best of an effect and its rivals, on a log of an arm with 5 kN of Coulomb friction.
std::string best_key(const char* effect, const std::vector<const char*>& rivals) {
  const CraneModel model = arm_model();
  const ExtendLogs logs = {{arm_log_with_friction(5e3, 1)}, {}, {}};
  const ExtendOptions options;
  const RefitContext context(model, logs, options);
  const std::vector<EffectAt> effects = {effect_at(effect)};
  std::vector<EffectAt> others;
  for (const char* r : rivals) others.push_back(effect_at(r));
  const CraneModel from = context.estimated(model, effects, {});
  const EffectAt best = best_of_rivals(context, {from, effects, effects[0], others}, {});
  return effect_key(best.effect->info(), model.machine, best.at);
}

TEST(ExchangeRivals, ARivalThatPredictsMotionsLeftOutBetterTakesThePlace) {
  EXPECT_EQ(best_key("force_offset:arm", {"coulomb_friction:arm"}), "coulomb_friction:arm");
}

TEST(ExchangeRivals, AnEffectThatPredictsThemBestStays) {
  EXPECT_EQ(best_key("coulomb_friction:arm", {"force_offset:arm", "end_cushion:arm"}),
            "coulomb_friction:arm");
}

TEST(ExchangeRivals, OfEqualsTheOneThatTheCatalogueListsFirstIsTaken) {
  // With a short distance presliding is Coulomb friction, but for some rows at reversals.
  EXPECT_EQ(best_key("presliding:arm", {"coulomb_friction:arm"}), "coulomb_friction:arm");
  EXPECT_EQ(best_key("coulomb_friction:arm", {"presliding:arm"}), "coulomb_friction:arm");
}

TEST(ExchangeRivals, AnEffectThatMotionsDoNotDetermineTakesNoPlace) {
  AppliedEffect e{find_effect("coulomb_friction"), 0, {5.0}, {-60348.0}, {60348.0}};
  EXPECT_FALSE(is_determined(e));
  e.lower95 = {4.0};
  EXPECT_TRUE(is_determined(e));
}

}  // namespace
}  // namespace sparflow
