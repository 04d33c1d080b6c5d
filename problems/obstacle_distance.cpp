#include "problems/obstacle_distance.h"

#include <algorithm>
#include <cmath>

#include "models/math/error.h"
#include "models/math/golden_section.h"

namespace sparflow {
namespace {

using Eigen::Vector3d;

double box_distance(const Vector3d& y, const Vector3d& half) {
  const Vector3d excess = y.cwiseAbs() - half;
  const double inside = excess.maxCoeff();
  return inside <= 0.0 ? inside : excess.cwiseMax(0.0).norm();
}

/// Half the derivative of the squared distance to the box along y + s u: piecewise linear, never falling.
double squared_distance_slope(const Vector3d& y, const Vector3d& u, const Vector3d& half,
                              double s) {
  double slope = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double at = y[i] + s * u[i];
    const double excess = std::abs(at) - half[i];
    if (excess > 0.0) slope += std::copysign(excess, at) * u[i];
  }
  return slope;
}

/// Outside the box the squared distance along the segment is convex and piecewise quadratic: bracket the
/// piece in which its slope vanishes, then take the zero of that linear slope.
struct NearestOnSegment {
  double share = 0.0;     // of the segment from its first end
  double distance = 0.0;  // [m]
};
NearestOnSegment nearest_to_box(const Vector3d& y, const Vector3d& u, const Vector3d& half) {
  double lo = 0.0, hi = 1.0;
  double slope_lo = squared_distance_slope(y, u, half, lo);
  double slope_hi = squared_distance_slope(y, u, half, hi);
  double best = 0.0;
  if (slope_hi < 0.0) {
    best = 1.0;
  } else if (slope_lo < 0.0) {
    for (int i = 0; i < 3; ++i) {
      if (u[i] == 0.0) continue;
      for (const double face : {-half[i], half[i]}) {
        const double s = (face - y[i]) / u[i];
        if (!(s > lo && s < hi)) continue;
        const double slope = squared_distance_slope(y, u, half, s);
        (slope < 0.0 ? lo : hi) = s;
        (slope < 0.0 ? slope_lo : slope_hi) = slope;
      }
    }
    best = lo - slope_lo / (slope_hi - slope_lo) * (hi - lo);
  }
  const double outside = box_distance(y + best * u, half);
  if (outside > 0.0) return {best, outside};

  // The segment enters the box. The depth max_i(|y_i| - a_i) is convex along it, so golden section finds its minimum.
  const auto depth = [&](double s) { return ((y + s * u).cwiseAbs() - half).maxCoeff(); };
  constexpr int kSections = 45;  // 0.618^45: a bracket of 4e-10 of the segment
  const auto deepest = golden_section(0.0, 1.0, kSections, depth);
  if (deepest.value < outside) return {deepest.x, deepest.value};
  return {best, outside};
}

}  // namespace

double signed_distance(const Obstacle& obstacle, const Vector3d& point) {
  if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
    return box_distance(box->rotation.transpose() * (point - box->center), 0.5 * box->size);
  }
  if (const auto* sphere = std::get_if<Sphere>(&obstacle.shape)) {
    return (point - sphere->center).norm() - sphere->radius;
  }
  const auto& half_space = std::get<HalfSpace>(obstacle.shape);
  return half_space.normal.dot(point - half_space.point);
}

double segment_distance(const Obstacle& obstacle, const Vector3d& a, const Vector3d& b) {
  if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
    return nearest_to_box(box->rotation.transpose() * (a - box->center),
                          box->rotation.transpose() * (b - a), 0.5 * box->size)
        .distance;
  }
  if (const auto* sphere = std::get_if<Sphere>(&obstacle.shape)) {
    const Vector3d u = b - a;
    const double length2 = u.squaredNorm();
    const double s =
        length2 > 0.0 ? std::clamp(u.dot(sphere->center - a) / length2, 0.0, 1.0) : 0.0;
    return (a + s * u - sphere->center).norm() - sphere->radius;
  }
  return std::min(signed_distance(obstacle, a), signed_distance(obstacle, b));
}

HalfSpace separating_plane(const Obstacle& obstacle, const Vector3d& a, const Vector3d& b) {
  if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
    const Vector3d y = box->rotation.transpose() * (a - box->center);
    const Vector3d u = box->rotation.transpose() * (b - a), half = 0.5 * box->size;
    const Vector3d near = y + nearest_to_box(y, u, half).share * u;
    const Vector3d touched = near.cwiseMin(half).cwiseMax(-half);
    Vector3d normal = near - touched;
    /// Distance from which the direction of the shortest connection is known.
    /// @threshold [m] 1e-12..1e-6; numerical: rounding of coordinates of some metres
    constexpr double kApart = 1e-9;
    Vector3d on_plane = touched;
    if (normal.norm() > kApart) {
      normal.normalize();
    } else {
      Eigen::Index face = 0;
      (near.cwiseAbs() - half).maxCoeff(&face);
      normal = std::copysign(1.0, near[face]) * Vector3d::Unit(face);
      on_plane[face] = std::copysign(half[face], near[face]);
    }
    return {box->center + box->rotation * on_plane, box->rotation * normal};
  }
  if (const auto* sphere = std::get_if<Sphere>(&obstacle.shape)) {
    const Vector3d u = b - a;
    const double length2 = u.squaredNorm();
    const double s =
        length2 > 0.0 ? std::clamp(u.dot(sphere->center - a) / length2, 0.0, 1.0) : 0.0;
    const Vector3d away = a + s * u - sphere->center;
    const Vector3d normal = away.norm() > 0.0 ? Vector3d(away.normalized()) : Vector3d::UnitZ();
    return {sphere->center + sphere->radius * normal, normal};
  }
  return std::get<HalfSpace>(obstacle.shape);
}

SmoothObstacle::SmoothObstacle(const Obstacle& obstacle, double level) {
  if (const auto* box = std::get_if<Box>(&obstacle.shape)) {
    SPARFLOW_CHECK(level > 0.0, "a smooth box needs a positive level");
    shape_ = Shape::kBox;
    center_ = box->center;
    half_ = 0.5 * box->size;
    rotation_ = box->rotation;
    tau_ = level / 3.0;
    double sum = std::exp(3.0) + 2.49;
    for (int i = 0; i < 3; ++i) sum += std::exp(-2.0 * half_[i] / tau_);
    level_ = tau_ * std::log(sum);
  } else if (const auto* sphere = std::get_if<Sphere>(&obstacle.shape)) {
    shape_ = Shape::kSphere;
    center_ = sphere->center;
    level_ = sphere->radius + level;
    SPARFLOW_CHECK(level_ > 0.0, "a smooth sphere needs a positive radius");
  } else {
    const auto& half_space = std::get<HalfSpace>(obstacle.shape);
    shape_ = Shape::kHalfSpace;
    center_ = half_space.point;
    half_ = half_space.normal;
    level_ = level;
  }
}

double SmoothObstacle::value(const Vector3d& point) const {
  const Vector3d d = point - center_;
  if (shape_ == Shape::kHalfSpace) return half_.dot(d) - level_;
  if (shape_ == Shape::kSphere) return (d.squaredNorm() - level_ * level_) / (2.0 * level_);
  const Vector3d y = (rotation_.transpose() * d).cwiseAbs();
  const double top = (y - half_).maxCoeff();
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    sum += std::exp((y[i] - half_[i] - top) / tau_) + std::exp((-y[i] - half_[i] - top) / tau_);
  }
  return top + tau_ * std::log(sum) - level_;
}

double SmoothObstacle::derivatives(const Vector3d& point, Vector3d* gradient,
                                   Eigen::Matrix3d* hessian) const {
  const Vector3d d = point - center_;
  if (shape_ == Shape::kHalfSpace) {
    *gradient = half_;
    hessian->setZero();
    return half_.dot(d) - level_;
  }
  if (shape_ == Shape::kSphere) {
    *gradient = d / level_;
    *hessian = Eigen::Matrix3d::Identity() / level_;
    return (d.squaredNorm() - level_ * level_) / (2.0 * level_);
  }
  const Vector3d y = rotation_.transpose() * d;
  const double top = (y.cwiseAbs() - half_).maxCoeff();
  Vector3d weight, total;  // softmax weights of the two faces of each axis: difference and sum
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double front = std::exp((y[i] - half_[i] - top) / tau_);
    const double back = std::exp((-y[i] - half_[i] - top) / tau_);
    weight[i] = front - back;
    total[i] = front + back;
    sum += total[i];
  }
  weight /= sum;
  total /= sum;
  Eigen::Matrix3d local = -weight * weight.transpose() / tau_;
  local.diagonal() += total / tau_;
  *gradient = rotation_ * weight;
  *hessian = rotation_ * local * rotation_.transpose();
  return top + tau_ * std::log(sum) - level_;
}

}  // namespace sparflow
