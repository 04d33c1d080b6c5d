// An effect that a user's file defines and that acts in a log: the diagnosis finds it among the whole catalogue,
// recovers its parameters, and the model file contains it after it was added.
#include "models/effects/formula/user_effect.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "diagnosis/extension/extend.h"
#include "identification/signals/series.h"
#include "models/effects/registry.h"
#include "models/effects/user_effect_scope.h"
#include "models/files/model_file.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "tests/identification/arm_log.h"

namespace sparflow {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing_support::arm_log;
using testing_support::arm_machine;
using testing_support::arm_model;
using testing_support::channel;

/// A tight spot of the guide: friction near one length of the cylinder.
constexpr const char* kTightSpot = R"yaml(effects:
  - id: tight_spot
    title: Friction at a tight spot
    stage: force
    law: "Fb * sign(v) * exp(-square((x - x0) / w))"
    parameters:
      x0: {unit: m, bounds: [1.35, 1.55], typical: 1.45}
      w: {unit: mm, bounds: [10, 100], typical: 30}
      Fb: {unit: kN, bounds: [0, 50], typical: 5}
)yaml";
constexpr double kForce = 6e3, kPlace = 1.43, kWidth = 0.03;  // [N], [m], [m]

/// The angle has noise too: without it a diagnosis rightly detects the filter's error of the speed, 0.005 mm/s.
Log noisy_log(unsigned seed) {
  Log log = arm_log(0.8, seed);
  std::mt19937 random(seed);
  std::normal_distribution<double> angle(0.0, 3e-4);  // [rad]
  for (double& q : channel(log, "q_arm").values) q += angle(random);
  log.sha256 = std::string(64, static_cast<char>('0' + seed % 10));
  return log;
}

Log log_with_tight_spot(unsigned seed) {
  Log log = noisy_log(seed);
  const Machine machine = arm_machine();
  const Eigen::VectorXd &q = channel(log, "q_arm").values, &u = channel(log, "u_arm").values;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    const double away = (linkage_rates(machine, 0, q[k]).value - kPlace) / kWidth;
    const double side = u[k] > 0.0 ? 1.0 : u[k] < 0.0 ? -1.0 : 0.0;
    channel(log, "pA_arm").values[k] +=
        side * kForce * std::exp(-away * away) / machine.cylinders[0].area_piston();
  }
  return log;
}

/// Removes the user's effects after each test, because other tests search the catalogue alone.
class UserEffect : public testing::Test {
  UserEffectScope scope_;
};

const Effect& tight_spot() {
  return *register_user_effects(kTightSpot, "mine.yaml", arm_machine()).front();
}

TEST_F(UserEffect, IsFoundAmongTheCatalogueWithItsParameters) {
  const Effect& effect = tight_spot();
  // Fb is last in the file and first here, because the law is proportional to it
  ASSERT_EQ(effect.info().parameters[0].name, "Fb");
  const Diagnosis d = diagnose(arm_model(), {log_with_tight_spot(1)}, {noisy_log(7)});
  ASSERT_EQ(d.verdict, Verdict::kMissing) << d.table();
  ASSERT_EQ(d.effects.size(), 1u) << d.table();
  EXPECT_EQ(d.effects[0].key(), "tight_spot:arm") << d.table();
  const std::vector<double>& p = d.effects[0].applied.values;
  ASSERT_EQ(p.size(), 3u);
  // 0.8 bar on 113 cm^2 is 0.9 kN for each sample; 16 passes of about 15 samples give force and width to 3 %, and the
  // filter of 0.1 s smooths the fast passes
  EXPECT_NEAR(p[0], kForce, 0.1 * kForce);
  EXPECT_NEAR(p[1], kPlace, 0.1 * kWidth);
  EXPECT_NEAR(p[2], kWidth, 0.1 * kWidth);
  EXPECT_EQ(d.effects[0].parameters[0].unit, "kN");
  // The same number in another unit, but for rounding.
  EXPECT_NEAR(d.effects[0].parameters[0].value, 1e-3 * p[0], 1e-9);
}

TEST_F(UserEffect, IsAddedAndCarriedByTheModelFile) {
  const EffectAt effect{&tight_spot(), 0};
  CraneModel model = arm_model();
  model.user_effects = {effect.effect};
  const ExtendResult r =
      extend(model, {effect}, {{log_with_tight_spot(1)}, {}, {log_with_tight_spot(2)}});
  ASSERT_EQ(r.steps.size(), 1u);
  // the residual is noise: 6 kN over a tenth of the stroke are explained
  EXPECT_LT(r.steps[0].change.own, 0.8);
  const std::string text = model_to_json(r.model);
  const CraneModel read = model_from_json(text, "m.json");
  EXPECT_EQ(model_to_json(read), text);
  ASSERT_EQ(read.user_effects.size(), 1u);  // once, though `effects` has it too
  EXPECT_EQ(read.user_effects[0], effect.effect);

  // the model file contains its definition even if the model does not use it, so that it can be chosen later
  const CraneModel offered = model_from_json(model_to_json(model), "m.json");
  EXPECT_TRUE(offered.effects.empty());
  EXPECT_THAT(offered.user_effects, Contains(effect.effect));
}

TEST_F(UserEffect, TheSameDefinitionTwiceIsAcceptedTwoDefinitionsOfOneIdAreNot) {
  const Effect& effect = tight_spot();
  // another layout, a comment, more effects in the file: the same definition
  std::string text = std::string("# my effects\n") + kTightSpot;
  text.replace(text.find("\"Fb"), 1, "'").replace(text.find(")\"\n"), 2, ")'");
  text +=
      "  - {id: tight_spot_drag, stage: force, law: B * v, parameters: {B: {unit: N s/m, "
      "bounds: [0, 1e6], typical: 1e4}}}\n";
  const auto both = register_user_effects(text, "again.yaml", arm_machine());
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0], &effect);
  EXPECT_EQ(find_effect("tight_spot_drag"), both[1]);

  std::string other = kTightSpot;
  other.replace(other.find("bounds: [0, 50]"), 15, "bounds: [0, 60]");
  other +=
      "  - {id: never_added, stage: force, law: B * v, parameters: {B: {unit: N s/m, bounds: "
      "[0, 1e6], typical: 1e4}}}\n";
  try {
    register_user_effects(other, "other.yaml", arm_machine());
    FAIL() << "two definitions of one id";
  } catch (const InputError& error) {
    EXPECT_EQ(error.place.line, 2);
    EXPECT_THAT(error.what(), HasSubstr("other.yaml:2"));
    EXPECT_THAT(error.what(), HasSubstr("tight_spot_2"));
  }
  EXPECT_EQ(find_effect("never_added"), nullptr);  // all of a file or nothing
  EXPECT_THROW(
      register_user_effects("effects:\n  - {id: inertia, stage: force, law: B * v, "
                            "parameters: {B: {unit: N s/m, bounds: [0, 1e6], typical: 1e4}}}\n",
                            "m.yaml", arm_machine()),
      InputError);
}

TEST(UserEffectScope, LeavesTheCatalogueAsItWas) {
  const std::size_t before = effect_catalogue().size();
  {
    const UserEffectScope scope;
    register_user_effects(kTightSpot, "mine.yaml", arm_machine());
    EXPECT_EQ(effect_catalogue().size(), before + 1);
  }
  EXPECT_EQ(effect_catalogue().size(), before);
  EXPECT_EQ(find_effect("tight_spot"), nullptr);
}

/// The columns of a law at each stage in that stage's evidence (docs/user_effects.md).
TEST_F(UserEffect, ShowsInTheEvidenceOfItsStage) {
  const Machine machine = arm_machine();
  const MachineSignals signals = make_signals(machine, arm_log());
  const MachineSeries series = make_series(arm_model(), signals);
  const auto column = [&](const char* stage, const char* unit, EvidenceKind kind) {
    const std::string id = std::string("evidence_") + stage;
    const std::string text = fmt::format(
        "effects:\n  - {{id: {}, stage: {}, law: p, parameters: {{p: {{unit: {}, bounds: [0, 9], "
        "typical: 1}}}}}}\n",
        id, stage, unit);
    const Effect* e = register_user_effects(text, "m.yaml", machine).front();
    Eigen::MatrixXd x;
    return e->columns(series, {kind, 0}, 0, {}, x) ? x : Eigen::MatrixXd();
  };
  const Cylinder& c = machine.cylinders[0];
  const Eigen::VectorXi& side = series.cylinders[0].direction;
  const double ratio = c.area_piston() / c.area_rod();

  EXPECT_TRUE((column("force", "N", EvidenceKind::kForce).array() == 1.0).all());
  EXPECT_EQ(column("force", "N", EvidenceKind::kFlow).size(), 0);
  // flow into the working chamber moves the rod by that chamber's area
  const Eigen::MatrixXd flow = column("flow", "m^3/s", EvidenceKind::kFlow);
  ASSERT_EQ(flow.rows(), side.size());
  EXPECT_TRUE((side.array() > 0).any() && (side.array() < 0).any());
  for (Eigen::Index k = 0; k < side.size(); ++k) {
    if (side[k] == 0) continue;
    EXPECT_DOUBLE_EQ(flow(k, 0), side[k] > 0 ? 1.0 / c.area_piston() : -1.0 / c.area_rod());
  }
  // working pressure: as it is where a valve sets it, times the ratio of areas where the return line does
  EXPECT_NEAR(column("pressure", "Pa", EvidenceKind::kSupplyExtend)(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(column("pressure", "Pa", EvidenceKind::kReturnExtend)(0, 0), ratio, 1e-12);
  EXPECT_NEAR(column("pressure", "Pa", EvidenceKind::kReturnRetract)(0, 0), 1.0 / ratio, 1e-12);
  EXPECT_EQ(column("pressure", "Pa", EvidenceKind::kPump).size(), 0);
  EXPECT_NEAR(column("pump", "Pa", EvidenceKind::kPump)(0, 0), 1.0, 1e-12);
}

}  // namespace
}  // namespace sparflow
