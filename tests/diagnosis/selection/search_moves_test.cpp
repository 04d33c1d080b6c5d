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
      return make_design(evidence, {lag, 0}, {0.34, form, 0.0, 0.0, 0.0, 0.0})
          .columns[static_cast<std::size_t>(at)]
          .col(0)
          .eval();
    };
    channel.y = testing_support::draw(noise, channel.blocks, random) + share * action(3.0) +
                plain * action(0.0);
  }

  /// The share of the lag of a form, alone.
  double share_of(double form) const {
    const EffectDesign design = make_design(evidence, {lag, 0}, {0.34, form, 0.0, 0.0, 0.0, 0.0});
    return fit_effects(evidence, {&design}, nullptr, {}).theta[0];
  }
  /// The nonlinear parameters of the lag after the move, which begins with that of first order.
  std::vector<double> shape_after() const {
    const SearchOptions options;
    const SearchProgress progress;
    const SearchState search(evidence, {{lag, 0}}, options, progress);
    std::vector<FoundEffect> found(1);
    found[0].design = make_design(evidence, {lag, 0}, {0.34, 0.0, 0.0, 0.0, 0.0, 0.0});
    EffectFit current = search.fit(designs_of(found));
    reshape(search, found, 0, current);
    return found[0].design.shape;
  }
};

TEST(SearchMoves, TheVariantThatExplainsMoreTakesThePlace) {
  EXPECT_EQ(Hunting(1.5, 0.0).shape_after()[1], 3.0);
}

TEST(SearchMoves, AVariantOnTheBoundOfItsRangeDoesNotTakeThePlace) {
  const Hunting pump(3.0, -2.5);
  EXPECT_LT(pump.share_of(0.0), 1.9);
  EXPECT_EQ(pump.share_of(3.0), 2.0);
  const std::vector<double> shape = pump.shape_after();
  const bool takes_the_place = shape[1] == 3.0 && shape[2] == 0.0;  // not with late valves
  EXPECT_FALSE(takes_the_place);
}

/// A force that swings at one of three frequencies.
class Course final : public Effect {
 public:
  explicit Course(int which) : which_(which) {}
  const EffectInfo& info() const override {
    static const EffectInfo info = [] {
      EffectInfo i;
      i.id = "force_of_a_course";
      i.place = EffectPlace::kMachine;
      i.parameters = {{"size", "N", 1.0, -100.0, 100.0, 1.0, "", true, {}}};
      return i;
    }();
    return info;
  }
  std::vector<EvidenceKind> shows_in() const override { return {EvidenceKind::kForce}; }
  bool columns_filtered() const override { return true; }  // no filter in a hand-made log
  bool columns(const MachineSeries& log, const MeasuredQuantity&, int, std::span<const double>,
               Eigen::MatrixXd& columns) const override {
    const Eigen::ArrayXd t = log.time.array();
    columns = Eigen::sin((which_ == 0 ? 3.0 : which_ == 1 ? 3.3 : 8.0) * t);
    return true;
  }

 private:
  int which_;
};

/// The first course acts. The second, which resembles it, was found while the first was refused beside the third.
struct Refused {
  Course first{0}, second{1}, third{2};
  Evidence evidence;
  SearchOptions options;
  SearchProgress progress;

  Refused() {
    const std::vector<NoiseBlock> blocks =
        testing_support::blocks_of(std::vector<Eigen::Index>(10, 50));
    const Eigen::Index n = testing_support::rows_of(blocks);
    std::mt19937_64 random(6);
    evidence.suspects = 1;
    evidence.series.resize(1);
    MachineSeries& s = evidence.series[0];
    s.time = Eigen::VectorXd::LinSpaced(n, 0.0, 5.0);
    s.step = s.time[1];
    s.runs = {{0, n}};
    EvidenceChannel c = testing_support::plain_channel(
        blocks, Eigen::VectorXd(2.0 * (3.0 * s.time.array()).sin().matrix() +
                                testing_support::white(n, random)));
    for (Eigen::Index i = 0; i < n; ++i) c.sample.push_back(i);
    evidence.channels.push_back(c);
  }
  std::vector<EffectAt> all() const { return {{&first, -1}, {&second, -1}, {&third, -1}}; }
  FoundEffect of(const Course& course) const {
    FoundEffect f;
    f.design = make_design(evidence, {&course, -1}, {});
    return f;
  }
};

TEST(SearchMoves, ARefusalForModelFormErrorIsVoidWithoutTheEffectThatHasIt) {
  const Refused r;
  SearchState search(r.evidence, r.all(), r.options, r.progress);
  search.refuse(0, r.of(r.first), {r.of(r.third)}, true);
  search.refuse(1, r.of(r.second), {r.of(r.third)}, false);
  EXPECT_TRUE(search.skipped({})[0]);
  search.allow_beside({&r.second, -1});
  EXPECT_TRUE(search.skipped({})[0]) << "this one was not found then";
  search.allow_beside({&r.third, -1});
  EXPECT_FALSE(search.skipped({})[0]);
  EXPECT_TRUE(search.skipped({})[1]) << "it had failed another test";
}

TEST(SearchMoves, WhatIsDroppedForModelFormErrorIsACandidateAgainWithoutTheEffectThatHasIt) {
  const Refused r;
  SearchState search(r.evidence, r.all(), r.options, r.progress);
  std::vector<FoundEffect> found{r.of(r.first), r.of(r.second), r.of(r.third)};
  for (FoundEffect& f : found) {
    f.size = 3.0;
    f.absorbed_where_seen = 0.0;
    f.held_out = 50.0;
  }
  found[1].not_significant = true;
  search.drop(found, 0);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(search.skipped({})[0]);
  search.drop(found, 0);
  EXPECT_FALSE(search.skipped({})[0]) << "the second, beside which it was dropped, is not found";
  EXPECT_TRUE(search.skipped({})[1]);
  search.drop(found, 0);
  EXPECT_TRUE(search.skipped({})[1]) << "it was not significant";
}

TEST(SearchMoves, AnEffectWhoseRefusalIsVoidTakesThePlaceOfOneThatExplainsLess) {
  const Refused r;
  SearchState search(r.evidence, r.all(), r.options, r.progress);
  const auto after = [&] {
    std::vector<FoundEffect> found{r.of(r.second)};
    EffectFit current = search.fit(designs_of(found));
    exchange(search, found, 0, current);
    return found[0].design.effect.effect;
  };
  EXPECT_EQ(after(), &r.second) << "nothing has been refused";
  search.refuse(0, r.of(r.first), {r.of(r.third)}, true);
  search.refuse(2, r.of(r.third), {r.of(r.first)}, true);
  EXPECT_EQ(after(), &r.second) << "the refusals hold";
  search.allow_beside({&r.first, -1});
  EXPECT_EQ(after(), &r.second) << "the third explains less";
  search.allow_beside({&r.third, -1});
  EXPECT_EQ(after(), &r.first);
}

}  // namespace
}  // namespace sparflow
