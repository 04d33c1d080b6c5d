/// The tip line with the redundancy of least energy, as a baseline.
#include <algorithm>
#include <cmath>

#include "optimizer/baselines/baselines.h"
#include "optimizer/baselines/path_redundancy.h"
#include "problems/motion_limits.h"

namespace sparflow {
namespace {

/// First duration tried where none is known.
/// @threshold [s] 1..1000; chosen: usual duration of a crane's motion; it is doubled where too short
constexpr double kFirstLineDuration = 10.0;
/// Largest number of doublings until a motion is found.
/// @threshold [1] 0..10; chosen: a line that needs more than eight times the first duration is none a driver would
/// take
constexpr int kDoublings = 3;

/// The motion compressed in time as far as speeds, flows and accelerations allow.
Trajectory at_its_fastest(const MotionProblem& problem, const Trajectory& motion) {
  /// Parts of a mesh interval at which the limits are judged.
  /// @threshold [1] 2..64; chosen: as OptimizeOptions::refine, by which the motion is judged in the end
  constexpr int kInstants = 16;
  LimitRatios limits(problem);
  const Trajectory fine = motion.refined(kInstants);
  double share = 0.0;  // shortest duration as share of the present one
  for (Eigen::Index k = 0; k < fine.size(); ++k) {
    const Eigen::VectorXd q = fine.q.row(k).transpose(), qd = fine.qd.row(k).transpose(),
                          qdd = fine.qdd.row(k).transpose();
    share = std::max(
        {share, limits.speed(q, qd, nullptr), std::sqrt(limits.acceleration(qdd, nullptr))});
  }
  // Flows may be slightly larger between those instants.
  return share > 0.0 ? with_duration(motion, (1.0 + 1e-4) * share * motion.duration()) : motion;
}

}  // namespace

BaselineMotion BaselineSet::best_tip_line(double duration) const {
  PathRedundancyOptions options;
  options.intervals = options_.intervals;
  options.speed_levels = options_.tip_speed_levels;
  options.limit_tolerance = options_.limit_tolerance;
  options.refine = options_.optimize.refine;
  Trajectory line;
  if (!tip_lines_.empty() && duration >= tip_lines_.front().shortest)
    line = with_duration(tip_lines_.front().legs.front(), duration);
  PathRedundancy solved = best_redundancy_line(model_, problem_, duration, line, options);
  BaselineMotion m;
  m.kind = kBestTipLine;
  m.duration = m.shortest = duration;
  m.detail = solved.top_speed > 0.0 ? "trapezoidal speed" : "speed of the pseudo-inverse line";
  m.motion = std::move(solved.motion);
  m.energy = std::move(solved.energy);
  m.why = std::move(solved.why);
  return m;
}

void BaselineSet::make_best_tip_lines() {
  no_best_tip_ = path_redundancy_refusal(problem_);
  if (!no_best_tip_.empty()) return;
  double duration = kFirstLineDuration;
  if (!tip_lines_.empty()) {
    duration = 1.05 * tip_lines_.front().shortest;
    best_tip_lines_ = tip_lines_;  // one of the candidates, and the fastest one
  } else if (problem_.duration.min > 0.0) {
    duration = problem_.duration.min;
  }
  const auto keep = [&](BaselineMotion m) {
    if (!m.found()) {
      no_best_tip_ = m.why;
      return false;
    }
    const Trajectory fastest = at_its_fastest(problem_, m.motion);
    best_tip_lines_.push_back({m.detail, {fastest}, {}, fastest.duration()});
    return true;
  };
  for (int i = 0; i <= kDoublings; ++i, duration *= 2.0) {
    if (!keep(best_tip_line(duration))) continue;
    keep(best_tip_line(2.0 * duration));  // a longer duration may allow a cheaper course
    return;
  }
}

}  // namespace sparflow
