#include "models/files/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "models/effects/formula/user_effect.h"
#include "models/effects/registry.h"
#include "models/effects/user_effect_scope.h"
#include "models/math/error.h"
#include "tests/models/files/broken_model_support.h"

namespace sparflow {
namespace {

using testing::HasSubstr;

TEST(ModelFile, ReadsBackEveryNumberExactly) {
  const CraneModel model = small_model();
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  ASSERT_EQ(read.cylinders.size(), model.cylinders.size());
  for (std::size_t i = 0; i < model.cylinders.size(); ++i) {
    EXPECT_EQ(read.cylinders[i].margin, model.cylinders[i].margin);
    EXPECT_EQ(read.cylinders[i].valve_gain_extend, model.cylinders[i].valve_gain_extend);
    EXPECT_EQ(read.cylinders[i].valve_gain_retract, model.cylinders[i].valve_gain_retract);
    EXPECT_EQ(read.cylinders[i].retract.empty(), model.cylinders[i].retract.empty());
    const GpParameters& a = model.cylinders[i].extend.parameters();
    const GpParameters& b = read.cylinders[i].extend.parameters();
    EXPECT_EQ(a.length_flow, b.length_flow);
    EXPECT_EQ(a.length_force, b.length_force);
    EXPECT_EQ(a.signal_std, b.signal_std);
    EXPECT_EQ(a.noise_std, b.noise_std);
    EXPECT_EQ(a.mean_constant, b.mean_constant);
    EXPECT_EQ(a.mean_slope, b.mean_slope);
    EXPECT_EQ(a.mean_flow_slope, b.mean_flow_slope);
    EXPECT_EQ(a.law, b.law);
    EXPECT_EQ(a.data_count, b.data_count);
    EXPECT_EQ(a.flow_min, b.flow_min);
    EXPECT_EQ(a.force_max, b.force_max);
    EXPECT_TRUE((a.flow == b.flow).all());
    EXPECT_TRUE((a.force == b.force).all());
    EXPECT_TRUE((a.weight == b.weight).all());
    EXPECT_EQ(a.variance_core, b.variance_core);
    EXPECT_EQ(a.corner.level, b.corner.level);
    EXPECT_EQ(a.corner.per_flow, b.corner.per_flow);
    EXPECT_EQ(a.corner.per_force, b.corner.per_force);
    EXPECT_EQ(a.beyond.side, b.beyond.side);
    EXPECT_EQ(a.beyond.static_slope, b.beyond.static_slope);
    EXPECT_EQ(a.beyond.static_level, b.beyond.static_level);
    EXPECT_EQ(a.beyond.slope_heavier, b.beyond.slope_heavier);
    EXPECT_EQ(a.beyond.slope_lighter, b.beyond.slope_lighter);
    EXPECT_EQ(a.beyond.least, b.beyond.least);
  }
  EXPECT_EQ(read.pumps[0].standby, model.pumps[0].standby);
  EXPECT_EQ(read.machine.source_text, model.machine.source_text);
  ASSERT_EQ(read.data.size(), 1u);
  EXPECT_EQ(read.data[0].sha256, model.data[0].sha256);
  ASSERT_EQ(read.quality.size(), 2u);
  EXPECT_EQ(read.quality[0].rmse, model.quality[0].rmse);
  EXPECT_TRUE(std::isnan(read.quality[1].fit_percent)) << "a constant signal has no fit";
}

TEST(ModelFile, ALengthThatNoDataInformIsReplacedWhenRead) {
  CraneModel model = small_model();
  GpParameters p = model.cylinders[0].extend.parameters();
  p.force.setConstant(1e4);
  p.force_min = p.force_max = 1e4;
  p.length_force = 3e-9;
  p.beyond = {};
  model.cylinders[0].extend = GaussianProcess(p);
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  EXPECT_GT(read.cylinders[0].extend.parameters().length_force, 1e4);
  EXPECT_EQ(read.cylinders[0].extend.mean(p.flow[0], 1e4),
            model.cylinders[0].extend.mean(p.flow[0], 1e4));
}

TEST(ModelFile, GivesTheSamePressuresAfterALoad) {
  const CraneModel model = small_model();
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  const GaussianProcess& a = model.cylinders[0].extend;
  const GaussianProcess& b = read.cylinders[0].extend;
  for (const double flow : {1e-5, 3e-4, 2e-3}) {
    EXPECT_EQ(a.mean(flow, 5e4), b.mean(flow, 5e4));
    EXPECT_EQ(a.variance(flow, 5e4), b.variance(flow, 5e4));
  }
}

TEST(ModelFile, IsTheSameTextEveryTime) {
  const std::string text = model_to_json(small_model());
  EXPECT_EQ(text, model_to_json(model_from_json(text, "m.json")));
}

TEST(ModelFile, KeepsAnUntrainedModel) {
  CraneModel model = CraneModel::untrained(small_model().machine);
  const CraneModel read = model_from_json(model_to_json(model), "m.json");
  EXPECT_FALSE(read.complete());
  EXPECT_EQ(read.missing(), model.missing());
}

TEST(ModelFile, SavesAndLoads) {
  const std::string path =
      (std::filesystem::path(testing::TempDir()) / "sparflow_model_file_test.json").string();
  save_model(small_model(), path);
  EXPECT_EQ(model_to_json(load_model(path)), model_to_json(small_model()));
  std::filesystem::remove(path);
  EXPECT_THROW(load_model(path), InputError);
  EXPECT_THROW(save_model(small_model(), "no/such/folder/m.json"), InputError);
}

/// Every effect of the catalogue at every place it can sit on this machine.
TEST(ModelFile, KeepsEveryEffectAndItsSteps) {
  CraneModel model = small_model();
  for (const EffectAt& candidate : candidates(model.machine)) {
    AppliedEffect e{candidate.effect, candidate.at, {}, {}, {}};
    for (const EffectParameter& p : candidate.effect->info().parameters) {
      e.values.push_back(p.typical / 3.0);
      e.lower95.push_back(std::min(p.typical / 7.0, p.typical / 1.5));
      e.upper95.push_back(std::max(p.typical / 7.0, p.typical / 1.5));
    }
    if (model.effects.size() % 2 == 1) {  // intervals need not be known
      e.lower95.clear();
      e.upper95.clear();
    }
    model.effects.push_back(e);
  }
  ASSERT_GE(model.effects.size(), 3u);
  ModelStep step;
  step.added = "coulomb_friction:arm";
  step.removed = "an_effect_no_longer_known:arm";
  step.date = "2025-03-14";
  step.data = model.data;
  step.parameters = {{"Fc", "N", 4e3 / 3.0, 3.5e3 / 3.0, 4.5e3 / 3.0}, {"x", "bar", 1.0}};
  step.before = step.after = model.quality;
  step.after[0].rmse /= 3.0;
  step.stopped_because = "nothing more is missing";
  model.steps = {step, step};
  model.steps[1].stopped_because.clear();

  const std::string text = model_to_json(model);
  const CraneModel read = model_from_json(text, "m.json");
  EXPECT_EQ(text, model_to_json(read));
  ASSERT_EQ(read.effects.size(), model.effects.size());
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const AppliedEffect &a = model.effects[i], &b = read.effects[i];
    EXPECT_EQ(a.effect, b.effect);
    EXPECT_EQ(a.at, b.at);
    EXPECT_EQ(a.values, b.values);
    EXPECT_EQ(a.lower95, b.lower95);
    EXPECT_EQ(a.upper95, b.upper95);
  }
  ASSERT_EQ(read.steps.size(), 2u);
  EXPECT_EQ(read.steps[0].added, step.added);
  EXPECT_EQ(read.steps[0].removed, step.removed);
  EXPECT_EQ(read.steps[0].date, step.date);
  EXPECT_EQ(read.steps[0].stopped_because, step.stopped_because);
  EXPECT_EQ(read.steps[0].data[0].sha256, step.data[0].sha256);
  EXPECT_EQ(read.steps[0].parameters[0].value, step.parameters[0].value);
  EXPECT_EQ(read.steps[0].parameters[0].upper95, step.parameters[0].upper95);
  EXPECT_TRUE(std::isnan(read.steps[0].parameters[1].lower95));
  EXPECT_EQ(read.steps[0].before[0].rmse, step.before[0].rmse);
  EXPECT_EQ(read.steps[0].after[0].rmse, step.after[0].rmse);
  EXPECT_EQ(read.steps[1].stopped_because, "");
}

constexpr const char* kSealFriction = R"yaml(effects:
  - id: seal_friction_of_model_file_test
    stage: force
    law: "Fc * tanh(v / v0)"
    parameters:
      v0: {unit: mm/s, bounds: [0.5, 50], typical: 5}
      Fc: {unit: N, bounds: [0, 20000], typical: 3000}
)yaml";

/// `cross_moment` came to the effect in November 2026, as an optional parameter.
TEST(ModelFile, OfAnEarlierVersionLacksOptionalParametersAlone) {
  CraneModel model = small_model();
  AppliedEffect mass;
  const EffectAt at = parse_effect("unmodelled_mass:arm", model.machine);
  mass.effect = at.effect;
  mass.at = at.at;
  mass.values = {60.0, 90.0, 12.0};
  mass.lower95 = {50.0, 80.0, 10.0};
  mass.upper95 = {70.0, 100.0, 14.0};
  model.effects = {mass};
  nlohmann::json text = nlohmann::json::parse(model_to_json(model));
  nlohmann::json& parameters = text["effects"][0]["parameters"];
  ASSERT_EQ(parameters.size(), 3U);
  parameters.erase(2);
  const CraneModel read = model_from_json(text.dump(), "m.json");
  EXPECT_EQ(read.effects.at(0).values, (std::vector<double>{60.0, 90.0, 0.0}));
  EXPECT_EQ(read.effects[0].upper95, (std::vector<double>{70.0, 100.0, 0.0}));
  parameters.erase(1);  // the moment along the link is no optional one
  EXPECT_THROW(model_from_json(text.dump(), "m.json"), InputError);
}

TEST(ModelFile, ContainsUserEffects) {
  const UserEffectScope scope;
  CraneModel model = small_model();
  const Effect* seal = register_user_effects(kSealFriction, "mine.yaml", model.machine).front();
  EXPECT_EQ(register_user_effects(kSealFriction, "again.yaml", model.machine).front(), seal);
  // proportional parameters come first, whatever the file's order
  ASSERT_EQ(seal->info().parameters[0].name, "Fc");
  model.effects = {{seal, 0, {2500.0, 4e-3}, {}, {}}};
  const std::string text = model_to_json(model);
  EXPECT_THAT(text, HasSubstr("\"user_effects\": ["));
  const CraneModel read = model_from_json(text, "m.json");
  EXPECT_EQ(model_to_json(read), text);
  const double q = 0.4, qd = 0.03;
  const CraneModel bare = small_model();
  Chain with(read), without(bare);
  const CylinderState c = with.evaluate({&q, &qd}, 0.0).cylinders[0];
  EXPECT_EQ(c.force, without.evaluate({&q, &qd}, 0.0).cylinders[0].force);
  EXPECT_NEAR(c.total_force - c.force, 2500.0 * std::tanh(c.speed / 4e-3), 1e-9);

  // in a process that does not have it yet, the file itself brings it: here under another name
  std::string other = text;
  for (std::size_t at; (at = other.find("seal_friction_of")) != std::string::npos;) {
    other.replace(at, 4, "ring");
  }
  const CraneModel brought = model_from_json(other, "m.json");
  EXPECT_EQ(brought.effects[0].effect->info().id, "ring_friction_of_model_file_test");
  EXPECT_NE(brought.effects[0].effect, seal);

  // an id that means something else already
  std::string changed = text;
  changed.replace(changed.find("tanh(v"), 6, "tanh(2*v");
  EXPECT_THROW(model_from_json(changed, "m.json"), InputError);
}

TEST(ModelFile, NamesTheProgramVersion) {
  EXPECT_THAT(model_to_json(small_model()),
              HasSubstr(std::string("\"program\": \"sparflow ") + program_version()));
  EXPECT_THAT(model_to_json(small_model()), HasSubstr("\"sparflow_model\": 1"));
}

}  // namespace
}  // namespace sparflow
