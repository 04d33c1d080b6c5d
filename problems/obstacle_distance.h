#pragma once
/// Distances to obstacles [m], base frame: exact ones for checking, smooth ones for optimising.
#include <Eigen/Dense>

#include "problems/problem.h"

namespace sparflow {

/// Exact signed distance of a point; inside it is minus the depth below the nearest face.
double signed_distance(const Obstacle& obstacle, const Eigen::Vector3d& point);

/// Least signed distance over the segment from `a` to `b`: exact outside; inside a box it is the depth of the deepest
/// point, to 1e-9 of the segment's length.
double segment_distance(const Obstacle& obstacle, const Eigen::Vector3d& a,
                        const Eigen::Vector3d& b);

/// Half-space that holds an obstacle and whose free side is as far from it as the segment from `a` to `b` is: its plane touches
/// the obstacle in the point nearest to the segment, at a right angle to the shortest connection. The obstacle is convex, so
/// a segment with both ends at least d in front of the plane is at least d away from the obstacle. Where the segment is inside
/// a box, the plane is the face nearest to its deepest point.
HalfSpace separating_plane(const Obstacle& obstacle, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b);

/// A function of a point, twice differentiable everywhere (also inside), convex, and such that
/// value(p) >= 0 implies signed_distance(p) >= level. In metres: its gradient is about 1 near level.
///
/// * half-space: n.(p - p0) - level, exact.
/// * sphere: (|p-c|^2 - D^2) / 2D with D = radius + level; zero exactly at the level.
/// * box, with y the point in box axes, a half the edges, tau = level / 3:
///     tau log sum_i (exp((y_i - a_i)/tau) + exp((-y_i - a_i)/tau)) - lambda,
///     lambda = tau log(e^3 + 2.49 + sum_i exp(-2 a_i/tau)).
///   Log-sum-exp is convex, so its largest value on the level body (box + ball) lies on the corners'
///   spheres, where with v_i = (u_i/level)^2 and sum v_i = 1 the sum is at most
///   sum_i exp(3 sqrt v_i) + sum_i exp(-2 a_i/tau). The chord 1 + (e^3 - 1) v lies at most 0.1607 below
///   exp(3 sqrt v) on [0, 1], hence sum_i exp(3 sqrt v_i) <= e^3 + 2 + 3 * 0.1607. lambda is therefore no
///   less than the largest value inside the level, which proves the implication.
///   Bias (how much further than `level` the zero lies): 4 % of level over a large face, at most 15 % at
///   edges and 17 % at corners; up to 10 % where the box is thinner than tau.
class SmoothObstacle {
 public:
  /// @param level [m] > 0 for boxes
  SmoothObstacle(const Obstacle& obstacle, double level);
  double value(const Eigen::Vector3d& point) const;
  /// Value; writes gradient [3] and Hessian [3 x 3].
  double derivatives(const Eigen::Vector3d& point, Eigen::Vector3d* gradient,
                     Eigen::Matrix3d* hessian) const;

 private:
  enum class Shape { kBox, kSphere, kHalfSpace };
  Shape shape_ = Shape::kBox;
  Eigen::Vector3d center_;    ///< box or sphere centre, half-space point
  Eigen::Vector3d half_;      ///< box: half edges; half-space: normal
  Eigen::Matrix3d rotation_;  ///< box axes
  double level_ = 0.0;        ///< level of a half-space, D of a sphere, lambda of a box
  double tau_ = 1.0;
};

}  // namespace sparflow
