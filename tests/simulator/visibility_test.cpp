// How much of an effect a log can show, determined without any diagnosis.
#include "simulator/hidden_effects/visibility.h"

#include <gmock/gmock.h>

#include "tests/simulator/hidden_log_support.h"

namespace sparflow::simulator {
namespace {

Visibility seen(const HiddenEffect& effect, bool learned_from_it = false) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  request.effects = {effect};
  return visibility(request, learned_from_it).front();
}

TEST(HiddenVisibility, GrowsInProportionToAForce) {
  const Visibility whole = seen({"coulomb_friction", "boom", 1.0, 0});
  const Visibility third = seen({"coulomb_friction", "boom", 1.0 / 3.0, 0});
  EXPECT_EQ(whole.channel, "force of boom");
  // The second crane is in the same postures, so that only the friction differs.
  EXPECT_NEAR(whole.size / third.size, 3.0, 0.05);
  EXPECT_NEAR(whole.energy / third.energy, 9.0, 0.3);
  EXPECT_EQ(whole.absorbed, 0.0);
}

TEST(HiddenVisibility, OfAConstantForceIsItsRatioToTheNoise) {
  const Machine machine = machine_named("loader_crane");
  LogRequest request = quiet_request(machine, 120.0);
  request.effects = {{"force_offset", "boom", 1.0, 0}};
  const GeneratedLog log = generate(request);
  const double offset = log.truth.front().parameters.front().value;
  const Cylinder& boom =
      machine.cylinders[static_cast<std::size_t>(machine.cylinder_index("boom"))];
  // White noise of 0.8 bar on both chambers, averaged over 0.3 s at 50 Hz.
  const double noise = 0.8e5 * std::hypot(boom.area_piston(), boom.area_rod()) / std::sqrt(15.0);
  EXPECT_NEAR(visibility(request, false).front().size, std::abs(offset) / noise,
              0.03 * std::abs(offset) / noise);
}

TEST(HiddenVisibility, ExcludesASmallEffect) {
  EXPECT_TRUE(visible(seen({"coulomb_friction", "boom", 1.0, 0})));
  EXPECT_FALSE(visible(seen({"coulomb_friction", "boom", 1e-3, 0})));
}

TEST(HiddenVisibility, ExcludesMarginAndLineLossOfAPumpWithOneCylinder) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 60.0);
  Machine& machine = request.machine;
  Pump own = machine.pumps.front();
  own.name = "own";
  own.feeds = {machine.pumps.front().feeds.back()};
  machine.pumps.front().feeds.pop_back();
  machine.pumps.push_back(own);
  for (const Pump& p : machine.pumps) {
    request.effects = {{"flow_dependent_margin", p.name, 1.0, 0}};
    EXPECT_EQ(visibility(request, false).front().equivalent, p.feeds.size() == 1) << p.name;
    request.effects = {
        {"line_loss", machine.cylinders[static_cast<std::size_t>(p.feeds[0])].name, 1.0, 0}};
    EXPECT_EQ(visibility(request, false).front().equivalent, p.feeds.size() == 1) << p.name;
  }
  Visibility v = seen({"coulomb_friction", "boom", 1.0, 0});
  v.equivalent = true;
  EXPECT_FALSE(visible(v));
}

TEST(HiddenVisibility, ExcludesAnIsolatedEvent) {
  Visibility v = seen({"coulomb_friction", "boom", 1.0, 0});
  EXPECT_NEAR(v.seconds, 0.3 * v.energy / (v.size * v.size), 1e-9);
  EXPECT_GT(v.seconds, 20.0);  // The friction acts whenever the boom moves.
  v.seconds = 1.0;
  EXPECT_FALSE(visible(v));
}

TEST(HiddenVisibility, LawLearnedFromTheSameLogAbsorbsALossOfItsOwnFlow) {
  const HiddenEffect loss{"flow_dependent_margin", "", 1.0, 0};
  const Visibility with = seen(loss, false), alone = seen(loss, true);
  EXPECT_LT(alone.energy, with.energy);
  EXPECT_GT(alone.absorbed, 0.0);
  EXPECT_LT(alone.absorbed, 1.0);
}

TEST(HiddenVisibility, ReferenceLimitsAbsorptionInTheStatesItVisits) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  request.effects = {{"flow_dependent_margin", "", 1.0, 0}};
  LogRequest reference = request;
  reference.motion_seed += 1;
  reference.absent = reference.effects;
  reference.effects.clear();
  const double alone = visibility(request, true).front().absorbed;
  const double pinned = visibility(request, true, &reference).front().absorbed;
  reference.seconds = 2.0;  // too short for any motion
  const double hardly = visibility(request, true, &reference).front().absorbed;
  EXPECT_LT(pinned, 0.7 * alone);
  EXPECT_GT(hardly, 0.95 * alone);
}

TEST(HiddenVisibility, FlowActsOnSpeedAndEachOfTwoEffectsIsJudged) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  request.effects = {{"valve_deadband", "boom", 1.0, 0}, {"coulomb_friction", "jib", 1.0, 0}};
  const std::vector<Visibility> both = visibility(request, false);
  ASSERT_EQ(both.size(), 2U);
  // A late motion lacks speed, and the pump lacks pressure while that cylinder should be the leader.
  EXPECT_TRUE(both[0].channel == "speed of boom" || both[0].channel == "pump main")
      << both[0].channel;
  EXPECT_EQ(both[1].channel, "force of jib");
  EXPECT_TRUE(visible(both[0]) && visible(both[1]));
}

TEST(HiddenVisibility, IncludesDelaysOfTheRecording) {
  EXPECT_TRUE(visible(seen({"sensor_delay", "", 1.0, 0})));
}

}  // namespace
}  // namespace sparflow::simulator
