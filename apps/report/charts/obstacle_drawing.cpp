#include "apps/report/charts/obstacle_drawing.h"

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// [m] Half-spaces are unbounded; drawings show at most this much of one.
constexpr double kFarAway = 100.0;

/// Points of a convex outline in order around it.
std::vector<Vector2d> ordered_outline(std::vector<Vector2d> points) {
  // The section is convex, so ordering its points by their angle about its centre gives the outline.
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& p : points) middle += p / static_cast<double>(points.size());
  std::sort(points.begin(), points.end(), [&](const Vector2d& a, const Vector2d& b) {
    return std::atan2(a.y() - middle.y(), a.x() - middle.x()) <
           std::atan2(b.y() - middle.y(), b.x() - middle.x());
  });
  return points;
}

/// Corner of a box; corners are numbered by bits, so that an edge joins two that differ in one bit.
Vector3d corner(const Box& box, int c) {
  const Vector3d sign((c & 1) != 0 ? 0.5 : -0.5, (c & 2) != 0 ? 0.5 : -0.5,
                      (c & 4) != 0 ? 0.5 : -0.5);
  return box.center + box.rotation * box.size.cwiseProduct(sign);
}

/// Convex hull by Andrew's monotone chain.
std::vector<Vector2d> hull(std::vector<Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  const auto turns_left = [](const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    const Vector2d u = b - a, v = c - a;
    return u.x() * v.y() - u.y() * v.x() > 0.0;
  };
  std::vector<Vector2d> outline;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = outline.size();
    for (const Vector2d& p : points) {
      while (outline.size() >= first + 2 &&
             !turns_left(outline[outline.size() - 2], outline.back(), p))
        outline.pop_back();
      outline.push_back(p);
    }
    outline.pop_back();  // the other side begins with it
    std::reverse(points.begin(), points.end());
  }
  return outline;
}

std::vector<Vector2d> cut(const Box& box, const DrawingPlane& plane) {
  Vector3d corners[8];
  double height[8];
  for (int c = 0; c < 8; ++c) {
    corners[c] = corner(box, c);
    height[c] = plane.normal().dot(corners[c] - plane.origin);
  }
  std::vector<Vector2d> points;
  for (int c = 0; c < 8; ++c) {
    for (const int bit : {1, 2, 4}) {
      const int d = c | bit;
      if (d == c || height[c] == height[d] || height[c] * height[d] > 0.0) continue;
      const double share = height[c] / (height[c] - height[d]);
      points.push_back(plane.project(corners[c] + share * (corners[d] - corners[c])));
    }
  }
  if (points.empty()) return points;
  return ordered_outline(std::move(points));
}
std::vector<Vector2d> cut(const HalfSpace& solid, const DrawingPlane& plane) {
  const Vector2d normal(solid.normal.dot(plane.horizontal), solid.normal.dot(plane.up));
  const double length = normal.norm();
  if (length < 1e-9) return {};  // The half-space's border is parallel to the drawing.
  const Vector2d out = normal / length, along(-out.y(), out.x());
  // The point of the border nearest to the plane's origin.
  const Vector2d at = out * (solid.normal.dot(solid.point - plane.origin) / length);
  return {at - kFarAway * along, at + kFarAway * along, at + kFarAway * (along - out),
          at - kFarAway * (along + out)};
}

}  // namespace

std::vector<DrawingObstacle> cut_obstacles(const std::vector<Obstacle>& obstacles,
                                           const DrawingPlane& plane) {
  std::vector<DrawingObstacle> shapes;
  for (const Obstacle& obstacle : obstacles) {
    DrawingObstacle shape;
    shape.name = obstacle.name;
    if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
      shape.points = cut(*box, plane);
    } else if (const auto* solid = std::get_if<HalfSpace>(&obstacle.shape)) {
      shape.points = cut(*solid, plane);
    } else {
      const auto& sphere = std::get<Sphere>(obstacle.shape);
      const double off = plane.normal().dot(sphere.center - plane.origin);
      if (std::abs(off) < sphere.radius) {
        shape.points = {plane.project(sphere.center)};
        shape.radius = std::sqrt(sphere.radius * sphere.radius - off * off);
      }
    }
    if (!shape.points.empty()) shapes.push_back(std::move(shape));
  }
  return shapes;
}

std::vector<std::string> obstacles_beside(const std::vector<Obstacle>& obstacles,
                                          const DrawingPlane& plane) {
  std::vector<std::string> names;
  for (const Obstacle& obstacle : obstacles) {
    if (cut_obstacles({obstacle}, plane).empty()) names.push_back(obstacle.name);
  }
  return names;
}

std::vector<DrawingObstacle> outline_obstacles(const std::vector<Obstacle>& obstacles,
                                               const DrawingPlane& plane) {
  std::vector<DrawingObstacle> shapes;
  for (const Obstacle& obstacle : obstacles) {
    DrawingObstacle shape;
    shape.name = obstacle.name;
    if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
      for (int c = 0; c < 8; ++c) shape.points.push_back(plane.project(corner(*box, c)));
      shape.points = hull(std::move(shape.points));
    } else if (const auto* solid = std::get_if<HalfSpace>(&obstacle.shape)) {
      shape.points = cut(*solid, plane);
    } else {
      const auto& sphere = std::get<Sphere>(obstacle.shape);
      shape.points = {plane.project(sphere.center)};
      shape.radius = sphere.radius;
    }
    if (!shape.points.empty()) shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace sparflow
