/// Diagnosis against references: what both logs show is no change, another value of it is one.
#include "diagnosis/verdict/reference_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "identification/learning/fit.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using simulator::HiddenEffect;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing_support::drawn_machine;

const Machine& loader() {
  static const Machine machine = drawn_machine("loader_crane");
  return machine;
}

/// A log of one crane at its own motions.
Log crane_log(const std::vector<HiddenEffect>& effects, std::uint64_t motions) {
  simulator::CaseRequest request;
  request.log.machine = loader();
  request.log.effects = effects;
  request.log.crane_seed = 7;
  request.log.motion_seed = motions;
  request.log.seconds = 100.0;
  request.test_seconds = 5.0;
  return log_from_text("log.csv", simulator::csv_text(simulator::generate_case(request).train),
                       loader());
}

std::vector<std::string> keys_of(const std::vector<DiagnosedEffect>& effects) {
  std::vector<std::string> keys;
  for (const DiagnosedEffect& e : effects) keys.push_back(e.key());
  return keys;
}

/// Friction of the boom acts in the reference of every case here, and the model does not have it.
struct Compared {
  Log reference = crane_log({{"coulomb_friction", "boom", 1.0, 0}}, 7);
  CraneModel model;
  Compared() {
    FitOptions options;
    options.hold_out_every = 0;
    model = fit(loader(), {reference}, {}, options).model;
  }
  Diagnosis with(const std::vector<HiddenEffect>& effects) const {
    return diagnose(model, {crane_log(effects, 8)}, {reference});
  }
};
const Compared& compared() {
  static const Compared c;
  return c;
}

TEST(ReferenceComparison, WhatBothLogsShowIsNoChange) {
  const Diagnosis d = compared().with({{"coulomb_friction", "boom", 1.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kNone) << d.table();
  EXPECT_THAT(d.effects, IsEmpty());
  EXPECT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
}

TEST(ReferenceComparison, AChangeBesideItIsNamedAlone) {
  const Diagnosis d =
      compared().with({{"coulomb_friction", "boom", 1.0, 0}, {"viscous_friction", "jib", 1.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kMissing) << d.table();
  EXPECT_THAT(keys_of(d.effects), ElementsAre("viscous_friction:jib")) << d.table();
  EXPECT_FALSE(d.effects.front().change);
  EXPECT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
}

TEST(ReferenceComparison, AnotherValueOfItIsAChangeAndItsParametersAreTheDifference) {
  const Diagnosis d = compared().with({{"coulomb_friction", "boom", 2.0, 0}});
  EXPECT_EQ(d.verdict, Verdict::kMissing) << d.table();
  ASSERT_THAT(keys_of(d.effects), ElementsAre("coulomb_friction:boom")) << d.table();
  EXPECT_TRUE(d.effects.front().change);
  ASSERT_THAT(keys_of(d.lacking), Contains("coulomb_friction:boom"));
  const auto shared =
      std::find_if(d.lacking.begin(), d.lacking.end(),
                   [](const DiagnosedEffect& e) { return e.key() == "coulomb_friction:boom"; });
  // twice the effect: the difference is as large as what both have, but for the errors of both estimates
  EXPECT_NEAR(d.effects.front().parameters.front().value / shared->parameters.front().value, 1.0,
              0.15);
}

/// Logs of a public hydraulics simulator, whose laws nobody here wrote: changes of its plant are named alone.
TEST(ReferenceComparison, ChangesOfAForeignPlantAreNamedAlone) {
  const std::string shared = std::string(SPARFLOW_SOURCE_DIR) + "/../shared/";
  const std::string folder = shared + "data/foreign_plant/";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "the logs of the foreign plant are not part of the repository";
  const Machine machine = load_machine(shared + "machines/three_axis.yaml");
  const Log reference = load_log(folder + "ref1.csv", machine);
  FitOptions options;
  options.hold_out_every = 0;
  const CraneModel model = fit(machine, {reference}, {}, options).model;
  const auto named = [&](const char* name) {
    return keys_of(diagnose(model, {load_log(folder + name, machine)}, {reference}).effects);
  };
  EXPECT_THAT(named("clean1.csv"), IsEmpty());
  EXPECT_THAT(named("a1.csv"), ElementsAre("coulomb_friction:lift"));
  EXPECT_THAT(named("b1.csv"), ElementsAre("viscous_friction:lift"));
  EXPECT_THAT(named("d1.csv"), ElementsAre("leakage:lift"));
  EXPECT_THAT(named("hl1.csv"), ElementsAre("line_loss:lift"));
  EXPECT_THAT(named("j1.csv"), ElementsAre("pressure_offset:lift"));
  EXPECT_THAT(named("i1.csv"), ElementsAre("flow_saturation:main"));
  EXPECT_THAT(named("clean2.csv"), IsEmpty());
  // The regulator hunts in one motion only: the mean level of the residual hardly moves, and no law fits.
  const Diagnosis hunting = diagnose(model, {load_log(folder + "e1.csv", machine)}, {reference});
  EXPECT_NE(hunting.verdict, Verdict::kNone) << hunting.table();
  EXPECT_NE(hunting.verdict, Verdict::kBadData) << hunting.table();
}

}  // namespace
}  // namespace sparflow
