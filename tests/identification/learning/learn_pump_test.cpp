#include "identification/learning/learn_pump.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::VectorXd;
using testing::HasSubstr;

struct PumpCase {
  std::vector<double> margin;     // [bar]
  std::vector<double> low, high;  // [bar] range of the working pressures
  double standby = 22.0;          // [bar]
  double activity = 0.5;          // probability that a cylinder is active
  double noise = 0.8;             // [bar] of the pump's sensor
  double model_error = 0.0;       // [bar] true working pressure = model + error
  double outliers = 0.0;          // fraction
};

PumpSamples make_samples(const PumpCase& s, Index n, unsigned seed = 4) {
  const Index m = static_cast<Index>(s.margin.size());
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  PumpSamples out{Eigen::MatrixXd(n, m), decltype(PumpSamples::active)(n, m), VectorXd(n)};
  for (Index t = 0; t < n; ++t) {
    double pressure = s.standby;
    for (Index i = 0; i < m; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const double model = s.low[k] + (s.high[k] - s.low[k]) * uniform(random);
      out.active(t, i) = uniform(random) < s.activity;
      // The model's pressure of a cylinder at rest must not be used.
      out.working_pressure(t, i) = out.active(t, i) ? model * 1e5 : NAN;
      const double real = model + s.model_error * normal(random);
      if (out.active(t, i)) pressure = std::max(pressure, real + s.margin[k]);
    }
    pressure += s.noise * normal(random);
    if (uniform(random) < s.outliers) pressure += 20 + 150 * uniform(random);
    out.pressure[t] = pressure * 1e5;
  }
  return out;
}

TEST(LearnPump, OneCylinder) {
  const LearnedPump pump = learn_pump(make_samples({{18}, {10}, {120}}, 1500));
  EXPECT_TRUE(pump.converged);
  ASSERT_EQ(pump.margins.size(), 1u);
  EXPECT_TRUE(pump.margins[0].identified);
  // 0.8 bar noise, some 700 samples each: standard error 0.03 bar; four of them.
  EXPECT_NEAR(pump.margins[0].margin, 18e5, 0.12e5);
  EXPECT_NEAR(pump.standby, 22e5, 0.12e5);
  EXPECT_NEAR(pump.margins[0].standard_error, 0.8e5 / std::sqrt(700.0), 0.01e5);
  EXPECT_NEAR(pump.rmse, 0.8e5, 0.06e5);
  EXPECT_EQ(pump.outliers, 0);
}

TEST(LearnPump, FiveCylindersWithOutliers) {
  PumpCase setup{{12, 20, 16, 0, 25}, {20, 30, 10, 25, 15}, {150, 110, 90, 140, 100}};
  setup.outliers = 0.06;
  setup.activity = 0.35;
  const LearnedPump pump = learn_pump(make_samples(setup, 6000));
  EXPECT_TRUE(pump.converged);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(pump.margins[i].identified) << i;
    // About 700 samples each. Outliers to one side push Huber's location by 1.4 * 0.06 standard deviations
    // at most before those beyond six deviations are left out; standard error 0.03 bar.
    EXPECT_NEAR(pump.margins[i].margin, setup.margin[i] * 1e5, 0.2e5) << i;
  }
  EXPECT_NEAR(pump.standby, 22e5, 0.2e5);
  EXPECT_NEAR(pump.outliers, 360, 60);  // four deviations of a binomial count
}

TEST(LearnPump, NearTiesDoNotBiasTheMargins) {
  // Two cylinders are nearly always tied and the model has errors of 3 bar: a fit with all samples absorbs most of
  // E max = 3 / sqrt(pi) = 1.7 bar.
  PumpCase setup{{15, 15}, {60, 60}, {75, 75}};
  setup.model_error = 3.0;
  setup.activity = 0.9;
  const PumpSamples samples = make_samples(setup, 8000);
  LearnPumpOptions plain;
  plain.tie_gap_stds = 0.0;
  const double with_ties = learn_pump(samples, plain).margins[0].margin;
  const double without = learn_pump(samples).margins[0].margin;
  // A bias well above the standard error of 0.03 bar, of which leaving out ties must take off half at least.
  EXPECT_GT(with_ties, 15.3e5);
  EXPECT_LT(std::abs(without - 15e5), 0.5 * std::abs(with_ties - 15e5));
}

TEST(LearnPump, AMarginThatIsNotIdentifiedIsFlaggedAndBounded) {
  // The third cylinder works at 5-15 bar and moves only while the first holds 100 bar.
  PumpSamples samples = make_samples({{14, 18, 10}, {100, 40, 5}, {150, 90, 15}}, 3000);
  for (Index t = 0; t < 3000; ++t) {
    if (!samples.active(t, 0)) samples.active(t, 2) = false;
  }
  // It is never the leader, so the measured pressure does not contain it.
  const LearnedPump pump = learn_pump(samples);
  EXPECT_TRUE(pump.margins[0].identified);
  EXPECT_FALSE(pump.margins[2].identified);
  EXPECT_EQ(pump.margins[2].leading, 0);
  // Room is (100..150 + 14) - (5..15): at least 99 bar.
  EXPECT_GT(pump.margins[2].upper_bound, 99e5);
  EXPECT_LT(pump.margins[2].upper_bound, 115e5);
  EXPECT_NEAR(pump.margins[2].margin, 16e5, 0.2e5);  // median of 14 and 18
  ASSERT_FALSE(pump.warnings.empty());
  EXPECT_THAT(pump.warnings[0], HasSubstr("not identified"));

  // The bound limits the assumed margin where it is active.
  PumpSamples tight = make_samples({{14, 18}, {60, 56}, {60, 58}}, 2000);
  for (Index t = 0; t < 2000; ++t) {
    tight.active(t, 1) = tight.active(t, 0);
    if (!tight.active(t, 0)) continue;
    tight.pressure[t] = 74e5 + 1e3 * static_cast<double>(t % 7);  // the first is always the leader
  }
  const LearnedPump held = learn_pump(tight);
  const LearnedMargin& second = held.margins[1];
  EXPECT_LE(56e5 + second.margin, 74.1e5);
}

TEST(LearnPump, ACylinderThatNeverMovesGetsTheMedianMargin) {
  PumpSamples samples = make_samples({{14, 18}, {50, 40}, {150, 90}}, 1000);
  for (Index t = 0; t < 1000; ++t) samples.active(t, 1) = false;
  for (Index t = 0; t < 1000; ++t) {
    if (!samples.active(t, 0)) samples.pressure[t] = 22e5;
  }
  const LearnedPump pump = learn_pump(samples);
  EXPECT_FALSE(pump.margins[1].identified);
  EXPECT_EQ(pump.margins[1].active, 0);
  EXPECT_TRUE(std::isinf(pump.margins[1].upper_bound));
  EXPECT_EQ(pump.margins[1].margin, pump.margins[0].margin);
  ASSERT_FALSE(pump.warnings.empty());
  EXPECT_THAT(pump.warnings[0],
              testing::StartsWith("cylinder 2 is the load-sensing leader in 0 of 0"));
  samples.names = {"boom", "jib"};
  EXPECT_THAT(learn_pump(samples).warnings[0],
              testing::StartsWith("jib is the load-sensing leader in 0 of 0"));
}

TEST(LearnPump, WithoutSamplesAtStandbyTheDataSheetIsUsed) {
  PumpCase setup{{14}, {50}, {120}};
  setup.activity = 1.1;
  const PumpSamples samples = make_samples(setup, 800);
  LearnPumpOptions options;
  options.data_sheet_standby = 22e5;
  const LearnedPump pump = learn_pump(samples, options);
  EXPECT_FALSE(pump.standby_identified);
  EXPECT_EQ(pump.standby, 22e5);
  // 800 samples with 0.8 bar: standard error 0.03 bar; four of them.
  EXPECT_NEAR(pump.margins[0].margin, 14e5, 0.12e5);
  options.data_sheet_standby = 200e5;  // wrong, since far lower pressures were measured
  EXPECT_LT(learn_pump(samples, options).standby, 67e5);
}

TEST(LearnPump, SaturatedAndInvalidSamplesAreLeftOut) {
  PumpSamples samples = make_samples({{18}, {10}, {120}}, 1000);
  for (Index t = 0; t < 100; ++t) samples.pressure[t] = 310e5;
  samples.pressure[500] = NAN;
  LearnPumpOptions options;
  options.max_pressure = 310e5;
  const LearnedPump pump = learn_pump(samples, options);
  EXPECT_EQ(pump.saturated, 100);
  EXPECT_EQ(pump.invalid, 1);
  // 0.8 bar in some 450 active samples: standard error 0.04 bar; five of them.
  EXPECT_NEAR(pump.margins[0].margin, 18e5, 0.2e5);
  samples.active.setConstant(true);
  samples.working_pressure.setConstant(NAN);
  EXPECT_THROW(learn_pump(samples, options), InputError);
}

TEST(LearnPump, ConstantPressureIsARobustConstant) {
  VectorXd pressure(500);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (Index t = 0; t < 500; ++t)
    pressure[t] = (t % 20 == 0 ? 40e5 : 140e5) + 0.8e5 * normal(random);
  pressure[7] = NAN;
  const LearnedPump pump = learn_constant_pump(pressure);
  // 475 samples with 0.8 bar: standard error 0.04 bar; five of them.
  EXPECT_NEAR(pump.standby, 140e5, 0.2e5);
  EXPECT_EQ(pump.outliers, 25);
  EXPECT_EQ(pump.invalid, 1);
  EXPECT_TRUE(pump.margins.empty());
  EXPECT_THROW(learn_constant_pump(pressure.head(5)), InputError);
}

}  // namespace
}  // namespace sparflow
