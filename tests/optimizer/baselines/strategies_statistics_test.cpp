// Quantiles and the signed-rank test against closed forms and published tables.
#include "optimizer/baselines/strategies_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "optimizer/baselines/strategies_summary.h"

namespace sparflow {
namespace {

TEST(Quantile, IsLinearBetweenSortedValues) {
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(quantile({7.0}, 0.9), 7.0);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(SignedRank, AllOfOneSignHasTwoToTheMinusN) {
  // two-sided: 2 / 2^n
  const SignedRank t = signed_rank_test({1.0, 2.0, 3.0, 4.0, 5.0});
  EXPECT_EQ(t.n, 5);
  EXPECT_DOUBLE_EQ(t.w_plus, 15.0);
  EXPECT_DOUBLE_EQ(t.w_minus, 0.0);
  EXPECT_DOUBLE_EQ(t.p_value, 2.0 / 32.0);
  EXPECT_TRUE(t.exact);
}

TEST(SignedRank, AgreesWithWilcoxonsTable) {
  // n = 8, W- = 3: of 256 sign patterns 5 have a sum of 3 or less ({}, 1, 2, 3, 1+2); the published two-sided
  // 5 % limit for n = 8 is W = 3
  const SignedRank t = signed_rank_test({-1.0, -2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0});
  EXPECT_DOUBLE_EQ(t.w_minus, 3.0);
  EXPECT_DOUBLE_EQ(t.p_value, 2.0 * 5.0 / 256.0);
}

TEST(SignedRank, TiesShareTheirRankAndZerosAreLeftOut) {
  // |d| = 1, 1, 2: ranks 1.5, 1.5, 3; W- = 1.5. Sums by pattern: 0, 1.5 (twice), 3 (twice), 4.5 (twice), 6
  const SignedRank t = signed_rank_test({0.0, 1.0, -1.0, 2.0});
  EXPECT_EQ(t.n, 3);
  EXPECT_DOUBLE_EQ(t.w_minus, 1.5);
  EXPECT_DOUBLE_EQ(t.p_value, 2.0 * 3.0 / 8.0);
}

TEST(SignedRank, WithoutDifferencesThePValueIsOne) {
  EXPECT_DOUBLE_EQ(signed_rank_test({}).p_value, 1.0);
  EXPECT_DOUBLE_EQ(signed_rank_test({0.0, 0.0}).p_value, 1.0);
}

TEST(SignedRank, NormalApproximationJoinsTheExactOne) {
  const auto lean = [](int n) {
    std::vector<double> d;
    for (int i = 1; i <= n; ++i) d.push_back(i % 3 == 0 ? -i : i);
    return signed_rank_test(d);
  };
  // Wilcoxon's mean and variance without ties, with the continuity correction of half a step.
  const auto by_hand = [](const SignedRank& t) {
    const double n = t.n;
    const double z =
        (std::abs(t.w_plus - n * (n + 1) / 4) - 0.5) / std::sqrt(n * (n + 1) * (2 * n + 1) / 24);
    return std::erfc(z / std::sqrt(2.0));
  };
  const SignedRank exact = lean(60), normal = lean(61);
  EXPECT_TRUE(exact.exact);
  EXPECT_FALSE(normal.exact);
  EXPECT_NEAR(normal.p_value, by_hand(normal), 1e-12);
  // at n = 60 the approximation is good to a few percent of a p-value of 0.04
  EXPECT_NEAR(exact.p_value, by_hand(exact), 0.05 * exact.p_value);
}

StrategyComparison made_up(double sequential, double optimal) {
  StrategyComparison c;
  StrategyRow row{"equal", 0.0, 10.0, {}};
  for (const auto& [kind, energy] : {std::pair{kSequential, sequential}, {kOptimal, optimal}}) {
    StrategyOutcome o;
    o.kind = kind;
    o.duration = 10.0;
    o.energy.total = energy;
    if (energy > 0.0) o.motion.t = Eigen::VectorXd::LinSpaced(2, 0.0, 10.0);
    row.outcomes.push_back(std::move(o));
  }
  c.rows.push_back(std::move(row));
  return c;
}

TEST(PairedSummary, CountsOnlyProblemsThatBothSolve) {
  const std::vector<StrategyComparison> all = {made_up(110.0, 100.0), made_up(130.0, 100.0),
                                               made_up(120.0, 100.0), made_up(0.0, 100.0)};
  const PairedSummary s = paired(all, "equal", kSequential, kOptimal);
  EXPECT_EQ(s.n, 3);
  EXPECT_EQ(s.only_against, 1);
  EXPECT_EQ(s.only_kind, 0);
  EXPECT_EQ(s.dearer, 3);
  EXPECT_NEAR(s.median, 0.2, 1e-12);
  EXPECT_NEAR(s.largest, 0.3, 1e-12);
  EXPECT_DOUBLE_EQ(s.test.p_value, 0.25);  // 2 / 2^3
}

}  // namespace
}  // namespace sparflow
