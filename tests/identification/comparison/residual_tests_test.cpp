#include "identification/comparison/residual_tests.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Autocorrelated residuals (AR(1), correlation 0.9, so 19 samples count as one) of two quantities in 30 motions of
/// 100 samples, with three autocorrelated signals that are independent of them.
std::vector<ComparedPart> ar_parts(unsigned seed, double bias = 0.0, double slope = 0.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto coloured = [&](Index n, double rho) {
    VectorXd x(n);
    double state = normal(random);
    for (double& v : x) {
      state = rho * state + std::sqrt(1.0 - rho * rho) * normal(random);
      v = state;
    }
    return x;
  };
  constexpr Index kBlocks = 30, kSamples = 100;
  std::vector<ComparedPart> parts(2);
  for (ComparedPart& part : parts) {
    part.stage = "pressure";
    part.at = "arm";
    part.words = "working pressure of arm";
    part.unit = "bar";
    part.scale = 1e5;
    part.error.resize(kBlocks * kSamples);
    for (Index b = 0; b < kBlocks; ++b) {
      part.error.segment(b * kSamples, kSamples) = 1e5 * coloured(kSamples, 0.9);
      part.block.insert(part.block.end(), kSamples, static_cast<int>(b));
    }
    for (const char* key : {"load", "speed", "oil"})
      part.signals.push_back({key, key, "", 1.0, coloured(kBlocks * kSamples, 0.995)});
  }
  parts[0].error.array() += bias * 1e5;
  parts[0].error += slope * 1e5 * parts[0].signals[1].values;
  return parts;
}

TEST(ResidualTests, FalseAlarmsOnAutocorrelatedResidualsAreFivePercentAtMost) {
  constexpr int kReplicates = 400;
  int alarms = 0;
  for (unsigned seed = 1; seed <= kReplicates; ++seed) {
    ResidualTestOptions options;
    options.flips = 199;
    options.seed = seed;
    if (test_residuals(ar_parts(seed), 30, options).smallest_p() <= 0.05) ++alarms;
  }
  // 5 % of 400 are 20, binomial deviation 4.4: 33 would be three of them above
  EXPECT_LE(alarms, 33);
  EXPECT_GE(alarms, 7) << "far fewer than 5 %: the tests have lost their power";
  RecordProperty("alarms_of_400", alarms);
}

TEST(ResidualTests, StudentsTestWouldAlarmOnTheSameResiduals) {
  int alarms = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const VectorXd e = ar_parts(seed)[0].error;
    const double std = std::sqrt((e.array() - e.mean()).square().mean());
    if (std::abs(e.mean()) > 1.96 * std / std::sqrt(static_cast<double>(e.size()))) ++alarms;
  }
  EXPECT_GT(alarms, 40);  // 1.96 / sqrt(19) deviations: expected two in three
}

TEST(ResidualTests, ABiasIsFoundAndNamed) {
  const ResidualTests found = test_residuals(ar_parts(3, 1.0), 30);
  ASSERT_FALSE(found.tests.empty());
  const ResidualTest& first = found.tests.front();
  EXPECT_EQ(first.depends_on, "");
  // A bias of 1.0 is twelve deviations (below), far beyond any level.
  EXPECT_LE(first.p_value, 0.01);
  // 3000 samples of correlation 0.9 are 158 independent ones: deviation 0.08
  EXPECT_NEAR(first.size, 1.0, 0.25);
  EXPECT_LT(first.ci95.lo, 1.0);
  EXPECT_GT(first.ci95.hi, 1.0);
  EXPECT_THAT(first.sentence, testing::HasSubstr("too high on average"));
}

TEST(ResidualTests, ADependenceIsFoundOnItsSignalAlone) {
  const ResidualTests found = test_residuals(ar_parts(4, 0.0, 0.8), 30);
  const ResidualTest& first = found.tests.front();
  EXPECT_EQ(first.depends_on, "speed");
  EXPECT_LE(first.p_value, 0.01);
  // Some 158 independent samples give a share of 0.4 with a deviation of 0.06.
  EXPECT_NEAR(first.share_explained, 0.64 / 1.64, 0.15);
  for (const ResidualTest& t : found.tests) {
    if (t.p_value <= 0.05) {
      EXPECT_EQ(t.depends_on, "speed") << t.sentence;
    }
  }
}

TEST(ResidualTests, TooFewBlocksAreNotTested) {
  std::vector<ComparedPart> parts = ar_parts(5, 3.0);
  for (int& b : parts[0].block) b %= 5;
  parts.resize(1);
  EXPECT_TRUE(test_residuals(parts, 5).tests.empty());
}

/// Ten times the noise on average, half of it in one of six blocks: T is 30 / sqrt(15^2 + 5^2 + 4^2 + 3^2 + 2^2 + 1) = 1.8
/// though all blocks agree, which one of 14 tests exceeds by chance.
TEST(ResidualTests, WhatTooFewBlocksCannotDecideIsToldAndNotDenied) {
  std::vector<ComparedPart> parts = ar_parts(5, 10.0);
  const std::vector<int> last = {14, 19, 23, 26, 28, 29};
  for (ComparedPart& part : parts) {
    for (int& b : part.block)
      b = static_cast<int>(std::lower_bound(last.begin(), last.end(), b) - last.begin());
  }
  const ResidualTests few = test_residuals(parts, 6);
  EXPECT_GT(few.smallest_p(), few.alarm);
  EXPECT_THAT(few.undecided(), testing::Contains(testing::StartsWith(
                                   "6 blocks of motion are too few to decide whether "
                                   "the working pressure of arm is predicted 10")));
  const ResidualTests enough = test_residuals(ar_parts(5, 10.0), 30);
  EXPECT_LE(enough.smallest_p(), enough.alarm);
  EXPECT_THAT(enough.undecided(), testing::IsEmpty());
}

TEST(ResidualTests, FlipsWithBlocksOfOneSignReachTheSmallestPossibleValue) {
  const Eigen::MatrixXd sums = Eigen::MatrixXd::Ones(20, 1);
  const Eigen::MatrixXd judged = max_t_sign_flip(sums, 999, 1);
  EXPECT_DOUBLE_EQ(judged(0, 0), std::sqrt(20.0));
  EXPECT_LE(judged(0, 1), 0.002);  // 2^-19 of all flips are as large: none or one of 999
  EXPECT_EQ(judged(0, 2), judged(0, 1));
  // A test of zeros only is never significant.
  EXPECT_EQ(max_t_sign_flip(Eigen::MatrixXd::Zero(20, 1), 99, 1)(0, 1), 1.0);
}

TEST(ResidualTests, EffectiveSamplesAreThoseOfAnAutoregression) {
  const ComparedPart part = ar_parts(6)[0];
  // (1 - rho) / (1 + rho) of 3000; cutting the sum at 0.05 and its own scatter leave about a fifth
  EXPECT_NEAR(effective_samples(part.error, part.block), 3000.0 * 0.1 / 1.9, 60.0);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  VectorXd white(3000);
  for (double& v : white) v = normal(random);
  // The sum ends at the first correlation below 0.05, which white noise of 3000 samples (deviation 0.018) has at once.
  EXPECT_NEAR(effective_samples(white, part.block), 3000.0, 1.0);
}

TEST(BlockInterval, CoversTheMeanOfBlocks) {
  int covered = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(2.0, 1.0);
    VectorXd sums(30);
    for (double& v : sums) v = 10.0 * normal(random);
    const Range r = block_interval(sums, VectorXd::Constant(30, 10.0), false);
    if (r.lo < 2.0 && r.hi > 2.0) ++covered;
  }
  EXPECT_GE(covered, 87);  // 93 expected of a percentile bootstrap of 30; three deviations below
  EXPECT_TRUE(std::isnan(block_interval(VectorXd::Ones(4), VectorXd::Ones(4), false).lo));
}

}  // namespace
}  // namespace sparflow
