#include "apps/report/charts/decimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

bool contains(const std::vector<Index>& rows, Index row) {
  return std::binary_search(rows.begin(), rows.end(), row);
}

TEST(DecimateRows, KeepsAllOfFewRows) {
  const VectorXd y = VectorXd::Random(50);
  const auto rows = decimate_rows({&y}, 50);
  ASSERT_EQ(rows.size(), 50u);
  for (Index i = 0; i < 50; ++i) EXPECT_EQ(rows[static_cast<std::size_t>(i)], i);
}

TEST(DecimateRows, KeepsEverySpikeOfEveryColumn) {
  const Index n = 100000;
  VectorXd a = VectorXd::Zero(n), b = VectorXd::Zero(n);
  a[12345] = 9.0;
  b[77777] = -4.0;
  b[99998] = 2.0;
  const auto rows = decimate_rows({&a, &b}, 400);
  EXPECT_LE(rows.size(), 402u);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end()));
  for (const Index i : {Index{0}, Index{12345}, Index{77777}, Index{99998}, n - 1}) {
    EXPECT_TRUE(contains(rows, i)) << i;
  }
}

TEST(DecimateRows, KeepsAShortGap) {
  VectorXd y = VectorXd::LinSpaced(10000, 0, 1);
  y.segment(5000, 3).setConstant(kNaN);
  const auto rows = decimate_rows({&y}, 200);
  EXPECT_TRUE(contains(rows, 5000));
}

TEST(DecimateRows, AcceptsEmptyAndAllNaNColumns) {
  const VectorXd nothing(0), gaps = VectorXd::Constant(1000, kNaN);
  EXPECT_TRUE(decimate_rows({}, 10).empty());
  EXPECT_TRUE(decimate_rows({&nothing}, 10).empty());
  EXPECT_LE(decimate_rows({&gaps}, 10).size(), 12u);
}

TEST(DecimateCloud, KeepsTheOutlierAndThinsTheCluster) {
  VectorXd x = VectorXd::Random(50000), y = VectorXd::Random(50000);
  x[31000] = 10.0;
  y[31000] = -10.0;
  x[5] = kNaN;
  const auto points = decimate_cloud(x, y, 2000);
  EXPECT_LE(points.size(), 2000u);
  EXPECT_GE(points.size(),
            700u);  // one coarsening of the grid removes at most two thirds of the cells
  EXPECT_TRUE(contains(points, 31000));
  EXPECT_FALSE(contains(points, 5));
}

TEST(DecimateCloud, KeepsOneOfCoincidingPoints) {
  const VectorXd same = VectorXd::Ones(5000);
  EXPECT_EQ(decimate_cloud(same, same, 100).size(), 1u);
  EXPECT_TRUE(decimate_cloud(VectorXd(0), VectorXd(0), 100).empty());
}

TEST(BinnedMedian, FollowsAStepAndIgnoresOutliers) {
  const Index n = 4000;
  const VectorXd x = VectorXd::LinSpaced(n, -1.0, 1.0);
  VectorXd y = x.unaryExpr([](double v) { return v > 0 ? 3.0 : -3.0; });
  for (Index i = 0; i < n; i += 10) y[i] = 1e6;
  const BinnedMedian trend = binned_median(x, y, 24);
  ASSERT_EQ(trend.x.size(), 24);
  for (Index i = 0; i < 24; ++i) EXPECT_EQ(trend.y[i], trend.x[i] > 0 ? 3.0 : -3.0);
  EXPECT_EQ(binned_median(x.head(39), y.head(39), 24).x.size(), 0);
}

TEST(BinnedMedian, HasNoLineAcrossAGapInTheData) {
  // There are no points between -1 and 1; a step there must not be drawn as a slope.
  Eigen::VectorXd x(400), y(400);
  for (Eigen::Index i = 0; i < 400; ++i) {
    x[i] = i < 200 ? -6.0 + 0.025 * static_cast<double>(i)
                   : 1.0 + 0.025 * static_cast<double>(i - 200);
    y[i] = x[i] < 0.0 ? -3.0 : 3.0;
  }
  const BinnedMedian median = binned_median(x, y, 24);
  int breaks = 0;
  for (Eigen::Index i = 0; i < median.x.size(); ++i) {
    if (std::isnan(median.y[i])) {
      ++breaks;
      EXPECT_GT(median.x[i], -1.0);
      EXPECT_LT(median.x[i], 1.0);
    } else {
      EXPECT_EQ(median.y[i], median.x[i] < 0.0 ? -3.0 : 3.0) << "no bin holds both sides";
    }
  }
  EXPECT_EQ(breaks, 1);
}

}  // namespace
}  // namespace sparflow
