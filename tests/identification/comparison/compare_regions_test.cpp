/// Tests of the search for regions with large errors.
#include "identification/comparison/compare_regions.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

namespace sparflow {
namespace {

/// Errors that are ten times as large where two of three signals are high, and `others` signals without a part in it.
ErrorGroup corner(int others) {
  constexpr Eigen::Index kSamples = 4000;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  ErrorGroup group;
  group.stage = group.pool = "pressure";
  group.at = "boom";
  group.squared_error.resize(kSamples);
  for (int s = 0; s < 3 + others; ++s) {
    group.signals.push_back(
        {fmt::format("s{}", s), fmt::format("signal {}", s), "", 1.0, Eigen::VectorXd(kSamples)});
    for (double& v : group.signals.back().values) v = uniform(random);
  }
  for (Eigen::Index k = 0; k < kSamples; ++k) {
    const bool high = group.signals[0].values[k] > 0.7 && group.signals[2].values[k] > 0.6;
    group.squared_error[k] = (high ? 100.0 : 1.0) * uniform(random);
  }
  return group;
}

TEST(WorstRegions, HundredsOfFurtherColumnsLeaveTheRegionAsItIs) {
  const std::vector<WorstRegion> few = worst_regions({corner(0)}, {}),
                                 many = worst_regions({corner(300)}, {});
  ASSERT_EQ(few.size(), 1U);
  ASSERT_EQ(few[0].where.size(), 2U);
  ASSERT_EQ(many.size(), 1U);
  ASSERT_EQ(many[0].where.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(many[0].where[i].key, few[0].where[i].key);
  // The edges of the region may lie on neighbouring quantiles, with a few per cent of the error between them.
  EXPECT_NEAR(many[0].share_of_error, few[0].share_of_error, 0.05);
}

}  // namespace
}  // namespace sparflow
