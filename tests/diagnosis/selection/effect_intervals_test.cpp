#include "diagnosis/selection/effect_intervals.h"

#include <gtest/gtest.h>

#include "diagnosis/selection/search_candidates.h"
#include "models/effects/registry.h"
#include "tests/diagnosis/evidence_support.h"
#include "tests/diagnosis/hidden_case.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
namespace hand = testing_support;

/// Two parameters whose actions differ by a hundredth, with or without an effect in the data.
FoundEffect judged(double size, unsigned seed) {
  static const Machine machine = hand::drawn_machine("loader_crane");
  std::mt19937_64 random(seed);
  const std::vector<NoiseBlock> blocks = hand::blocks_of(std::vector<Index>(20, 50));
  const Index n = hand::rows_of(blocks);
  MatrixXd columns(n, 2);
  columns.col(0) = hand::slow_column(blocks, random);
  columns.col(1) = columns.col(0) + 0.01 * hand::slow_column(blocks, random);
  Evidence e;
  e.channels.push_back(hand::plain_channel(
      blocks, VectorXd(size * columns.rowwise().sum() + hand::white(n, random))));
  std::vector<FoundEffect> found(1);
  found[0].design = hand::plain_design({columns});
  found[0].design.effect = parse_effect("payload_error", machine);
  estimate_intervals(e, found);
  return found[0];
}

TEST(EffectIntervals, OfTwoCollinearParametersEachAloneMayBeZeroButNotBoth) {
  const FoundEffect f = judged(0.25, 1);
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(f.lower95[k], 0.0) << "in this seed's case neither alone differs from zero";
    EXPECT_GT(f.upper95[k], 0.0);
  }
  EXPECT_FALSE(f.not_significant) << "their sum is 0.5 with a standard error of 0.03";
}

TEST(EffectIntervals, JointSignificanceTestHasItsNominalLevel) {
  int something = 0;
  for (unsigned seed = 1; seed <= 400; ++seed)
    something += judged(0.0, seed).not_significant ? 0 : 1;
  // Three tests, each parameter alone and both together: more than 5 % and, because they are correlated, far less than
  // 15 %. The robust covariance of twenty blocks is too small by some percent.
  EXPECT_GT(something, 10);
  EXPECT_LT(something, 60);
}

TEST(SearchCandidates, GridsAreThoseOfTheLongestSuspectLog) {
  Evidence e;
  e.series.resize(3);
  e.suspects = 2;
  e.series[0].time = VectorXd::Zero(10);
  e.series[1].time = VectorXd::Zero(20);
  e.series[2].time = VectorXd::Zero(30);  // a reference
  EXPECT_EQ(&grid_log(e), &e.series[1]);
}

}  // namespace
}  // namespace sparflow
