/// Errors of a cross-validation after a change of effects: only the effects that share a measured quantity with the changed one
/// are estimated anew, which gives what an estimate of all gives.
#include <gtest/gtest.h>

#include "diagnosis/extension/refit_context.h"
#include "diagnosis/selection/effect_estimate.h"
#include "identification/learning/fit.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using testing_support::drawn_machine;
using testing_support::hidden_case;
using testing_support::HiddenCase;

double error_of(const CompareResult& r, const std::string& stage, const std::string& at) {
  for (const StageQuality& q : stage_quality(r, "held out"))
    if (q.stage == stage && q.at == at) return q.rmse;
  ADD_FAILURE() << "no error of " << stage << " " << at;
  return 0.0;
}

class CrossValidation : public ::testing::Test {
 protected:
  CrossValidation() {
    logs.suspects = {hidden.train};
    options.fit.hold_out_every = 4;
  }
  EffectAt effect(const char* key) const { return parse_effect(key, machine); }

  const Machine machine = drawn_machine("loader_crane");
  const HiddenCase hidden = hidden_case(
      machine, {{"coulomb_friction", "boom", 1.0, 0}, {"leakage", "jib", 1.0, 0}}, {7, 100.0});
  ExtendLogs logs;
  ExtendOptions options;
};

TEST_F(CrossValidation, AChangeOfOneEffectGivesTheErrorsOfAWholeEstimate) {
  const CraneModel model = fit(machine, logs.suspects).model;
  const RefitContext context(model, logs, options);
  const EffectAt friction = effect("coulomb_friction:boom"), leak = effect("leakage:jib"),
                 viscous = effect("viscous_friction:boom");
  const CrossValidated both = context.cross_validated(model, {friction, leak}, {});
  const CrossValidated whole = context.cross_validated(model, {viscous, leak}, {});
  const CrossValidated changed =
      context.cross_validated(both, {viscous, leak}, {friction, viscous}, {});
  ASSERT_EQ(changed.models.size(), 4u);
  for (std::size_t f = 0; f < changed.models.size();
       ++f) {  // the leak shows in the flow alone and keeps its value
    ASSERT_EQ(changed.models[f].effects.size(), 2u);
    EXPECT_EQ(changed.models[f].effects[1].values, both.models[f].effects[1].values);
  }
  // The searches for the leak's shape begin elsewhere and end within their width of 1 % of each other.
  for (const char* at : {"boom", "jib"}) {
    EXPECT_NEAR(error_of(changed.errors, "force", at), error_of(whole.errors, "force", at),
                1e-6 * error_of(whole.errors, "force", at));
    EXPECT_NEAR(error_of(changed.errors, "flow", at), error_of(whole.errors, "flow", at),
                0.01 * error_of(whole.errors, "flow", at));
  }
  // and it is another model than before: dry friction explains these forces better
  EXPECT_GT(error_of(changed.errors, "force", "boom"),
            1.02 * error_of(both.errors, "force", "boom"));
}

/// A fold may have the only motions in which an effect acts. The model of the others does not know it, and the rest is estimated.
TEST_F(CrossValidation, AnEffectThatOnlyTheSamplesLeftOutShowIsNotEstimated) {
  const CraneModel model = fit(machine, logs.suspects).model;
  const EffectAt friction = effect("coulomb_friction:boom"), leak = effect("leakage:jib");
  const MachineSignals signals = make_signals(machine, hidden.train);
  const Mask boom_moves = signals.cylinders[static_cast<std::size_t>(friction.at)].moving;
  EXPECT_EQ(estimate_effects(model, {friction, leak}, {{signals}}).effects.size(), 2u);
  const EffectEstimate others =
      estimate_effects(model, {friction, leak}, {{signals}, {}, {boom_moves}});
  ASSERT_EQ(others.effects.size(), 1u);
  EXPECT_EQ(others.effects[0].effect, leak.effect);
}

}  // namespace
}  // namespace sparflow
