#include "diagnosis/regression/effect_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

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
using testing_support::plain_channel;
using testing_support::plain_design;
using testing_support::rows_of;
using testing_support::slow_column;

NoiseModel friction_noise() {
  NoiseModel m;
  m.phi1 = 0.7;
  m.phi2 = -0.1;
  m.variance = 1.0;
  m.offset_variance = 1.0;
  return m;
}

/// Two channels with baselines; the first effect acts in both, the second in the first channel only.
struct FitCase {
  Evidence evidence;
  EffectDesign shared, single;
  VectorXd truth;
};

FitCase make_case(unsigned seed, const VectorXd& truth, Index blocks_each = 12) {
  std::mt19937_64 random(seed);
  FitCase c;
  c.truth = truth;
  std::vector<MatrixXd> shared, single;
  for (int k = 0; k < 2; ++k) {
    const std::vector<NoiseBlock> blocks =
        blocks_of(std::vector<Index>(static_cast<std::size_t>(blocks_each), 30 + 10 * k));
    const Index n = rows_of(blocks);
    MatrixXd baseline(n, 2);
    baseline.col(0).setOnes();
    baseline.col(1) = slow_column(blocks, random);
    shared.emplace_back(slow_column(blocks, random));
    single.emplace_back(k == 0 ? MatrixXd(slow_column(blocks, random)) : MatrixXd());
    VectorXd y = draw(friction_noise(), blocks, random) + 5.0 * baseline.col(0) -
                 2.0 * baseline.col(1) + truth[0] * shared.back().col(0);
    if (k == 0) y += truth[1] * single.back().col(0);
    c.evidence.channels.push_back(plain_channel(blocks, y, baseline));
  }
  c.shared = plain_design(std::move(shared));
  c.single = plain_design(std::move(single));
  return c;
}

TEST(EffectFit, IsGeneralisedLeastSquares) {
  const FitCase c = make_case(1, Eigen::Vector2d(0.8, -0.5));
  FitControl control;
  control.covariance = true;
  control.keep_residuals = true;
  const EffectFit fit = fit_effects(c.evidence, {&c.shared, &c.single}, nullptr, control);
  // the same by dense matrices: unknowns are the effects and each channel's baseline
  const Index n0 = c.evidence.channels[0].rows(), n1 = c.evidence.channels[1].rows();
  MatrixXd x = MatrixXd::Zero(n0 + n1, 6), covariance = MatrixXd::Zero(n0 + n1, n0 + n1);
  VectorXd y(n0 + n1);
  y << c.evidence.channels[0].y, c.evidence.channels[1].y;
  x.topRows(n0) << c.shared.columns[0], c.single.columns[0], c.evidence.channels[0].baseline,
      MatrixXd::Zero(n0, 2);
  x.bottomRows(n1) << c.shared.columns[1], MatrixXd::Zero(n1, 3), c.evidence.channels[1].baseline;
  covariance.topLeftCorner(n0, n0) = dense_covariance(fit.noise[0], c.evidence.channels[0].blocks);
  covariance.bottomRightCorner(n1, n1) =
      dense_covariance(fit.noise[1], c.evidence.channels[1].blocks);
  const MatrixXd precision = symmetric_inverse(covariance);
  const MatrixXd normal = x.transpose() * precision * x;
  const VectorXd dense = solve_symmetric(normal, x.transpose() * (precision * y));
  // the fit's own ridge is 1e-10 of a parameter's information
  EXPECT_NEAR(fit.theta[0], dense[0], 1e-7);
  EXPECT_NEAR(fit.theta[1], dense[1], 1e-7);
  const VectorXd residual = y - x * dense;
  // The parameters' errors of 1e-7 times columns of a few units.
  EXPECT_LT((fit.residual[0] - residual.head(n0)).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((fit.residual[1] - residual.tail(n1)).cwiseAbs().maxCoeff(), 1e-6);
  // log-likelihood of each channel with its most likely scale
  for (std::size_t k = 0; k < 2; ++k) {
    const std::vector<NoiseBlock>& blocks = c.evidence.channels[k].blocks;
    const MatrixXd shape = dense_covariance(fit.noise[k], blocks) / fit.noise[k].variance;
    const VectorXd r = k == 0 ? residual.head(n0) : residual.tail(n1);
    const double rows = static_cast<double>(r.size());
    const double v = r.dot(Cholesky(shape).solve(r)) / rows;
    const double expected = -0.5 * Cholesky(shape).log_det() -
                            0.5 * rows * (std::log(2.0 * std::numbers::pi * v) + 1.0);
    EXPECT_NEAR(fit.log_likelihood[k], expected, 1e-6);
  }
  // never narrower than the model's own covariance
  const MatrixXd model_based = symmetric_inverse(normal);
  for (Index i = 0; i < 2; ++i) EXPECT_GE(fit.covariance(i, i), (1.0 - 1e-6) * model_based(i, i));
  EXPECT_FALSE(fit.at_bound);
}

TEST(EffectFit, BoundsHoldAndTheOtherParametersAreOptimalBesideThem) {
  FitCase c = make_case(2, Eigen::Vector2d(-0.6, 0.9));
  c.shared.lower = {0.0};  // the true value is outside
  const EffectFit fit = fit_effects(c.evidence, {&c.shared, &c.single});
  EXPECT_TRUE(fit.at_bound);
  EXPECT_EQ(fit.theta[0], 0.0);
  // with the first at zero the second is estimated as if it were alone
  const EffectFit alone = fit_effects(c.evidence, {&c.single});
  // Both iterate their noise models, to the same number of passes; rounding and the ridge are left.
  EXPECT_NEAR(fit.theta[1], alone.theta[0], 1e-6);
  EXPECT_NEAR(fit.total(), alone.total(), 1e-4);
  c.shared.lower = {-0.1};
  EXPECT_NEAR(fit_effects(c.evidence, {&c.shared, &c.single}).theta[0], -0.1, 1e-9);
}

TEST(EffectFit, UnitsDoNotMatter) {
  // parameters of 1e12 Pa/(m^3/s)^2 are estimated together with parameters of 1e-8 rad/(N m)
  FitCase c = make_case(3, Eigen::Vector2d(0.8, -0.5));
  const EffectFit plain = fit_effects(c.evidence, {&c.shared, &c.single});
  for (MatrixXd& m : c.shared.columns) m *= 1e-12;
  c.single.columns[0] *= 1e8;
  c.shared.lower = {-1e20}, c.shared.upper = {1e20};
  const EffectFit scaled = fit_effects(c.evidence, {&c.shared, &c.single});
  // The solution is computed in scaled parameters, so that rounding alone differs.
  EXPECT_NEAR(scaled.theta[0] * 1e-12, plain.theta[0], 1e-9);
  EXPECT_NEAR(scaled.theta[1] * 1e8, plain.theta[1], 1e-9);
  EXPECT_NEAR(scaled.total(), plain.total(), 1e-6);
}

TEST(EffectFit, ChannelsThatAreNotActiveKeepTheirLikelihood) {
  const FitCase c = make_case(4, Eigen::Vector2d(0.8, -0.5));
  const EffectFit without = fit_effects(c.evidence, {});
  FitControl control;
  control.active = {true, false};
  const EffectFit with = fit_effects(c.evidence, {&c.single}, &without, control);
  EXPECT_EQ(with.log_likelihood[1], without.log_likelihood[1]);
  EXPECT_EQ(with.noise[1].variance, without.noise[1].variance);
  // 0.5 is some eight standard errors (0.06, as below), worth thirty nats.
  EXPECT_GT(with.log_likelihood[0], without.log_likelihood[0] + 1.0);
}

TEST(EffectFit, MoreNoisePassesThanNeededChangeNothing) {
  const FitCase c = make_case(5, Eigen::Vector2d(0.8, -0.5));
  FitControl many;
  many.noise_passes = 12;
  const EffectFit a = fit_effects(c.evidence, {&c.shared, &c.single}),
                  b = fit_effects(c.evidence, {&c.shared, &c.single}, nullptr, many);
  // a tenth of a nat is negligible beside penalties of several nats
  EXPECT_NEAR(a.total(), b.total(), 0.1);
  EXPECT_NEAR(a.theta[0], b.theta[0], 0.01);
}

TEST(EffectFit, IntervalsHaveTheirNominalCoverage) {
  const Eigen::Vector2d truth(0.8, -0.5);
  FitControl control;
  control.covariance = true;
  int held = 0, count = 0;
  VectorXd sum = VectorXd::Zero(2);
  for (unsigned seed = 100; seed < 300; ++seed) {
    const FitCase c = make_case(seed, truth);
    const EffectFit fit = fit_effects(c.evidence, {&c.shared, &c.single}, nullptr, control);
    sum += fit.theta - truth;
    for (Index i = 0; i < 2; ++i) {
      held += std::abs(fit.theta[i] - truth[i]) <= 1.96 * std::sqrt(fit.covariance(i, i)) ? 1 : 0;
      ++count;
    }
  }
  // 400 intervals: 95 % with a standard error of 1.1 %. Estimated noise makes them a little short, the robust part a
  // little wide; a diagnosis is required to have 90 .. 98 %.
  EXPECT_GE(held, static_cast<int>(0.90 * count));
  EXPECT_LE(held, static_cast<int>(0.99 * count));
  // no bias: deviations are some 0.06, their mean over 200 cases 0.005
  EXPECT_LT((sum / 200.0).cwiseAbs().maxCoeff(), 0.02);
}

TEST(EffectFit, NoChannelAndNoEffectIsNoError) {
  const Evidence empty;
  const EffectFit fit = fit_effects(empty, {});
  EXPECT_EQ(fit.theta.size(), 0);
  EXPECT_EQ(fit.total(), 0.0);
}

TEST(WhitenedRows, AreOrthogonalToTheBaseline) {
  const FitCase c = make_case(6, Eigen::Vector2d(0.0, 0.0));
  const EvidenceChannel& channel = c.evidence.channels[0];
  MatrixXd columns(channel.rows(), 2);
  columns << c.shared.columns[0], channel.baseline.col(1);
  MatrixXd coefficients;
  const MatrixXd rows = whitened_rows(channel, friction_noise(), columns, nullptr, &coefficients);
  // The other column keeps its length, of many rows of order one; rounding alone is left of the baseline's own.
  EXPECT_GT(rows.col(0).norm(), 1.0);
  EXPECT_LT(rows.col(1).norm(), 1e-9) << "a column of the baseline itself";
  EXPECT_NEAR(coefficients(1, 1), 1.0, 1e-9);
  EXPECT_NEAR(coefficients(0, 1), 0.0, 1e-9);
}

}  // namespace
}  // namespace sparflow
