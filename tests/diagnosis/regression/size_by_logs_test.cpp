/// Size of an effect in suspect and reference logs, which varies from motion to motion.
#include "diagnosis/regression/size_by_logs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kStretchRows = 40;  ///< in every stretch of motion

/// One channel of two logs with `blocks` stretches each. An effect of one column has a size of its own in every stretch:
/// normal about `suspects` or `references`.
struct Drawn {
  Evidence evidence;
  EffectDesign suspect, reference;
  EffectFit fit;
  std::vector<const EffectDesign*> none;

  Drawn(double suspects, double references, double variation, int blocks, unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const Index rows = 2 * blocks * kStretchRows;
    evidence.suspects = 1;
    evidence.series.resize(2);
    evidence.channels.resize(1);
    EvidenceChannel& c = evidence.channels[0];
    c.y.resize(rows);
    c.baseline = MatrixXd::Ones(rows, 1);
    suspect.linear = reference.linear = 1;
    suspect.columns = reference.columns = {MatrixXd::Zero(rows, 1)};
    fit.noise.resize(1);
    fit.noise[0].variance = 0.01;
    for (int b = 0; b < 2 * blocks; ++b) {
      const bool here = b < blocks;
      const double size = (here ? suspects : references) + variation * normal(random);
      c.blocks.push_back({b * kStretchRows, (b + 1) * kStretchRows});
      c.log.push_back(here ? 0 : 1);
      for (Index r = b * kStretchRows; r < (b + 1) * kStretchRows; ++r) {
        const double x = normal(random);
        (here ? suspect : reference).columns[0](r, 0) = x;
        c.y[r] = 3.0 + size * x + 0.1 * normal(random);
      }
    }
  }
  /// Lets the baseline follow most of the effect, by another law in either group of logs as learned laws do.
  void absorb(unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    EvidenceChannel& c = evidence.channels[0];
    c.baseline.conservativeResize(Eigen::NoChange, 2);
    for (Index r = 0; r < c.y.size(); ++r) {
      const double here = suspect.columns[0](r, 0), there = reference.columns[0](r, 0);
      c.baseline(r, 1) = 1.4 * here + 0.7 * there + 0.6 * normal(random);
    }
  }
  SizeByLogs sizes() const {
    return size_by_logs(evidence, {suspect, reference, VectorXd::Zero(1), VectorXd::Ones(1), none},
                        fit);
  }
};

TEST(SizeByLogs, AnExactLawHasTheSameSizeInEveryMotion) {
  const SizeByLogs s = Drawn(1.0, 0.4, 0.0, 20, 1).sizes();
  // 0.1 of noise over 800 rows: 0.0035; four of it
  EXPECT_NEAR(s.suspects.size, 1.0, 0.014);
  EXPECT_NEAR(s.references.size, 0.4, 0.014);
  EXPECT_LT(s.variation, 0.01);
  EXPECT_GT(s.difference(), 50.0);
  EXPECT_EQ(s.suspects.blocks, 20);
}

/// Without a difference its normal deviate is standard normal: of 400 draws, 5 % lie beyond 1.96.
TEST(SizeByLogs, VariationBetweenMotionsIsNoDifference) {
  int beyond = 0, far = 0;
  constexpr int kDraws = 400;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    const SizeByLogs s = Drawn(1.0, 1.0, 0.3, 20, 100 + seed).sizes();
    beyond += std::abs(s.difference()) > 1.96 ? 1 : 0;
    far += std::abs(s.difference()) > 4.0 ? 1 : 0;
  }
  // 20 expected, standard deviation 4.4, and as the variation is estimated from 38 degrees of freedom a quarter more
  EXPECT_GT(beyond, 6);
  EXPECT_LT(beyond, 44);
  EXPECT_LE(far, 1);
}

TEST(SizeByLogs, ADifferenceBeyondTheVariationIsSeen) {
  const SizeByLogs s = Drawn(1.0, 0.2, 0.3, 20, 3).sizes();
  EXPECT_GT(s.difference(), 4.0);  // 0.8 over 0.3 sqrt(2/20) is 8.4
  EXPECT_GT(s.mean(), 4.0);
}

/// What a law learned from all logs follows of a change shows in the references with the opposite sign. Sizes are estimated together with
/// it, so that neither group's is drawn towards the other's.
TEST(SizeByLogs, WhatTheBaselineFollowsDrawsNoSizeTowardsTheOther) {
  Drawn d(1.0, 0.0, 0.0, 20, 5);
  d.absorb(6);
  const SizeByLogs s = d.sizes();
  EXPECT_NEAR(s.suspects.size, 1.0, 4.0 * s.suspects.standard_error);
  EXPECT_NEAR(s.references.size, 0.0, 4.0 * s.references.standard_error);
  EXPECT_LT(s.suspects.standard_error, 0.05);
  int beyond = 0;
  constexpr int kDraws = 400;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    Drawn alike(1.0, 1.0, 0.0, 20, 1000 + seed);
    alike.absorb(2000 + seed);
    beyond += std::abs(alike.sizes().difference()) > 1.96 ? 1 : 0;
  }
  // as above: without the covariance of both sizes they are two, with sizes that are estimated apart as many as here
  EXPECT_GT(beyond, 6);
  EXPECT_LT(beyond, 44);
}

/// A log in which the effect does not act says nothing of its size.
TEST(SizeByLogs, WhereTheEffectDoesNotActThereIsNoSize) {
  Drawn d(1.0, 0.0, 0.0, 10, 4);
  d.reference.columns[0].setZero();
  const SizeByLogs s = d.sizes();
  EXPECT_EQ(s.references.blocks, 0);
  EXPECT_EQ(s.difference(), 0.0);
  // 1.0 over 0.1 / sqrt(400) is 200 standard errors; their estimate from ten blocks varies by a quarter.
  EXPECT_GT(s.mean(), 50.0);
}

}  // namespace
}  // namespace sparflow
