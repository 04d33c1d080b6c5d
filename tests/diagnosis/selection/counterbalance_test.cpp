// A counterbalance valve opens at some pressure without load; one that lowers the pressure with the load and does nothing else is none.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "diagnosis/selection/effect_search.h"
#include "identification/signals/series.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Vector2d;

/// Of pressures that a counterbalance valve may set.
Eigen::Index rows_of_valve(const EvidenceChannel& c) {
  return c.kind == EvidenceKind::kSupplyExtend || c.kind == EvidenceKind::kSupplyRetract ? c.rows()
                                                                                         : 0;
}

/// Searches for a counterbalance valve in supply pressures of 1 bar of noise that contain setting - slope times the load's pressure.
SearchResult search_for_valve(double setting_bar, double slope) {
  const Machine machine = testing_support::drawn_machine("loader_crane");
  static const testing_support::HiddenCase logs =
      testing_support::hidden_case(machine, {}, {5, 90.0});
  Evidence evidence =
      collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)},
                       {make_signals(machine, logs.reference)});
  std::mt19937_64 random(2);
  NoiseModel noise;
  noise.variance = 1e5 * 1e5;  // [Pa^2]
  for (EvidenceChannel& c : evidence.channels) c.y = testing_support::draw(noise, c.blocks, random);
  const auto seen = std::max_element(evidence.channels.begin(), evidence.channels.end(),
                                     [](const EvidenceChannel& a, const EvidenceChannel& b) {
                                       return rows_of_valve(a) < rows_of_valve(b);
                                     });
  EXPECT_GT(rows_of_valve(*seen), 100);
  const EffectAt valve{find_effect("counterbalance"), seen->index};
  const double side = seen->kind == EvidenceKind::kSupplyExtend ? 1.0 : -1.0;
  const EffectDesign design = make_design(evidence, valve, {side});
  seen->y += design.columns[static_cast<std::size_t>(seen - evidence.channels.begin())] *
             Vector2d(setting_bar * 1e5, slope);
  return search_effects(evidence, {valve});
}

TEST(Counterbalance, AValveThatOpensWithoutAnyPressureIsNone) {
  const SearchResult valve = search_for_valve(40.0, 0.2);
  ASSERT_EQ(valve.found.size(), 1U);
  EXPECT_NEAR(valve.found[0].values[0], 40e5, 4e5);
  EXPECT_NEAR(valve.found[0].values[1], 0.2, 0.02);
  const SearchResult none = search_for_valve(0.0, 0.2);
  EXPECT_TRUE(none.found.empty());
  EXPECT_FALSE(none.unnamed.empty());  // the pressures contain something all the same
}

}  // namespace
}  // namespace sparflow
