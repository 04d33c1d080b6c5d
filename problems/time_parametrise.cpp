#include "problems/time_parametrise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/math/error.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kGrid = 600;       // pieces of the whole path in the profile
constexpr int kLeastPieces = 8;  // least number of pieces of a leg or a rounded corner
constexpr int kFine = 16;        // instants in an interval at which flows and clearance are checked
constexpr double kFlowMargin = 1e-4;  // relative, for flow maxima between those instants
constexpr double kCurvatureShare =
    0.7;  // share of the acceleration limit for the path's curvature, the rest is for the path's acceleration
constexpr double kMissed = 1e-3;  // [m] violation that a check of a motion may miss (clear_share)
constexpr double kLeastInterval = 1e-3;  // [s] for paths without length

std::size_t slot(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// The smaller of a joint's two acceleration limits.
double least_acceleration(const MotionProblem& problem, Eigen::Index joint) {
  const Range& a = problem.limits.acceleration[slot(joint)];
  return std::min(a.hi, -a.lo);
}

/// Samples of a path, and the nodes at which a motion with stops is at rest.
struct Grid {
  std::vector<VectorXd> q;
  std::vector<bool> stop;
  void add(const VectorXd& point, bool stops) {
    q.push_back(point);
    stop.push_back(stops);
  }
};

/// Whether the chords of the parabola a-corner-b are clear.
bool parabola_clear(ClearanceModel& clearance, const VectorXd& a, const VectorXd& corner,
                    const VectorXd& b) {
  VectorXd last = a;
  for (int i = 1; i <= kLeastPieces; ++i) {
    const double s = static_cast<double>(i) / kLeastPieces;
    const VectorXd next = (1 - s) * (1 - s) * a + 2 * s * (1 - s) * corner + s * s * b;
    if (!clearance.motion_clear(last.data(), next.data())) return false;
    last = next;
  }
  return true;
}

Grid sample(const MotionProblem& problem, const std::vector<VectorXd>& waypoints, bool round,
            ClearanceModel& clearance) {
  const VectorXd scale = speed_scale(problem);
  const auto length = [&](const VectorXd& a, const VectorXd& b) {
    return (b - a).cwiseQuotient(scale).norm();
  };
  double total = 0.0;
  for (std::size_t k = 1; k < waypoints.size(); ++k)
    total += length(waypoints[k - 1], waypoints[k]);
  const auto pieces = [&](double part) {
    return std::max(kLeastPieces, static_cast<int>(std::ceil(kGrid * part / total)));
  };
  Grid grid;
  grid.add(waypoints.front(), true);
  const auto line_to = [&](const VectorXd& to, bool stops) {
    const VectorXd from = grid.q.back();
    const double part = length(from, to);
    if (part < 1e-12 * total) return;
    const int count = pieces(part);
    for (int i = 1; i <= count; ++i) {
      grid.add(from + (to - from) * (static_cast<double>(i) / count), stops && i == count);
    }
  };
  for (std::size_t k = 1; k + 1 < waypoints.size(); ++k) {
    const VectorXd& corner = waypoints[k];
    VectorXd a, b;
    bool rounded = false;
    // A parabola covers at most half of both legs, so that neighbouring ones do not meet.
    for (double share = 0.5; round && !rounded && share > 0.005; share *= 0.5) {
      const double before = length(waypoints[k - 1], corner),
                   after = length(corner, waypoints[k + 1]);
      const double cut = share * std::min(before, after);
      a = corner + (waypoints[k - 1] - corner) * (cut / before);
      b = corner + (waypoints[k + 1] - corner) * (cut / after);
      rounded = parabola_clear(clearance, a, corner, b);
    }
    if (!rounded) {
      line_to(corner, !round);
      continue;
    }
    line_to(a, false);
    const int count = pieces(length(a, corner) + length(corner, b));
    for (int i = 1; i <= count; ++i) {
      const double s = static_cast<double>(i) / count;
      grid.add((1 - s) * (1 - s) * a + 2 * s * (1 - s) * corner + s * s * b, false);
    }
  }
  line_to(waypoints.back(), true);
  grid.stop.back() = true;
  return grid;
}

/// Times and path speeds at the grid's nodes.
struct Run {
  std::vector<double> t;      // [s]
  std::vector<double> speed;  // in lengths of the metric per s
};

/// Minimum-time profile along the grid.
Run fastest(const MotionProblem& problem, const Grid& grid) {
  LimitRatios limits(problem);
  const std::size_t pieces = grid.q.size() - 1;
  std::vector<VectorXd> slope(pieces), bend(pieces + 1, VectorXd::Zero(grid.q[0].size()));
  const VectorXd scale = speed_scale(problem);
  std::vector<double> ds(pieces);
  for (std::size_t i = 0; i < pieces; ++i) {
    const VectorXd d = grid.q[i + 1] - grid.q[i];
    ds[i] = d.cwiseQuotient(scale).norm();
    slope[i] = d / ds[i];
  }
  for (std::size_t i = 1; i < pieces; ++i) {
    bend[i] = (slope[i] - slope[i - 1]) / (0.5 * (ds[i] + ds[i - 1]));
  }
  // Square of the path speed at the nodes.
  std::vector<double> u(pieces + 1, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i <= pieces; ++i) {
    if (grid.stop[i]) {
      u[i] = 0.0;
      continue;
    }
    const double ratio = std::max(limits.speed(grid.q[i], slope[i - 1], nullptr),
                                  limits.speed(grid.q[i], slope[i], nullptr));
    if (ratio > 0.0) u[i] = 1.0 / (ratio * ratio);
    for (Eigen::Index j = 0; j < bend[i].size(); ++j) {
      const double b = std::abs(bend[i][j]);
      if (b > 0.0) u[i] = std::min(u[i], kCurvatureShare * least_acceleration(problem, j) / b);
    }
  }
  const auto gain = [&](std::size_t piece, std::size_t node, double from) {
    double most = std::numeric_limits<double>::infinity();
    for (Eigen::Index j = 0; j < slope[piece].size(); ++j) {
      const double s = std::abs(slope[piece][j]);
      if (s > 0.0)
        most =
            std::min(most, (least_acceleration(problem, j) - std::abs(bend[node][j]) * from) / s);
    }
    return from + 2.0 * ds[piece] * std::max(0.0, most);
  };
  for (std::size_t i = 0; i < pieces; ++i) u[i + 1] = std::min(u[i + 1], gain(i, i, u[i]));
  for (std::size_t i = pieces; i-- > 0;) u[i] = std::min(u[i], gain(i, i + 1, u[i + 1]));
  Run run{std::vector<double>(pieces + 1, 0.0), std::vector<double>(pieces + 1, 0.0)};
  for (std::size_t i = 0; i <= pieces; ++i) run.speed[i] = std::sqrt(u[i]);
  for (std::size_t i = 0; i < pieces; ++i) {
    run.t[i + 1] = run.t[i] + 2.0 * ds[i] / (run.speed[i] + run.speed[i + 1]);
  }
  return run;
}

/// Point of the profile at time `when`, with constant acceleration along each piece. `piece` only increases.
VectorXd point_at(const Grid& grid, const Run& run, double when, std::size_t& piece) {
  while (piece + 2 < run.t.size() && run.t[piece + 1] < when) ++piece;
  const double span = run.t[piece + 1] - run.t[piece];
  const double tau = std::clamp((when - run.t[piece]) / span, 0.0, 1.0);
  // Speeds are scaled so that those at both ends of the piece have the mean 1.
  const double v0 = 2.0 * run.speed[piece] / (run.speed[piece] + run.speed[piece + 1]);
  const double share = std::clamp(v0 * tau + (1.0 - v0) * tau * tau, 0.0, 1.0);
  return grid.q[piece] + share * (grid.q[piece + 1] - grid.q[piece]);
}

}  // namespace

Trajectory spline_motion(const MatrixXd& c, double h) {
  const Eigen::Index n = c.rows();  // intervals; the first and last control point count twice
  const auto control = [&](Eigen::Index k) { return c.row(std::clamp<Eigen::Index>(k, 0, n - 1)); };
  Trajectory motion;
  motion.t.resize(n + 1);
  motion.q.resize(n + 1, c.cols());
  motion.qd.resize(n + 1, c.cols());
  motion.qdd.resize(n + 1, c.cols());
  for (Eigen::Index k = 0; k <= n; ++k) {
    motion.t[k] = h * static_cast<double>(k);
    motion.q.row(k) = 0.5 * (control(k - 1) + control(k));
    motion.qd.row(k) = (control(k) - control(k - 1)) / h;
    const Eigen::Index i = std::min(k, n - 1);
    motion.qdd.row(k) = (control(i + 1) - 2.0 * control(i) + control(i - 1)) / (h * h);
  }
  return motion;
}

namespace {

/// The profile along a straight line at equally distant instants, one second apart. Positions follow from the speeds by
/// the trapezoidal rule, so that accelerations are constant between the instants and no rounding of the profile is needed.
/// @param ends first and last posture
Trajectory straight_motion(const std::vector<VectorXd>& ends, const Run& run, int intervals) {
  const VectorXd way = ends.back() - ends.front();
  VectorXd speed = VectorXd::Zero(intervals + 1);  // shares of the way in a second, up to a factor
  std::size_t piece = 0;
  for (int k = 1; k < intervals; ++k) {
    const double when = run.t.back() * k / intervals;
    while (piece + 2 < run.t.size() && run.t[piece + 1] < when) ++piece;
    const double share = (when - run.t[piece]) / (run.t[piece + 1] - run.t[piece]);
    speed[k] = (1.0 - share) * run.speed[piece] + share * run.speed[piece + 1];
  }
  speed /= speed.sum();
  Trajectory motion;
  motion.t.setLinSpaced(intervals + 1, 0.0, intervals);
  motion.q.resize(intervals + 1, way.size());
  motion.q.row(0) = ends.front();
  motion.qd = speed * way.transpose();
  motion.qdd.setZero(intervals + 1, way.size());
  for (int k = 0; k < intervals; ++k) {
    motion.qdd.row(k) = motion.qd.row(k + 1) - motion.qd.row(k);
    motion.q.row(k + 1) = motion.q.row(k) + 0.5 * (motion.qd.row(k) + motion.qd.row(k + 1));
  }
  motion.qdd.row(intervals) = motion.qdd.row(intervals - 1);
  motion.q.row(intervals) = ends.back();  // removes rounding errors
  return motion;
}

/// The path's motion with intervals of one second.
Trajectory unit_motion(const MotionProblem& problem, const std::vector<VectorXd>& waypoints,
                       bool round, ClearanceModel& clearance, int intervals) {
  MatrixXd control(intervals, waypoints.front().size());
  if (waypoints.size() == 1) {
    control.rowwise() = waypoints.front().transpose();
    return spline_motion(control, 1.0);
  }
  const Grid grid = sample(problem, waypoints, round, clearance);
  const Run run = fastest(problem, grid);
  if (waypoints.size() == 2) return straight_motion(waypoints, run, intervals);
  std::size_t piece = 0;
  for (int k = 0; k < intervals; ++k) {
    control.row(k) = point_at(grid, run, run.t.back() * k / (intervals - 1), piece);
  }
  control.row(0) = waypoints.front();
  control.row(intervals - 1) = waypoints.back();
  return spline_motion(control, 1.0);
}

}  // namespace

TimedMotion time_parametrise(const MotionProblem& problem, const MatrixXd& path, double duration,
                             const TimingOptions& options) {
  SPARFLOW_CHECK(options.intervals >= 8, "a timed motion has at least 8 intervals");
  SPARFLOW_CHECK(path.rows() >= 1 && path.cols() == problem.machine.joint_count(),
                 "a path has one row for each waypoint and one column for each joint");
  const int intervals = options.intervals;
  const VectorXd scale = speed_scale(problem);
  std::vector<VectorXd> waypoints{path.row(0).transpose()};
  for (Eigen::Index k = 1; k < path.rows(); ++k) {
    const VectorXd next = path.row(k).transpose();
    if ((next - waypoints.back()).cwiseQuotient(scale).norm() > 1e-9) waypoints.push_back(next);
  }
  ClearanceModel clearance(problem);
  TimedMotion result;
  for (const bool round : {true, false}) {
    // Ratios at intervals of 1 s give the factor by which time must be stretched.
    const Trajectory unit = unit_motion(problem, waypoints, round, clearance, intervals);
    LimitRatios limits(problem);
    double interval = kLeastInterval;
    std::string name;
    const auto judge = [&](double needed) {
      if (needed <= interval) return;
      interval = needed;
      result.limit = name;
    };
    for (Eigen::Index k = 0; k < unit.size(); ++k) {
      judge(std::sqrt(limits.acceleration(unit.qdd.row(k).transpose(), &name)));
    }
    const Trajectory fine = unit.refined(kFine);
    for (Eigen::Index k = 0; k < fine.size(); ++k) {
      judge((1.0 + kFlowMargin) *
            limits.speed(fine.q.row(k).transpose(), fine.qd.row(k).transpose(), &name));
    }
    result.shortest = interval * intervals;
    const bool too_short = duration > 0.0 && duration < result.shortest;
    const double taken = duration > 0.0 && !too_short ? duration : result.shortest;
    const double h = taken / intervals;
    result.motion = unit;
    result.motion.t *= h;
    result.motion.t[intervals] = taken;
    result.motion.qd /= h;
    result.motion.qdd /= h * h;
    result.stops = !round && waypoints.size() > 2;
    const Nearest nearest = clearance.nearest_on(result.motion, kFine);
    result.clearance = nearest.distance;
    if (nearest.distance < -kMissed) {
      result.status = TimingStatus::kCollision;
      result.message = "timed path collides: " + clearance.describe(nearest);
      continue;
    }
    result.status = too_short ? TimingStatus::kTooShort : TimingStatus::kOk;
    result.message =
        too_short ? fmt::format("{:.2f} s is too short: {} allows {:.2f} s at least on this path",
                                duration, result.limit, result.shortest)
                  : fmt::format("{:.2f} s, shortest {:.2f} s ({})", taken, result.shortest,
                                result.limit.empty() ? "no motion" : result.limit);
    break;
  }
  return result;
}

}  // namespace sparflow
