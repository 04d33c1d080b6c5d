#include "identification/learning/gaussian_process/learn_pressure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "identification/learning/gaussian_process/gp_likelihood.h"
#include "models/math/error.h"
#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using testing::HasSubstr;

/// Working pressure of a lifting cylinder: load pressure, a quadratic loss and a smooth nonlinear term. [Pa]
double law(double flow, double force) {
  return 6e5 + force / 0.02 + 1.5e12 * flow * flow + 3e5 * std::sin(force / 6e4);
}

struct Data {
  ArrayXd flow, force, pressure;
};

Data make_data(Index n, double noise, unsigned seed = 5) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  Data d{ArrayXd(n), ArrayXd(n), ArrayXd(n)};
  for (Index i = 0; i < n; ++i) {
    d.flow[i] = 1.6e-3 * uniform(random);
    d.force[i] = -5e4 + 3e5 * uniform(random);
    d.pressure[i] = law(d.flow[i], d.force[i]) + noise * normal(random);
  }
  return d;
}

/// @return RMS error against the law inside the data's range [Pa]
double error_of(const GpParameters& parameters) {
  const GaussianProcess process(parameters);
  double sum = 0.0;
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const double flow = 1.6e-3 * (i + 0.5) / 20, force = -5e4 + 3e5 * (j + 0.5) / 20;
      sum += std::pow(process.mean(flow, force) - law(flow, force), 2);
    }
  }
  return std::sqrt(sum / 400);
}

TEST(LearnPressure, LearnsTheLawAndItsNoise) {
  const Data d = make_data(1500, 0.8e5);
  const LearnedGp learned = learn_gp(d.flow, d.force, d.pressure);
  EXPECT_EQ(learned.report.method, GpMethod::kInducing);
  EXPECT_TRUE(learned.report.converged);
  EXPECT_EQ(learned.report.outliers, 0);
  EXPECT_LE(learned.report.centres, 60);
  // 1500 samples of 0.8 bar determine some 20 coefficients: 0.8 * sqrt(20/1500) = 0.09 bar.
  EXPECT_LT(error_of(learned.parameters), 0.15e5);
  EXPECT_NEAR(learned.report.noise_std, 0.8e5, 0.06e5);  // four standard errors of 1000 samples
  EXPECT_NEAR(learned.report.rmse, 0.8e5, 0.06e5);
}

// Starts, with high pressure at low flow, make the samples fall with the flow; an optimiser would drive faster than the data to
// get there.
TEST(LearnPressure, APressureThatFallsWithTheFlowDoesNotFallBeyondTheData) {
  Data d = make_data(600, 0.8e5);
  const auto at_start = [](double flow) { return 30e5 * std::exp(-flow / 0.4e-3); };
  for (Index i = 0; i < d.flow.size(); ++i)
    d.pressure[i] += at_start(d.flow[i]) - 1.5e12 * d.flow[i] * d.flow[i];
  const GpParameters falls = learn_gp(d.flow, d.force, d.pressure).parameters;
  EXPECT_EQ(falls.mean_flow_slope, 0.0);
  const GaussianProcess process(falls);
  for (const double force : {0.0, 1e5, 2e5}) {
    // the fall inside the data stays: 30 bar less those that are left at their end
    EXPECT_NEAR(process.mean(0.1e-3, force) - process.mean(1.5e-3, force),
                at_start(0.1e-3) - at_start(1.5e-3), 1.5e5);
    // at three times their end, far beyond the length-scale, the mean is one over all flows, above what the end has
    EXPECT_GE(process.mean(4.8e-3, force), process.mean(1.5e-3, force) - 1e5) << force;
  }
  EXPECT_GT(learn_gp(make_data(600, 0.8e5).flow, make_data(600, 0.8e5).force,
                     make_data(600, 0.8e5).pressure)
                .parameters.mean_flow_slope,
            0.0);
}

TEST(LearnPressure, ManySamplesAreThinnedForTheWeightsAndAllAreScreenedAndJudged) {
  Data d = make_data(6000, 0.8e5);
  d.pressure[4321] += 30e5;  // an outlier that thinning alone would miss
  LearnGpOptions options;
  options.most_samples = 1500;
  const LearnedGp thinned = learn_gp(d.flow, d.force, d.pressure, options);
  EXPECT_EQ(thinned.report.outliers, 1);
  EXPECT_EQ(thinned.report.used, 5999);
  // As accurate as 1500 samples are (LearnsTheLawAndItsNoise).
  EXPECT_LT(error_of(thinned.parameters), 0.15e5);
  EXPECT_NEAR(thinned.report.rmse, 0.8e5, 0.03e5);  // four standard errors of 6000 samples
  options.most_samples = 6000;
  const LearnedGp all = learn_gp(d.flow, d.force, d.pressure, options);
  EXPECT_LT(error_of(all.parameters), error_of(thinned.parameters) + 0.02e5);
}

TEST(LearnPressure, SparseAgreesWithExact) {
  const Data d = make_data(400, 0.8e5);
  LearnGpOptions options;
  options.method = GpMethod::kExact;
  const LearnedGp exact = learn_gp(d.flow, d.force, d.pressure, options);
  options.method = GpMethod::kInducing;
  const LearnedGp sparse = learn_gp(d.flow, d.force, d.pressure, options);
  EXPECT_EQ(exact.report.centres, 400);
  EXPECT_LT(sparse.report.centres, 61);
  const GaussianProcess a(exact.parameters), b(sparse.parameters);
  for (double flow : {1e-4, 8e-4, 1.5e-3}) {
    for (double force : {-4e4, 1e5, 2.3e5}) {
      // The mean conditional variance of the sparse form is at most 1 % of the noise variance, a tenth of its deviation;
      // locally it may be three times that.
      EXPECT_NEAR(a.mean(flow, force), b.mean(flow, force), 0.3 * 0.8e5);
      EXPECT_NEAR(std::sqrt(a.variance(flow, force)), std::sqrt(b.variance(flow, force)),
                  0.2 * 0.8e5);
    }
  }
  options.method = GpMethod::kSubset;
  const LearnedGp subset = learn_gp(d.flow, d.force, d.pressure, options);
  EXPECT_LE(subset.report.centres, 60);
  EXPECT_LT(error_of(subset.parameters), 3 * 0.8e5);  // less accurate, but of the right size
}

TEST(LearnPressure, RecoversTheHyperparametersOfAGaussianProcess) {
  // Data drawn from a process with known lengths (0.5 and 0.3 of the range), s = 10 bar, noise 1 bar.
  const Index n = 350;
  Data d = make_data(n, 0.0);
  const GpHyper hyper(std::log(0.5 * 1.6e-3), std::log(0.3 * 3e5), 2 * std::log(10e5), 0.0);
  Eigen::MatrixXd k = kernel_matrix(d.flow, d.force, d.flow, d.force, hyper);
  k.diagonal().array() += 1e10;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd white = Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); });
  d.pressure = 50e5 + 20.0 * d.force + (Cholesky(k).lower() * white).array();
  for (GpMethod method : {GpMethod::kExact, GpMethod::kInducing}) {
    LearnGpOptions options;
    options.method = method;
    const GpParameters p = learn_gp(d.flow, d.force, d.pressure, options).parameters;
    // The square holds some 2 x 4 independent lengths: each estimate varies by about 1/sqrt(2*8) = 25 %.
    EXPECT_NEAR(p.length_flow / (0.5 * 1.6e-3), 1.0, 0.5) << gp_method_name(method);
    EXPECT_NEAR(p.length_force / (0.3 * 3e5), 1.0, 0.5) << gp_method_name(method);
    EXPECT_NEAR(std::log(p.signal_std / 10e5), 0.0, 0.7) << gp_method_name(method);
    EXPECT_NEAR(p.noise_std, 1e5, 0.16e5) << gp_method_name(method);  // four standard errors
  }
}

TEST(LearnPressure, OutliersAreLeftOut) {
  Data d = make_data(1500, 0.8e5);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform;
  int planted = 0;
  for (Index i = 0; i < 1500; ++i) {
    if (uniform(random) > 0.05) continue;
    d.pressure[i] += (uniform(random) < 0.5 ? -1 : 1) * (15e5 + 100e5 * uniform(random));
    ++planted;
  }
  const LearnedGp learned = learn_gp(d.flow, d.force, d.pressure);
  // The smallest outlier, 15 bar, is 19 deviations; of 1500 normal values at most one or two count as well.
  EXPECT_NEAR(learned.report.outliers, planted, 2);
  EXPECT_LT(error_of(learned.parameters), 0.16e5);
  EXPECT_NEAR(learned.report.noise_std, 0.8e5, 0.06e5);

  // A fifth of all samples is too much for outliers; all are kept with a warning.
  for (Index i = 0; i < 1500; i += 5) d.pressure[i] += 60e5;
  const LearnedGp kept = learn_gp(d.flow, d.force, d.pressure);
  EXPECT_EQ(kept.report.outliers, 0);
  ASSERT_FALSE(kept.report.warnings.empty());
  EXPECT_THAT(kept.report.warnings.front(), HasSubstr("no outliers"));
}

TEST(LearnPressure, VarianceIsSmallInsideAndGrowsOutside) {
  const Data d = make_data(1200, 0.8e5);
  const GpParameters p = learn_gp(d.flow, d.force, d.pressure).parameters;
  const GaussianProcess process(p);
  // 0.8 bar over the root of a dozen samples within a length-scale is 0.23 bar.
  EXPECT_LT(process.variance(8e-4, 1e5), std::pow(0.3e5, 2));
  // Ten length-scales away only the mean is known: the variance is at least the signal's and grows with the force by the
  // uncertainty of the slope.
  const double far_flow = process.variance(8e-4 + 10 * p.length_flow, 1e5);
  EXPECT_GE(far_flow, 0.99 * p.signal_std * p.signal_std);
  double before = 0.0;
  for (double lengths : {0.0, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    const double variance = process.variance(8e-4, p.force_max + lengths * p.length_force);
    EXPECT_GT(variance, before);
    before = variance;
  }
  EXPECT_GT(before, p.signal_std * p.signal_std);
  // The mean continues along its line instead of falling to zero.
  const double f1 = p.force_max + 15 * p.length_force, f2 = f1 + 1e5;
  EXPECT_NEAR(process.mean(8e-4, f2) - process.mean(8e-4, f1), p.mean_slope * 1e5, 1.0);
}

TEST(LearnPressure, UnitsAndOrderDoNotMatter) {
  const Data d = make_data(150, 0.8e5);
  const GaussianProcess process(learn_gp(d.flow, d.force, d.pressure).parameters);
  const GaussianProcess reversed(
      learn_gp(d.flow.reverse(), d.force.reverse(), d.pressure.reverse()).parameters);
  const GaussianProcess scaled(learn_gp(d.flow * 1e3, d.force * 1e-3, d.pressure).parameters);
  for (double force : {-4e4, 1e5, 2.3e5}) {
    const double mean = process.mean(8e-4, force);
    EXPECT_NEAR(scaled.mean(0.8, force * 1e-3), mean, 1.0);  // [Pa] rounding through the search
    EXPECT_NEAR(reversed.mean(8e-4, force), mean, 1.0);
  }
}

TEST(LearnPressure, NaNsAreCountedAndLeftOut) {
  Data d = make_data(300, 0.8e5);
  d.flow[3] = NAN;
  d.force[50] = INFINITY;
  d.pressure[77] = NAN;
  const LearnedGp learned = learn_gp(d.flow, d.force, d.pressure);
  EXPECT_EQ(learned.report.invalid, 3);
  EXPECT_EQ(learned.parameters.data_count, 297);
  // A fifth of the samples of OutliersAreLeftOut: sqrt(5) times its 0.16 bar.
  EXPECT_LT(error_of(learned.parameters), 0.4e5);
}

TEST(LearnPressure, TooFewSamplesAreAnErrorThatSaysSo) {
  const Data d = make_data(9, 0.8e5);
  try {
    learn_gp(d.flow, d.force, d.pressure);
    FAIL() << "accepted nine samples";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("got 9 usable samples"));
    EXPECT_THAT(error.what(), HasSubstr("at least 10"));
  }
  const Data enough = make_data(10, 0.8e5);
  EXPECT_EQ(learn_gp(enough.flow, enough.force, enough.pressure).report.centres, 10);
}

TEST(LearnPressure, ConstantInputsGiveAValidProcess) {
  Data d = make_data(300, 0.8e5);
  const ArrayXd force = d.force;
  d.force.setConstant(1e5);
  for (Index i = 0; i < 300; ++i) d.pressure[i] += law(d.flow[i], 1e5) - law(d.flow[i], force[i]);
  const LearnedGp constant_force = learn_gp(d.flow, d.force, d.pressure);
  EXPECT_EQ(constant_force.parameters.mean_slope, 0.0);
  ASSERT_FALSE(constant_force.report.warnings.empty());
  EXPECT_THAT(constant_force.report.warnings.front(), HasSubstr("force does not vary enough"));
  const GaussianProcess process(constant_force.parameters);
  // As in NaNsAreCountedAndLeftOut, for the same number of samples.
  EXPECT_NEAR(process.mean(1e-3, 1e5), law(1e-3, 1e5), 0.4e5);
  EXPECT_TRUE(std::isfinite(process.variance(1e-3, 4e5)));

  // Constant data without noise give the constant everywhere.
  const ArrayXd flow = ArrayXd::Constant(20, 1e-3), pressure = ArrayXd::Constant(20, 40e5);
  const LearnedGp all = learn_gp(flow, ArrayXd::Constant(20, 5e4), pressure);
  const GaussianProcess flat(all.parameters);
  EXPECT_NEAR(flat.mean(1e-3, 5e4), 40e5, 1e3);  // the smallest noise there is
  EXPECT_TRUE(std::isfinite(flat.variance(1e-3, 5e4)));
}

TEST(LearnPressure, LearningInParallelGivesTheSameAsSequentially) {
  std::vector<GpDataset> datasets;
  for (unsigned seed : {1u, 2u, 3u, 4u}) {
    const Data d = make_data(seed == 3 ? 4 : 400, 0.8e5, seed);
    datasets.push_back({"cylinder " + std::to_string(seed), d.flow, d.force, d.pressure});
  }
  std::vector<int> seen;
  const auto learned = learn_gps(
      datasets, {},
      [&](int done, int total, const std::string&) {
        EXPECT_EQ(total, 4);
        seen.push_back(done);
      },
      3);
  EXPECT_THAT(seen, testing::ElementsAre(1, 2, 3, 4));
  ASSERT_EQ(learned.size(), 4u);
  EXPECT_THAT(learned[2].report.failure, HasSubstr("cylinder 3"));
  EXPECT_EQ(learned[2].parameters.weight.size(), 0);
  for (std::size_t i : {0u, 1u, 3u}) {
    const LearnedGp one = learn_gp(datasets[i].flow, datasets[i].force, datasets[i].pressure);
    EXPECT_TRUE((one.parameters.weight == learned[i].parameters.weight).all());
    EXPECT_TRUE(learned[i].report.failure.empty());
  }
}

}  // namespace
}  // namespace sparflow
