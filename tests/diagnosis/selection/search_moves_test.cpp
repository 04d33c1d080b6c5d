// Moves of the search: which variant of a law may take the place of another.
#include "diagnosis/selection/search_moves.h"

#include <gtest/gtest.h>

#include <random>

#include "identification/signals/series.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using testing_support::drawn_machine;

/// A pump whose pressure hunts: the variant of the lag that swings explains it best.
struct Hunting {
  Machine machine = drawn_machine("loader_crane");
  Evidence evidence;
  const Effect* lag = find_effect("pump_lag");

  /// @param share of the swinging lag in the pump's pressure; its bounds are 0.5 and 2
  /// @param plain share of the lag of first order, beside it
  Hunting(double share, double plain) {
    const auto logs = testing_support::hidden_case(machine, {}, {5, 90.0});
    evidence =
        collect_evidence(CraneModel::untrained(machine), {make_signals(machine, logs.train)});
    const auto at = evidence.find(EvidenceKind::kPump, 0) - evidence.channels.data();
    EvidenceChannel& channel = evidence.channels[static_cast<std::size_t>(at)];
    std::mt19937_64 random(2);
    NoiseModel noise;
    noise.variance = 1e5 * 1e5;  // [Pa^2]
    const auto action = [&](double form) {
      return make_design(evidence, {lag, 0}, {0.34, form})
          .columns[static_cast<std::size_t>(at)]
          .col(0)
          .eval();
    };
    channel.y = testing_support::draw(noise, channel.blocks, random) + share * action(3.0) +
                plain * action(0.0);
  }

  /// The share of the lag of a form, alone.
  double share_of(double form) const {
    const EffectDesign design = make_design(evidence, {lag, 0}, {0.34, form});
    return fit_effects(evidence, {&design}, nullptr, {}).theta[0];
  }
  /// The form of the lag after the move, which begins with that of first order.
  double form_after() const {
    const SearchOptions options;
    const SearchProgress progress;
    const SearchState search(evidence, {{lag, 0}}, options, progress);
    std::vector<FoundEffect> found(1);
    found[0].design = make_design(evidence, {lag, 0}, {0.34, 0.0});
    EffectFit current = search.fit(designs_of(found));
    reshape(search, found, 0, current);
    return found[0].design.shape[1];
  }
};

TEST(SearchMoves, TheVariantThatExplainsMoreTakesThePlace) {
  EXPECT_EQ(Hunting(1.5, 0.0).form_after(), 3.0);
}

TEST(SearchMoves, AVariantOnTheBoundOfItsRangeDoesNotTakeThePlace) {
  const Hunting pump(3.0, -1.5);
  EXPECT_LT(pump.share_of(0.0), 1.9);
  EXPECT_EQ(pump.share_of(3.0), 2.0);
  EXPECT_NE(pump.form_after(), 3.0);
}

}  // namespace
}  // namespace sparflow
