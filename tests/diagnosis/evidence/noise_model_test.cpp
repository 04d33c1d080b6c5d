#include "diagnosis/evidence/noise_model.h"

#include <gtest/gtest.h>

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

NoiseModel model_of(double phi1, double phi2, double variance, double offset_variance) {
  NoiseModel m;
  m.phi1 = phi1;
  m.phi2 = phi2;
  m.variance = variance;
  m.offset_variance = offset_variance;
  return m;
}

const std::vector<NoiseModel>& laws() {
  static const std::vector<NoiseModel> all = {
      model_of(0.0, 0.0, 2.0, 0.0),   // white
      model_of(0.9, 0.0, 1.0, 0.0),   // slow
      model_of(0.9, -0.2, 0.5, 4.0),  // friction-like, with an offset of each motion
      model_of(1.2, -0.8, 1.0, 0.0),  // oscillating
      model_of(0.2, 0.6, 3.0, 10.0)};
  return all;
}

/// All of the series may be coloured.
NoiseOptions as_drawn() {
  NoiseOptions options;
  options.white_share = 0.0;
  return options;
}

TEST(NoiseModel, EstimatesWhatItWasDrawnFrom) {
  std::mt19937_64 random(1);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(60, 250));
  for (const NoiseModel& truth : laws()) {
    VectorXd offsets;
    const VectorXd y = draw(truth, blocks, random, &offsets);
    const NoiseModel m = NoiseModel::estimate(y, blocks, true, as_drawn());
    // 15 000 rows: the coefficients' standard deviation is at most 1/sqrt(15000) = 0.008; subtracting the blocks' means
    // adds a bias of a few / 250 rows of a block
    EXPECT_NEAR(m.phi1, truth.phi1, 0.05) << truth.phi1 << " " << truth.phi2;
    EXPECT_NEAR(m.phi2, truth.phi2, 0.05) << truth.phi1 << " " << truth.phi2;
    // relative deviation sqrt(2/15000) = 1.2 %, and what the coefficients' errors add
    EXPECT_NEAR(m.variance, truth.variance, 0.06 * truth.variance);
    // compared with the offsets that were drawn, so that their own randomness does not count. A block's mean also has
    // the variance of the autoregression, variance / (1 - phi1 - phi2)^2 / 250, and its product with the offset
    const double gain = 1.0 - truth.phi1 - truth.phi2;
    const double of_mean = truth.variance / (gain * gain) / 250.0;
    const double drawn = offsets.squaredNorm() / 60.0;
    EXPECT_NEAR(m.offset_variance, drawn,
                3.0 * (std::sqrt(2.0 / 60.0) * of_mean + 2.0 * std::sqrt(drawn * of_mean / 60.0)) +
                    0.05 * drawn)
        << truth.phi1 << " " << truth.phi2;
  }
}

TEST(NoiseModel, DeviationIsThatOfOneValue) {
  const std::vector<NoiseBlock> blocks = blocks_of({5});
  for (const NoiseModel& m : laws())
    EXPECT_NEAR(m.deviation(), std::sqrt(dense_covariance(m, blocks)(2, 2)), 1e-12 * m.deviation());
}

TEST(NoiseModel, WhiteningIsTheInverseRootOfTheCovariance) {
  const std::vector<NoiseBlock> blocks = blocks_of({1, 2, 3, 17, 40});
  const Index n = testing_support::rows_of(blocks);
  for (const NoiseModel& m : laws()) {
    MatrixXd w = MatrixXd::Identity(n, n);
    const double log_determinant = m.whiten(blocks, w);
    const MatrixXd covariance = dense_covariance(m, blocks);
    const MatrixXd unit = w * covariance * w.transpose() / m.variance;
    // rounding of sums of 40 products of size 10
    EXPECT_LT((unit - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-11);
    const double dense = -0.5 * Cholesky(covariance / m.variance).log_det();
    EXPECT_NEAR(log_determinant, dense, 1e-10 * static_cast<double>(n));
  }
}

TEST(NoiseModel, LikelihoodIsTheDenseOne) {
  std::mt19937_64 random(2);
  const std::vector<NoiseBlock> blocks = blocks_of({30, 1, 25, 2});
  for (const NoiseModel& m : laws()) {
    const VectorXd y = draw(m, blocks, random);
    MatrixXd whitened = y;
    const double fast = m.whiten(blocks, whitened) - 0.5 * whitened.squaredNorm() / m.variance -
                        0.5 * static_cast<double>(y.size()) * std::log(m.variance);
    const MatrixXd covariance = dense_covariance(m, blocks);
    const double dense =
        -0.5 * Cholesky(covariance).log_det() - 0.5 * y.dot(Cholesky(covariance).solve(y));
    // Both are sums over the same rows; rounding of the dense factorisation stays below 1e-9 of them.
    EXPECT_NEAR(fast, dense, 1e-9 * std::abs(dense));
  }
}

TEST(NoiseModel, WhitenedRowsAreWhiteAndOfUnitSize) {
  std::mt19937_64 random(3);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(40, 200));
  for (const NoiseModel& truth : laws()) {
    MatrixXd y = draw(truth, blocks, random);
    const NoiseModel m = NoiseModel::estimate(y.col(0), blocks, true, as_drawn());
    m.whiten(blocks, y);
    y /= std::sqrt(m.variance);
    // The variance is estimated from the same rows, so that the offsets' shrinkage alone makes a difference.
    EXPECT_NEAR(y.squaredNorm() / 8000.0, 1.0, 0.03);
    for (const Index lag : {1, 2, 3, 5}) {
      double sum = 0.0;
      for (const NoiseBlock& b : blocks) {
        for (Index t = b.first + lag; t < b.last; ++t) sum += y(t, 0) * y(t - lag, 0);
      }
      // deviation of a correlation of 8000 rows: 0.011; four of them
      EXPECT_LT(std::abs(sum / 8000.0), 0.045) << "lag " << lag;
    }
  }
}

TEST(NoiseModel, ConstantInsideBlocksIsNoEvidenceOnceBlocksHaveOffsets) {
  // therefore a mass on a level boom gains little: the noise model explains a constant of each motion
  const std::vector<NoiseBlock> blocks = blocks_of({100, 100, 100, 100});
  MatrixXd without = MatrixXd::Ones(400, 1), with = without;
  model_of(0.5, 0.0, 1.0, 0.0).whiten(blocks, without);
  model_of(0.5, 0.0, 1.0, 25.0).whiten(blocks, with);
  // 1' Sigma^-1 1 = s / (1 + ratio s), s = 400 (1 - 0.5)^2 / 4 a block: four blocks give at most 4 / ratio
  EXPECT_LT(with.squaredNorm(), 4.0 / 25.0);
  EXPECT_GT(without.squaredNorm(), 90.0);
}

/// Blocks that begin with a change of a command, rows 0.1 s apart. [rows, s]
VectorXd since_start(const std::vector<NoiseBlock>& blocks) {
  VectorXd since(testing_support::rows_of(blocks));
  for (const NoiseBlock& b : blocks)
    for (Index t = b.first; t < b.last; ++t) since[t] = 0.1 * static_cast<double>(t - b.first);
  return since;
}

TEST(NoiseModel, SettlesAfterCommandsAndIsThenWhatItIsWithoutThem) {
  std::mt19937_64 random(5);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(40, 60));
  const VectorXd since = since_start(blocks);
  for (const NoiseModel& law : {laws()[0], laws()[1]}) {
    NoiseModel truth = law;
    truth.transient = 8.0;
    truth.settling = 0.4;
    const SettlingTimes times(since);
    const NoiseRows rows(blocks, times);
    const VectorXd even = draw(law, blocks, random), y = even.cwiseProduct(truth.scale_of(rows));
    const NoiseModel m = NoiseModel::estimate(y, rows, false),
                     same = NoiseModel::estimate(even, blocks, false);
    // ratios are tried in steps of 1.4, times in steps of 2.5
    EXPECT_NEAR(std::log(m.transient / truth.transient), 0.0, std::log(1.4));
    EXPECT_EQ(m.settling, truth.settling);
    // a ratio that is wrong by a step changes a tenth of the rows
    EXPECT_NEAR(m.phi1, same.phi1, 0.05);
    EXPECT_NEAR(m.deviation(), same.deviation(), 0.1 * same.deviation());
    // without the times, starts count as noise of steady motion
    EXPECT_GT(NoiseModel::estimate(y, blocks, false).deviation(), 1.5 * same.deviation());
  }
}

TEST(NoiseModel, RowsThatAreKeptKeepTheirTimes) {
  const std::vector<NoiseBlock> blocks = blocks_of({50, 30});
  const VectorXd since = since_start(blocks);
  const std::vector<Index> kept = {3, 4, 20, 55, 79};
  const SettlingTimes all(since), few = all.of_rows(kept);
  const SettlingTimes expected(VectorXd(since(kept)));
  for (std::size_t i = 0; i < kept.size(); ++i)
    EXPECT_EQ(few.class_of(static_cast<Index>(i)), expected.class_of(static_cast<Index>(i)));
  EXPECT_EQ(few.decay(0.4), expected.decay(0.4));
  EXPECT_FALSE(SettlingTimes().of_rows(kept).known());
}

TEST(NoiseModel, NoiseThatIsEvenDoesNotSettle) {
  std::mt19937_64 random(6);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(40, 60));
  for (const NoiseModel& law : laws())
    EXPECT_EQ(NoiseModel::estimate(draw(law, blocks, random),
                                   {blocks, SettlingTimes(since_start(blocks))}, false)
                  .transient,
              1.0);
}

TEST(NoiseModel, WhiteningOfUnevenRowsIsTheInverseRootToo) {
  const std::vector<NoiseBlock> blocks = blocks_of({3, 17, 40});
  const Index n = testing_support::rows_of(blocks);
  const VectorXd since = since_start(blocks);
  const SettlingTimes times(since);
  const NoiseRows rows(blocks, times);
  for (NoiseModel m : laws()) {
    m.transient = 5.0;
    MatrixXd w = MatrixXd::Identity(n, n);
    const double log_determinant = m.whiten(rows, w);
    VectorXd scale(n);
    for (Index t = 0; t < n; ++t) scale[t] = 1.0 + 4.0 * std::exp(-since[t] / m.settling);
    const MatrixXd covariance =
        scale.asDiagonal() * dense_covariance(m, blocks) * scale.asDiagonal();
    const MatrixXd unit = w * covariance * w.transpose() / m.variance;
    // rounding of sums of 40 products of size 10 times the scale, 5
    EXPECT_LT((unit - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9);
    const double dense = -0.5 * Cholesky(covariance / m.variance).log_det();
    EXPECT_NEAR(log_determinant, dense, 1e-9 * static_cast<double>(n));
  }
}

TEST(NoiseModel, FewBlocksHaveNoOffsetsAndNothingIsNoError) {
  std::mt19937_64 random(4);
  const std::vector<NoiseBlock> three = blocks_of({50, 50, 50});
  EXPECT_EQ(NoiseModel::estimate(draw(laws()[2], three, random), three).offset_variance, 0.0);
  const std::vector<NoiseBlock> five = blocks_of({50, 50, 50, 50, 50});
  EXPECT_EQ(NoiseModel::estimate(draw(laws()[2], five, random), five, false).offset_variance, 0.0);
  EXPECT_GT(NoiseModel::estimate(VectorXd::Zero(250), five).variance, 0.0);
  EXPECT_GT(NoiseModel::estimate(VectorXd::Zero(0), std::vector<NoiseBlock>{}).variance, 0.0);
  const NoiseModel constant = NoiseModel::estimate(VectorXd::Constant(250, 3.0), five);
  EXPECT_TRUE(std::isfinite(constant.deviation()));
}

TEST(NoiseModel, OptionsLimitReflectionsAndOffsets) {
  std::mt19937_64 random(4);
  NoiseOptions options = as_drawn();
  options.largest_reflection = 0.5;
  options.fewest_blocks_for_offsets = 6;
  const std::vector<NoiseBlock> eight = blocks_of(std::vector<Index>(8, 60));
  const NoiseModel ramp =
      NoiseModel::estimate(VectorXd::LinSpaced(480, -1.0, 1.0), eight, false, options);
  EXPECT_NEAR(ramp.phi1 / (1.0 - ramp.phi2), 0.5, 1e-12);
  const std::vector<NoiseBlock> five = blocks_of({50, 50, 50, 50, 50});
  const VectorXd y = draw(laws()[2], five, random);
  EXPECT_EQ(NoiseModel::estimate(y, five, true, options).offset_variance, 0.0);
}

TEST(NoiseModel, AShareOfTheVarianceIsWhiteAndTheDeviationThatOfTheSeries) {
  std::mt19937_64 random(7);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(60, 250));
  NoiseOptions options;
  for (const NoiseModel& law : laws()) {
    const VectorXd y = draw(law, blocks, random);
    const NoiseModel all = NoiseModel::estimate(y, blocks, false, as_drawn()),
                     m = NoiseModel::estimate(y, blocks, false, options);
    // Levinson's first step gives the correlation of neighbours back; shares of it are exact
    const auto neighbours = [](const NoiseModel& n) { return n.phi1 / (1.0 - n.phi2); };
    EXPECT_NEAR(neighbours(m), (1.0 - options.white_share) * neighbours(all), 1e-12);
    EXPECT_NEAR(m.deviation(), all.deviation(), 1e-9 * all.deviation());
  }
}

/// A law is driven by a signal that is measured with noise, and slow errors of the model lie beside it: differences of neighbouring
/// rows, which alone count by the exact inverse covariance of slow errors, are mostly that noise.
TEST(NoiseModel, NoiseOfARegressorDoesNotDecideTheSizeOfItsLaw) {
  std::mt19937_64 random(8);
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(400, 100));
  const Index n = testing_support::rows_of(blocks);
  const NoiseModel slow = model_of(1.5, -0.54, 1.0, 0.0);
  const VectorXd signal = draw(slow, blocks, random), errors = draw(slow, blocks, random);
  const VectorXd y = 2.0 * signal + errors;
  const VectorXd measured = signal + 0.05 * signal.norm() / std::sqrt(static_cast<double>(n)) *
                                         testing_support::white(n, random);
  const auto size = [&](const NoiseOptions& options) {
    double by = measured.dot(y) / measured.squaredNorm();
    for (int pass = 0; pass < 3; ++pass) {
      const NoiseModel m = NoiseModel::estimate(y - by * measured, blocks, false, options);
      MatrixXd rows(n, 2);
      rows << measured, y;
      m.whiten(blocks, rows);
      by = rows.col(0).dot(rows.col(1)) / rows.col(0).squaredNorm();
    }
    return by;
  };
  // The noise is a four-hundredth of the regressor's variance, and a tenth of that of its differences.
  EXPECT_LT(size(as_drawn()), 1.8) << "the noise decides nothing: this test shows nothing";
  EXPECT_NEAR(size({}), 2.0, 0.1);  // a third of it
}

TEST(NoiseModel, ARampStaysStationary) {
  // a drift through the log must not become an unstable autoregression
  const std::vector<NoiseBlock> blocks = blocks_of(std::vector<Index>(8, 60));
  const NoiseModel m = NoiseModel::estimate(VectorXd::LinSpaced(480, -1.0, 1.0), blocks, false);
  EXPECT_TRUE(std::isfinite(m.deviation()));
  MatrixXd y = VectorXd::LinSpaced(480, -1.0, 1.0);
  EXPECT_TRUE(std::isfinite(m.whiten(blocks, y)));
  EXPECT_TRUE(y.allFinite());
}

}  // namespace
}  // namespace sparflow
