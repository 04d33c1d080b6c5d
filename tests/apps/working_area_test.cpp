#include "apps/report/charts/working_area.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace sparflow {
namespace {

using Eigen::Vector2d;

TEST(WorkingArea, EachCellHoldsTheRmsOfItsSamples) {
  // The area is 4 m wide, so 40 cells are 0.1 m each; three samples in one cell, four in another, two in a third.
  const std::vector<Vector2d> tip = {{0.01, 0.01}, {0.02, 0.02}, {0.03, 0.01},
                                     {3.95, 1.05}, {3.96, 1.05}, {3.97, 1.05},
                                     {3.98, 1.05}, {2.05, 0.55}, {2.05, 0.56}};
  Eigen::VectorXd residual(9);
  residual << 3, 4, 5, -2, 2, -2, 2, 9, 9;
  const HeatMap map = rms_over_working_area(tip, residual, 40, 3);
  EXPECT_EQ(map.values.cols(), 40);
  EXPECT_EQ(map.values.rows(), 11);
  EXPECT_NEAR(map.x_edges[1] - map.x_edges[0], 0.1, 1e-12);
  EXPECT_NEAR(map.values(0, 0), std::sqrt(50.0 / 3.0), 1e-12);
  EXPECT_NEAR(map.values(10, 39), 2.0, 1e-12);
  EXPECT_TRUE(std::isnan(map.values(5, 20)));  // fewer samples than least_samples
  EXPECT_EQ(map.counts(5, 20), 2.0);
  EXPECT_EQ(map.counts.sum(), 9.0);
}

TEST(WorkingArea, LeavesOutNaNAndMakesOneCellOfOnePosture) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vector2d> tip = {{-1.23, 2}, {-1.23, 2}, {nan, 2}, {-1.23, 2}};
  const HeatMap map = rms_over_working_area(tip, Eigen::Vector4d(1, nan, 1, 1), 40, 2);
  ASSERT_EQ(map.values.size(), 1);
  EXPECT_EQ(map.counts(0, 0), 2.0);
  EXPECT_EQ(map.values(0, 0), 1.0);
  EXPECT_EQ(rms_over_working_area({}, Eigen::VectorXd(0)).values.size(), 0);
}

}  // namespace
}  // namespace sparflow
