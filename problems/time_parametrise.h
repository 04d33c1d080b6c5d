#pragma once
/// Time parametrisation of a joint path: a motion from rest to rest within the limits that do not need pressures.
#include <Eigen/Dense>
#include <string>

#include "models/machine/trajectory.h"
#include "problems/motion_limits.h"
#include "problems/problem.h"

namespace sparflow {

struct TimingOptions {
  int intervals = 100;  ///< number of equal intervals of the motion, at least 8
};

enum class TimingStatus {
  kOk,
  kTooShort,   ///< the wanted duration is below `shortest`; the motion takes `shortest`
  kCollision,  ///< the motion along the path meets an obstacle; see `clearance`
};

struct TimedMotion {
  TimingStatus status = TimingStatus::kOk;
  std::string message;  ///< one sentence
  Trajectory motion;    ///< rest to rest, constant acceleration in each interval
  double shortest =
      0.0;  ///< shortest duration of this path with this profile [s]: an upper bound of
            ///< the path's minimum time, usually one per cent above it, less on a straight line
  std::string limit;  ///< the limit that determines it, e.g. "flow of pump main"
  bool stops =
      false;  ///< true when corners could not be rounded: the motion stops at each waypoint
  double clearance =
      0.0;  ///< least exact distance less the capsule's radius [m], +infinity without obstacles
};

/// Turns a polyline into a motion of `duration` (<= 0: the shortest).
///  1. Corners are rounded by parabolas over up to half of both legs, less where an obstacle is near.
///  2. Minimum-time profile along the rounded path under joint speed and acceleration limits, valve
///     flow per direction and pump flow (forward and backward pass; Bobrow, Dubowsky and Gibson 1985).
///  3. Points at equal times on it are the control points of a uniform quadratic B-spline: exactly
///     the piecewise constant acceleration of Trajectory, without ringing, inside the control
///     polygon's hull (so within position limits), its first two and last two control points equal (rest).
///     A straight line needs no rounding: its speeds at equal times are the profile's, and its positions follow from them.
///  4. All limits are evaluated on that motion (speed at knots and acceleration per interval, which is
///     exact; flows at 16 instants an interval, with a margin for what lies between) and the time is
///     stretched so that the most violated one just holds. Stretching
///     divides speeds and flows by r and accelerations by r^2, so any longer duration keeps the limits too.
///  5. The exact clearance is checked at 16 instants an interval; if the rounded motion violates it, the motion stops
///     at the waypoints instead.
/// @param path waypoints x joints, at least one row, within the position limits
TimedMotion time_parametrise(const MotionProblem& problem, const Eigen::MatrixXd& path,
                             double duration, const TimingOptions& options = {});

/// Motion along the uniform quadratic B-spline of control points [intervals x joints], the first and last taken twice. It
/// is at rest at an end whose two control points are equal; acceleration is piecewise constant. @param h interval [s]
Trajectory spline_motion(const Eigen::MatrixXd& control, double h);

}  // namespace sparflow
