/// Noise whose blocks have variances of their own.
#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/evidence/noise_model.h"
#include "models/math/linear_algebra.h"
#include "tests/diagnosis/evidence_support.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing_support::blocks_of;
using testing_support::dense_covariance;
using testing_support::draw;

constexpr double kFreedom = 10.0;  // [rows]

NoiseOptions by_block() {
  NoiseOptions options;
  options.white_share = 0.0;
  options.block_freedom = kFreedom;
  return options;
}

NoiseModel coloured() {
  NoiseModel m;
  m.phi1 = 0.6;
  m.phi2 = -0.1;
  m.variance = 2.0;
  return m;
}

TEST(BlockVariance, IsEstimatedBesideTheAutoregression) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(60, 250));
  const NoiseModel truth = coloured();
  VectorXd y = draw(truth, blocks, random);
  std::vector<double> scale;
  for (const NoiseBlock& b : blocks) {
    scale.push_back(std::exp(1.3 * normal(random)));
    y.segment(b.first, b.last - b.first) *= scale.back();
  }
  const NoiseModel m = NoiseModel::estimate(y, blocks, false, by_block());
  EXPECT_NEAR(m.phi1, truth.phi1, 0.05);  // as of even noise, noise_model_test.cpp
  EXPECT_NEAR(m.phi2, truth.phi2, 0.05);
  ASSERT_EQ(m.block_scale.size(), scale.size());
  for (std::size_t b = 0; b < scale.size(); ++b) {
    // in units of the model's deviation, with the prior's rows beside the block's 250
    const double own = scale[b] * std::sqrt(truth.variance / m.variance);
    const double expected = std::sqrt((kFreedom + 250.0 * own * own) / (kFreedom + 250.0));
    // the deviation of 250 rows has a relative error of 4.5 %, five of which
    EXPECT_NEAR(std::log(m.block_scale[b] / expected), 0.0, 0.22) << scale[b];
  }
}

TEST(BlockVariance, WhiteningIsTheInverseRootOfTheCovariance) {
  const std::vector<NoiseBlock> blocks = blocks_of({1, 3, 17, 40});
  const Index n = testing_support::rows_of(blocks);
  NoiseModel m = coloured();
  m.offset_variance = 3.0;
  const MatrixXd even = dense_covariance(m, blocks);
  m.block_scale = {0.5, 2.0, 1.0, 3.0};
  m.block_freedom = kFreedom;
  VectorXd scale(n);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    scale.segment(blocks[b].first, blocks[b].last - blocks[b].first).setConstant(m.block_scale[b]);
  const MatrixXd covariance = scale.asDiagonal() * even * scale.asDiagonal();
  MatrixXd w = MatrixXd::Identity(n, n);
  const double log_determinant = m.whiten(blocks, w);
  const MatrixXd unit = w * covariance * w.transpose() / m.variance;
  EXPECT_LT((unit - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-11);  // rounding
  // of the inverse gamma distribution whose mode in log k is one: p(log k) ~ k^-f exp(-f / (2 k^2)), at most exp(-f / 2)
  double prior = 0.0;
  for (const double k : m.block_scale)
    prior += -kFreedom * std::log(k) - kFreedom / (2.0 * k * k) + kFreedom / 2.0;
  const double dense = prior - 0.5 * Cholesky(covariance / m.variance).log_det();
  EXPECT_NEAR(log_determinant, dense, 1e-10 * static_cast<double>(n));
}

TEST(BlockVariance, OfEvenNoiseGainsNothing) {
  std::mt19937_64 random(8);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(40, 150));
  const VectorXd y = draw(coloured(), blocks, random);
  NoiseOptions even = by_block();
  even.block_freedom = 0.0;
  const NoiseModel with = NoiseModel::estimate(y, blocks, false, by_block()),
                   without = NoiseModel::estimate(y, blocks, false, even);
  EXPECT_TRUE(without.block_scale.empty());
  // every block's deviation follows its own rows, which gains half a nat of the likelihood in the mean; the prior takes some of it
  EXPECT_NEAR(with.log_likelihood(y, blocks), without.log_likelihood(y, blocks), 0.5 * 40.0);
  EXPECT_NEAR(with.deviation(), without.deviation(), 0.05 * without.deviation());
}

TEST(BlockVariance, FewLoudBlocksHideNothingThatAllOthersShow) {
  std::mt19937_64 random(9);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(40, 100));
  VectorXd y = draw(coloured(), blocks, random);
  for (const std::size_t loud : {3U, 17U}) y.segment(blocks[loud].first, 100) *= 30.0;
  const double kShift = 0.3;  // a sixth of the deviation
  VectorXd column(y.size());
  for (Index i = 0; i < column.size(); ++i) column[i] = i / 50 % 2 == 0 ? 1.0 : -1.0;
  y += kShift * column;
  const auto error = [&](const NoiseOptions& options) {
    const NoiseModel m = NoiseModel::estimate(y, blocks, false, options);
    MatrixXd rows(y.size(), 2);
    rows << column, y;
    m.whiten(blocks, rows);
    const double information = rows.col(0).squaredNorm();
    return std::pair(rows.col(0).dot(rows.col(1)) / information,
                     std::sqrt(m.variance / information));
  };
  NoiseOptions even = by_block();
  even.block_freedom = 0.0;
  const auto [sharp, sharp_error] = error(by_block());
  const auto [blurred, blurred_error] = error(even);
  EXPECT_NEAR(sharp, kShift, 3.0 * sharp_error);
  EXPECT_GT(sharp, 5.0 * sharp_error) << "it is seen";
  EXPECT_NEAR(blurred, kShift, 3.0 * blurred_error);
  EXPECT_LT(kShift, 2.0 * blurred_error) << "with one variance it is not";
  EXPECT_LT(sharp_error, 0.25 * blurred_error);
}

TEST(BlockVariance, NeedsSeveralBlocks) {
  std::mt19937_64 random(10);
  const std::vector<NoiseBlock> blocks = blocks_of({200, 200, 200});
  const VectorXd y = draw(coloured(), blocks, random);
  EXPECT_TRUE(NoiseModel::estimate(y, blocks, false, by_block()).block_scale.empty());
}

}  // namespace
}  // namespace sparflow
