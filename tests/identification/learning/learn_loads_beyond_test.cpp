// A pressure model that was learned on one branch extrapolates correctly to the other by the balance of forces.
#include "identification/learning/learn_loads_beyond.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sparflow {
namespace {

constexpr double kBarSeen = 1e5;

/// Bore 120, rod 80 mm; return line of some bar, counterbalance valve at 40 bar, lower when moving with the load.
class LearnLoadsBeyond : public ::testing::TestWithParam<int> {
 protected:
  LearnLoadsBeyond() {
    cylinder_.bore = 0.12;
    cylinder_.rod = 0.08;
  }
  static int side() { return GetParam(); }
  double supply() const { return side() > 0 ? cylinder_.area_piston() : cylinder_.area_rod(); }
  double other() const { return side() > 0 ? cylinder_.area_rod() : cylinder_.area_piston(); }
  double truth(double flow, double load) const {
    const double line = 4 * kBarSeen + 1.5e12 * flow * flow;
    const double branch = (load + other() * line) / supply();
    return std::max({branch, 40 * kBarSeen + 0.2 * load / supply(), 2.5 * kBarSeen});
  }
  /// @return pressure model learned from loads between these, as pressures of the supply [Pa]
  GaussianProcess learned(double lightest, double heaviest) const {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform;
    std::normal_distribution<double> noise(0.0, 0.8 * kBarSeen);
    constexpr Eigen::Index n = 800;
    GpDataset set{"", Eigen::ArrayXd(n), Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
    for (Eigen::Index k = 0; k < n; ++k) {
      const double load = supply() * (lightest + (heaviest - lightest) * uniform(random));
      set.flow[k] = 1e-4 + 5e-4 * uniform(random);
      set.force[k] = side() * load;
      set.pressure[k] = truth(set.flow[k], load) + noise(random);
    }
    GpParameters p = learn_gp(set.flow, set.force, set.pressure).parameters;
    p.beyond = learn_loads_beyond(p, set, cylinder_, side());
    return GaussianProcess(p);
  }
  /// @return largest error [Pa] at these loads, as pressures of the supply [Pa]
  double worst(const GaussianProcess& process, std::initializer_list<double> loads) const {
    double error = 0.0;
    for (const double flow : {2e-4, 5e-4}) {
      for (const double p : loads) {
        const double load = p * supply();
        error = std::max(error, std::abs(process.mean(flow, side() * load) - truth(flow, load)));
      }
    }
    return error;
  }

  Cylinder cylinder_;
};

TEST_P(LearnLoadsBeyond, ExtrapolatesFromTheValveToTheStaticBranch) {
  const GaussianProcess process = learned(-80 * kBarSeen, 10 * kBarSeen);
  GpParameters line = process.parameters();
  line.beyond = {};
  const auto heavier = {60 * kBarSeen, 100 * kBarSeen, 150 * kBarSeen};
  // The valve's samples do not determine the return line's pressure at these flows; the error scales with the area ratio.
  const double line_unknown = 3 * kBarSeen * other() / supply();
  EXPECT_LT(worst(process, heavier), line_unknown + 4 * kBarSeen);
  EXPECT_GT(worst(GaussianProcess(line), heavier), 50 * kBarSeen);
}

TEST_P(LearnLoadsBeyond, ContinuesBothBranches) {
  const GaussianProcess process = learned(-80 * kBarSeen, 120 * kBarSeen);
  // Slopes from 800 samples with 0.8 bar, continued by up to 130 bar: 5 bar are 4 % of that way.
  EXPECT_LT(worst(process, {150 * kBarSeen, 250 * kBarSeen}), 5 * kBarSeen);
  EXPECT_LT(worst(process, {-120 * kBarSeen, -180 * kBarSeen}), 5 * kBarSeen);
  EXPECT_LT(worst(process, {-400 * kBarSeen}), 5 * kBarSeen);  // the tank
}

TEST_P(LearnLoadsBeyond, WithOneLoadAddsTheBalanceOfForcesToTheLawOfTheFlow) {
  // A slewing cylinder on level ground has no load until friction is added; the law of the flow must remain.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> noise(0.0, 0.8 * kBarSeen);
  constexpr Eigen::Index n = 400;
  GpDataset set{"", Eigen::ArrayXd(n), Eigen::ArrayXd::Zero(n), Eigen::ArrayXd(n)};
  const auto line = [](double flow) { return 5 * kBarSeen + 2e12 * flow * flow; };
  for (Eigen::Index k = 0; k < n; ++k) {
    set.flow[k] = 1e-4 + 5e-4 * uniform(random);
    set.pressure[k] = line(set.flow[k]) + noise(random);
  }
  const std::optional<SimilarLoads> loads = similar_loads(set, cylinder_, side());
  ASSERT_TRUE(loads);
  const GpDataset at_one = at_one_load(set, *loads);
  const GpParameters fitted = learn_gp(at_one.flow, at_one.force, at_one.pressure).parameters;
  GpParameters p = for_any_load(fitted, *loads, set);
  p.beyond = learn_loads_beyond(p, set, cylinder_, side());
  const GaussianProcess process(p);
  const double unsure = std::sqrt(GaussianProcess(fitted).variance(3e-4, 0.0));
  for (const double flow : {2e-4, 5.5e-4}) {
    // A little more than the noise of one sample; with a load, 5 % of it are added.
    EXPECT_NEAR(process.mean(flow, 0.0), line(flow), kBarSeen);
    for (const double load : {3.0, 8.0, 30.0}) {
      const double force = side() * load * kBarSeen * supply();
      EXPECT_NEAR(process.mean(flow, force), line(flow) + load * kBarSeen,
                  0.05 * load * kBarSeen + kBarSeen)
          << load;
      EXPECT_GT(std::sqrt(process.variance(flow, force)), unsure + 0.05 * load * kBarSeen);
    }
  }
  set.force = Eigen::ArrayXd::LinSpaced(n, 0.0, 10 * kBarSeen * supply());
  EXPECT_FALSE(similar_loads(set, cylinder_, side())) << "these loads determine a slope";
}

TEST_P(LearnLoadsBeyond, WithSimilarLoadsIsNoSteeperThanTheBalanceOfForces) {
  // Friction that grows along a stroke, as on the real crane's jib, is correlated with the load but no slope over it.
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> noise(0.0, 0.5 * kBarSeen);
  constexpr Eigen::Index n = 900;
  for (const double span : {2.0, 3.6, 6.4}) {
    for (const double steep : {2.5, -3.6}) {
      GpDataset set{"", Eigen::ArrayXd(n), Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
      for (Eigen::Index k = 0; k < n; ++k) {
        const double load = (14.0 + span * uniform(random)) * kBarSeen;
        set.flow[k] = 1e-4 + 2e-4 * uniform(random);
        set.force[k] = side() * load * supply();
        set.pressure[k] =
            65 * kBarSeen + 2e10 * set.flow[k] + steep * (load - 14 * kBarSeen) + noise(random);
      }
      const std::optional<SimilarLoads> loads = similar_loads(set, cylinder_, side());
      ASSERT_TRUE(loads) << span;
      EXPECT_GE(side() * loads->slope * supply(), 0.0) << span << " " << steep;
      EXPECT_LE(side() * loads->slope * supply(), 1.0) << span << " " << steep;
    }
  }
}

TEST_P(LearnLoadsBeyond, WithSimilarLoadsUsesTheSlopeOfTheSamples) {
  // By the level alone, a valve's pressure 25 bar above the load would have slope 0.
  constexpr double kShare = 0.5;
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> noise(0.0, 0.5 * kBarSeen);
  constexpr Eigen::Index n = 900;
  double wrong_before = kShare, unsure_before = 1.0;
  for (const double span : {1.0, 3.0, 7.5}) {
    GpDataset set{"", Eigen::ArrayXd(n), Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
    for (Eigen::Index k = 0; k < n; ++k) {
      const double load = (10.0 + span * uniform(random)) * kBarSeen;
      set.flow[k] = 1e-4 + 2e-4 * uniform(random);
      set.force[k] = side() * load * supply();
      set.pressure[k] = 30 * kBarSeen + 3e10 * set.flow[k] + kShare * load + noise(random);
    }
    const std::optional<SimilarLoads> loads = similar_loads(set, cylinder_, side());
    ASSERT_TRUE(loads) << span;
    const double wrong = kShare - side() * loads->slope * supply();
    const double unsure = loads->slope_deviation * supply();
    EXPECT_LT(wrong, wrong_before) << "the slope is better determined in " << span << " bar";
    EXPECT_LT(unsure, unsure_before) << span;
    wrong_before = wrong;
    unsure_before = unsure;
  }
  // 0.5 bar of noise on 900 samples over 7.5 bar give the slope to 0.01; the prior of the level draws it away.
  EXPECT_NEAR(wrong_before, 0.0, 0.15);
}

TEST_P(LearnLoadsBeyond, WithSimilarLoadsWithoutNoiseIsTheirSlope) {
  constexpr double kShare = 0.3;
  constexpr Eigen::Index n = 50;
  GpDataset set{"", Eigen::ArrayXd::Constant(n, 2e-4), Eigen::ArrayXd(n), Eigen::ArrayXd(n)};
  const Eigen::ArrayXd load = Eigen::ArrayXd::LinSpaced(n, 10 * kBarSeen, 15 * kBarSeen);
  set.force = side() * supply() * load;
  set.pressure = 40 * kBarSeen + kShare * load;
  std::optional<SimilarLoads> loads = similar_loads(set, cylinder_, side());
  ASSERT_TRUE(loads);
  // Without noise the prior has hardly any weight.
  EXPECT_NEAR(side() * loads->slope * supply(), kShare, 1e-3);
  set.pressure.setZero();
  loads = similar_loads(set, cylinder_, side());
  ASSERT_TRUE(loads);
  EXPECT_NEAR(side() * loads->slope * supply(), 0.0, 1e-3) << "no residual";
}

INSTANTIATE_TEST_SUITE_P(BothSides, LearnLoadsBeyond, ::testing::Values(1, -1));

}  // namespace
}  // namespace sparflow
