#include "models/effects/plausible.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/effects/registry.h"
#include "models/files/machine_file.h"

namespace sparflow {
namespace {

using ::testing::HasSubstr;

/// One boom of 440 kg, its tip 3.6 m from the joint, on a cylinder of 65 mm at 210 bar.
Machine small_crane() {
  return parse_machine(R"(name: small
joints:
  - {name: boom, type: revolute, parent: base, origin: {xyz: [0, 0, 1.5]}, axis: [0, -1, 0],
     position: [-0.75, 0.8], velocity: [-0.4, 0.4], acceleration: [-1, 1]}
tip: {joint: boom, xyz: [3.6, 0, 0]}
links:
  - {name: boom, joint: boom, mass: 440, cog: [3, 0, 0.14], inertia: 100}
cylinders:
  - {name: boom, joint: boom, bore: 0.065, rod: 0.035,
     linkage: {type: pins, barrel: {frame: base, xyz: [0.427, 0, 0.460]}, rod: {frame: boom, xyz: [0.55, 0, -0.148]}}}
pumps:
  - {name: supply, type: constant_pressure, feeds: [boom], max_flow_lpm: 40, max_pressure_bar: 210, standby_bar: 20}
valves:
  - {cylinder: boom, max_flow_lpm: {extend: 40, retract: 30}}
)",
                       "small.yaml", "");
}

std::string verdict_on(const Machine& machine, const std::string& effect,
                       std::vector<double> values) {
  const EffectAt e = parse_effect(effect, machine);
  return beyond_plausible(machine, {e.effect, e.at, std::move(values), {}, {}});
}

TEST(Plausible, AForceBeyondTheCylinderAndAMomentBeyondTheMachineAreRefused) {
  const Machine m = small_crane();
  // pi/4 0.065^2 * 210 bar = 69.7 kN
  EXPECT_THAT(verdict_on(m, "force_offset:boom", {99e3}), HasSubstr("69684"));
  EXPECT_EQ(verdict_on(m, "force_offset:boom", {-60e3}), "");
  EXPECT_EQ(verdict_on(m, "coulomb_friction:boom", {992.0}), "");
  // 440 kg at 3.6 m are 1584 kg m
  EXPECT_THAT(verdict_on(m, "unmodelled_mass:boom", {100.0, -6000.0}), HasSubstr("1584"));
  EXPECT_THAT(verdict_on(m, "unmodelled_mass:boom", {500.0, 600.0}), HasSubstr("440"));
  EXPECT_EQ(verdict_on(m, "unmodelled_mass:boom", {180.0, 600.0}), "");
  EXPECT_THAT(verdict_on(m, "pressure_offset:boom", {220e5, 1.0}), HasSubstr("210"));
}

TEST(Plausible, WhatTheMachineFileDoesNotSayBoundsNothing) {
  Machine m = small_crane();
  m.pumps.clear();
  m.links[0].mass = 0.0;
  EXPECT_EQ(verdict_on(m, "force_offset:boom", {99e3}), "");
  EXPECT_EQ(verdict_on(m, "unmodelled_mass:boom", {100.0, -6000.0}), "");
}

// Typical sizes and the file's own values are plausible on it, so that the bound refuses no effect as such.
TEST(Plausible, EveryEffectOfTheCatalogueIsPlausibleAtItsTypicalSize) {
  const Machine m = small_crane();
  int seen = 0;
  for (const EffectAt& e : candidates(m)) {
    AppliedEffect typical{e.effect, e.at, {}, {}, {}};
    for (const EffectParameter& p : e.effect->info().parameters)
      typical.values.push_back(p.typical);
    EXPECT_EQ(beyond_plausible(m, typical), "") << typical.key(m);
    ++seen;
  }
  EXPECT_GT(seen, 10);
}

}  // namespace
}  // namespace sparflow
