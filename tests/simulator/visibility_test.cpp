// What a log can show of an effect, measured without any diagnosis.
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

TEST(HiddenVisibility, AForceGrowsInProportion) {
  const Visibility whole = seen({"coulomb_friction", "boom", 1.0, 0});
  const Visibility third = seen({"coulomb_friction", "boom", 1.0 / 3.0, 0});
  EXPECT_EQ(whole.channel, "force of boom");
  // the other crane stands in the same postures: nothing but the friction differs
  EXPECT_NEAR(whole.size / third.size, 3.0, 0.05);
  EXPECT_NEAR(whole.energy / third.energy, 9.0, 0.3);
  EXPECT_EQ(whole.swallowed, 0.0);
}

TEST(HiddenVisibility, AConstantForceIsItsShareOfTheNoise) {
  const Machine machine = machine_named("loader_crane");
  LogRequest request = quiet_request(machine, 120.0);
  request.effects = {{"force_offset", "boom", 1.0, 0}};
  const GeneratedLog log = generate(request);
  const double offset = log.truth.front().parameters.front().value;
  const Cylinder& boom =
      machine.cylinders[static_cast<std::size_t>(machine.cylinder_index("boom"))];
  // 0.8 bar white on both chambers, means over 0.3 s of 50 Hz
  const double noise = 0.8e5 * std::hypot(boom.area_piston(), boom.area_rod()) / std::sqrt(15.0);
  EXPECT_NEAR(visibility(request, false).front().size, std::abs(offset) / noise,
              0.03 * std::abs(offset) / noise);
}

TEST(HiddenVisibility, WhatIsSmallIsNotAsked) {
  EXPECT_TRUE(visible(seen({"coulomb_friction", "boom", 1.0, 0})));
  EXPECT_FALSE(visible(seen({"coulomb_friction", "boom", 1e-3, 0})));
}

TEST(HiddenVisibility, AMarginOfAPumpWithOneCylinderHasATwin) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 60.0);
  Machine& machine = request.machine;
  Pump own = machine.pumps.front();
  own.name = "own";
  own.feeds = {machine.pumps.front().feeds.back()};
  machine.pumps.front().feeds.pop_back();
  machine.pumps.push_back(own);
  for (const Pump& p : machine.pumps) {
    request.effects = {{"flow_dependent_margin", p.name, 1.0, 0}};
    EXPECT_EQ(visibility(request, false).front().twin, p.feeds.size() == 1) << p.name;
    request.effects = {
        {"line_loss", machine.cylinders[static_cast<std::size_t>(p.feeds[0])].name, 1.0, 0}};
    EXPECT_EQ(visibility(request, false).front().twin, p.feeds.size() == 1) << p.name;
  }
  Visibility v = seen({"coulomb_friction", "boom", 1.0, 0});
  v.twin = true;
  EXPECT_FALSE(visible(v));
}

TEST(HiddenVisibility, AnIncidentIsNotAsked) {
  Visibility v = seen({"coulomb_friction", "boom", 1.0, 0});
  EXPECT_NEAR(v.seconds, 0.3 * v.energy / (v.size * v.size), 1e-9);
  EXPECT_GT(v.seconds, 20.0);  // it acts whenever the boom moves
  v.seconds = 1.0;
  EXPECT_FALSE(visible(v));
}

TEST(HiddenVisibility, ALawLearnedFromTheSameLogFollowsALossOfItsOwnFlow) {
  const HiddenEffect loss{"flow_dependent_margin", "", 1.0, 0};
  const Visibility with = seen(loss, false), alone = seen(loss, true);
  EXPECT_LT(alone.energy, with.energy);
  EXPECT_GT(alone.swallowed, 0.0);
  EXPECT_LT(alone.swallowed, 1.0);
}

TEST(HiddenVisibility, AReferencePinsWhatItDidItself) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  request.effects = {{"flow_dependent_margin", "", 1.0, 0}};
  LogRequest reference = request;
  reference.motion_seed += 1;
  reference.absent = reference.effects;
  reference.effects.clear();
  const double alone = visibility(request, true).front().swallowed;
  const double pinned = visibility(request, true, &reference).front().swallowed;
  reference.seconds = 2.0;  // nothing moves yet
  const double hardly = visibility(request, true, &reference).front().swallowed;
  EXPECT_LT(pinned, 0.7 * alone);
  EXPECT_GT(hardly, 0.95 * alone);
}

TEST(HiddenVisibility, FlowShowsInTheSpeedAndEachOfAPairOnItsOwn) {
  LogRequest request = quiet_request(machine_named("loader_crane"), 120.0);
  request.effects = {{"valve_deadband", "boom", 1.0, 0}, {"coulomb_friction", "jib", 1.0, 0}};
  const std::vector<Visibility> both = visibility(request, false);
  ASSERT_EQ(both.size(), 2U);
  // what moves late is missing from the speed, and from the pump's pressure while it should lead
  EXPECT_TRUE(both[0].channel == "speed of boom" || both[0].channel == "pump main")
      << both[0].channel;
  EXPECT_EQ(both[1].channel, "force of jib");
  EXPECT_TRUE(visible(both[0]) && visible(both[1]));
}

TEST(HiddenVisibility, DelaysOfTheRecordingAreAlwaysAsked) {
  EXPECT_TRUE(visible(seen({"sensor_delay", "", 1.0, 0})));
}

}  // namespace
}  // namespace sparflow::simulator
