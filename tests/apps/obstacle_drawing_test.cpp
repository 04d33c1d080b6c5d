#include "apps/report/charts/obstacle_drawing.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sparflow {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double area(const std::vector<Vector2d>& p) {
  double sum = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vector2d& a = p[i];
    const Vector2d& b = p[(i + 1) % p.size()];
    sum += 0.5 * (a.x() * b.y() - b.x() * a.y());
  }
  return std::abs(sum);
}

TEST(CutObstacles, CutsBoxesInTheirSection) {
  Box upright{{4, 0.2, 1}, {2, 1, 3}, Eigen::Matrix3d::Identity()};
  Box beside{{4, 5, 1}, {2, 1, 3}, Eigen::Matrix3d::Identity()};
  Box turned =
      upright;  // a quarter of a right angle about z: the section's width is size_y / sin 45 or less
  turned.center.y() = 0.0;
  turned.rotation = Eigen::AngleAxisd(std::atan(1.0), Vector3d::UnitZ()).toRotationMatrix();
  const auto shapes = cut_obstacles({{"a", upright}, {"b", beside}, {"c", turned}}, DrawingPlane{});
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].name, "a");
  EXPECT_EQ(shapes[0].points.size(), 4u);
  EXPECT_NEAR(area(shapes[0].points), 6.0, 1e-12);
  EXPECT_EQ(shapes[1].name, "c");
  // Through the middle at 45 degrees, a 2 x 1 rectangle is sqrt(2) wide.
  EXPECT_NEAR(area(shapes[1].points), 3.0 * std::sqrt(2.0), 1e-12);
}

TEST(CutObstacles, CutsSpheresInACircle) {
  const auto shapes = cut_obstacles(
      {{"near", Sphere{{3, 0.3, 1}, 0.5}}, {"far", Sphere{{3, 0.6, 1}, 0.5}}}, DrawingPlane{});
  ASSERT_EQ(shapes.size(), 1u);
  EXPECT_NEAR(shapes[0].radius, 0.4, 1e-12);  // 3-4-5
  EXPECT_NEAR((shapes[0].points[0] - Vector2d(3, 1)).norm(), 0.0, 1e-12);
}

TEST(CutObstacles, DrawsHalfSpacesOnTheirSolidSide) {
  const HalfSpace ground{{0, 0, -0.5}, Vector3d::UnitZ()};
  const HalfSpace parallel{{0, 1, 0}, Vector3d::UnitY()};
  const auto shapes = cut_obstacles({{"ground", ground}, {"side", parallel}}, DrawingPlane{});
  ASSERT_EQ(shapes.size(), 1u);
  double top = -1e9;
  for (const Vector2d& p : shapes[0].points) top = std::max(top, p.y());
  EXPECT_NEAR(top, -0.5, 1e-12);
  EXPECT_NEAR(area(shapes[0].points), 200.0 * 100.0, 1e-6);
}

TEST(OutlineObstacles, SeenFromAboveNothingIsLeftOutAndBesideIsNamed) {
  const Box crate{{4, 5, 1}, {2, 1, 3}, Eigen::Matrix3d::Identity()};
  const std::vector<Obstacle> all = {{"crate", crate}, {"ball", Sphere{{1, -3, 2}, 0.5}}};
  EXPECT_EQ(obstacles_beside(all, DrawingPlane{}), (std::vector<std::string>{"crate", "ball"}));
  DrawingPlane top;
  top.up = Vector3d::UnitY();
  const auto shapes = outline_obstacles(all, top);
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].points.size(), 4u) << "eight corners, four on the outline";
  EXPECT_NEAR(area(shapes[0].points), 2.0, 1e-12);
  EXPECT_EQ(shapes[1].points[0], Vector2d(1, -3));
  EXPECT_EQ(shapes[1].radius, 0.5);
}

}  // namespace
}  // namespace sparflow
