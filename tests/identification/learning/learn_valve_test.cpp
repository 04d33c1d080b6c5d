#include "identification/learning/learn_valve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using testing::HasSubstr;

constexpr double kValveGain = 100.0 / 60000.0;  // 100 l/min

struct ValveData {
  VectorXd command, flow;
};

ValveData make_data(Index n, double dead_band, double outliers) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  ValveData d{VectorXd(n), VectorXd(n)};
  for (Index i = 0; i < n; ++i) {
    const double u = uniform(random);
    d.command[i] = -u;  // retracting: only the magnitude counts
    d.flow[i] = kValveGain * std::max(0.0, u - dead_band) + 0.01 * kValveGain * normal(random);
    if (uniform(random) < outliers) d.flow[i] = kValveGain * uniform(random);
  }
  return d;
}

TEST(LearnValve, RecoversTheGainThroughZero) {
  const ValveData d = make_data(1000, 0.0, 0.0);
  const LearnedValve valve = learn_valve(d.command, d.flow);
  // Standard error 0.01 / sqrt(1000 * mean u^2 = 333) = 0.0005 of the gain; four of them.
  EXPECT_NEAR(valve.gain / kValveGain, 1.0, 0.0022);
  EXPECT_NEAR(valve.gain_standard_error / kValveGain, 5.5e-4, 1e-4);
  EXPECT_GT(valve.r2, 0.998);  // noise 0.01 against a spread of 0.29
  EXPECT_NEAR(valve.rmse / kValveGain, 0.01, 0.001);
  EXPECT_NEAR(valve.dead_band, 0.0, 0.004);
  EXPECT_TRUE(valve.warnings.empty());
}

TEST(LearnValve, IsRobustToOutliers) {
  const ValveData d = make_data(1000, 0.0, 0.1);
  const LearnedValve valve = learn_valve(d.command, d.flow);
  // Huber's influence: 10 % outliers move it by at most 1.4 * 0.1 noise deviations = 0.2 % of the gain.
  EXPECT_NEAR(valve.gain / kValveGain, 1.0, 0.006);
}

TEST(LearnValve, ReportsADeadBandWithoutModellingIt) {
  const ValveData d = make_data(1000, 0.0, 0.0);
  ValveData shifted = d;
  for (Index i = 0; i < 1000; ++i) {  // moving samples only, as in `learn_valves`
    shifted.command[i] = -(0.08 + 0.92 * std::abs(d.command[i]));
    shifted.flow[i] = kValveGain * (std::abs(shifted.command[i]) - 0.08) +
                      (d.flow[i] - kValveGain * std::abs(d.command[i]));
  }
  const LearnedValve valve = learn_valve(shifted.command, shifted.flow);
  EXPECT_TRUE(valve.affine);
  // A twentieth of the dead band; the gain to 0.6 % as in IsRobustToOutliers.
  EXPECT_NEAR(valve.dead_band, 0.08, 0.004);
  EXPECT_NEAR(valve.affine_gain / kValveGain, 1.0, 0.006);
  EXPECT_LT(valve.gain, kValveGain);
  EXPECT_GT(valve.affine_r2, valve.r2);
  ASSERT_EQ(valve.warnings.size(), 1u);
  EXPECT_THAT(valve.warnings[0], HasSubstr("dead band of 0.08"));
}

TEST(LearnValve, AcceptsExactDataAndAConstantCommand) {
  const VectorXd u = VectorXd::LinSpaced(50, 0.1, 1.0);
  const LearnedValve exact = learn_valve(u, kValveGain * u);
  EXPECT_NEAR(exact.gain / kValveGain, 1.0, 1e-12);  // rounding
  EXPECT_NEAR(exact.r2, 1.0, 1e-12);
  const VectorXd constant = VectorXd::Constant(50, 0.5);
  const LearnedValve one = learn_valve(constant, kValveGain * constant);
  EXPECT_NEAR(one.gain / kValveGain, 1.0, 1e-12);
  EXPECT_FALSE(one.affine);
}

TEST(LearnValve, LeavesOutUnusableSamples) {
  ValveData d = make_data(30, 0.0, 0.0);
  d.command.head(10).setZero();
  d.flow[15] = NAN;
  EXPECT_EQ(learn_valve(d.command, d.flow).used, 19);
  d.command.head(25).setZero();
  EXPECT_THROW(learn_valve(d.command, d.flow), InputError);
}

}  // namespace
}  // namespace sparflow
