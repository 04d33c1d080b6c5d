#include "problems/obstacle_file.h"

#include <fmt/format.h>

#include "models/files/file_quantities.h"

namespace sparflow {
namespace {

using namespace quantities;

constexpr Quantity kPoint{"coordinate", "m", Sign::kAny, 1.0, 1000.0};
constexpr Quantity kSize{"size", "m", Sign::kPositive, 1.0, 1000.0};
constexpr Quantity kRadius{"radius", "m", Sign::kPositive, 1.0, 1000.0};
constexpr Quantity kComponent{"component", ""};

}  // namespace

Obstacle read_obstacle(const YamlValue& value, int number) {
  const std::string expected =
      "an obstacle {box: {center, size}}, {sphere: {center, radius}} or {half_space: {point, "
      "normal}}";
  const YamlMap map = value.map(expected, {"name", "box", "sphere", "half_space"});
  const int kinds = map.has("box") + map.has("sphere") + map.has("half_space");
  if (kinds != 1) {
    map.fail(fmt::format("got {} shapes, expected {}", kinds, expected));
  }
  Obstacle obstacle;
  if (const auto v = map.find("box")) {
    obstacle.name = fmt::format("box {}", number);
    const YamlMap box = v->map("a box {center, size, rpy}", {"center", "size", "rpy"});
    Box shape;
    shape.center = box.need("center", "its centre [x, y, z] [m]").vector3(kPoint);
    shape.size = box.need("size", "its edge lengths [x, y, z] [m]").vector3(kSize);
    if (const auto rpy = box.find("rpy")) {
      shape.rotation = rotation_from_rpy(rpy->vector3(kAngle));
    }
    obstacle.shape = shape;
  } else if (const auto s = map.find("sphere")) {
    obstacle.name = fmt::format("sphere {}", number);
    const YamlMap sphere = s->map("a sphere {center, radius}", {"center", "radius"});
    obstacle.shape = Sphere{sphere.need("center", "its centre [x, y, z] [m]").vector3(kPoint),
                            sphere.need_number("radius", kRadius)};
  } else {
    obstacle.name = fmt::format("half-space {}", number);
    const YamlMap half =
        map.find("half_space")->map("a half-space {point, normal}", {"point", "normal"});
    const YamlValue normal = half.need("normal", "the direction [x, y, z] into the free side");
    const Eigen::Vector3d n = normal.vector3(kComponent);
    if (n.norm() < 1e-9) normal.fail("got [0, 0, 0], expected a direction such as [0, 0, 1]");
    obstacle.shape = HalfSpace{
        half.need("point", "a point of its surface [x, y, z] [m]").vector3(kPoint), n.normalized()};
  }
  if (const auto name = map.find("name")) obstacle.name = name->text("the obstacle's name");
  return obstacle;
}

}  // namespace sparflow
