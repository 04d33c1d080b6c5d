#include "optimizer/phases/tightening.h"

#include <algorithm>

#include "problems/clearance.h"

namespace sparflow {

bool Tightening::tighten_bounds(const MotionProblem& problem, const std::vector<LimitCheck>& checks,
                                double tolerance) {
  bool any = false;
  for (const LimitCheck& c : checks) {
    if (c.excess <= tolerance) continue;
    any = true;
    const double share = 1.0 - 1.3 * c.excess;
    if (c.what.starts_with("flow of pump")) flow *= share;
    if (c.what.starts_with("flow through valve")) valve *= share;
    if (c.what.starts_with("pressure of pump")) {
      if (limit_pressure) pressure *= share;
      limit_pressure = true;
    }
    if (c.what.starts_with("distance of the tip from its line")) line *= share;
    if (c.what.starts_with("standard deviation of the pressure")) trust *= share;
    // The rest of the sway is small where the linear load leaves none, so its share may fall by half at once at most.
    const double sway_share = std::max(0.5, share);
    if (c.what == "sway of the load") {
      sway *= sway_share;
    } else if (c.what.starts_with("sway of the load")) {
      still *= sway_share;
    }
    if (c.what.starts_with("clearance")) clearance += 1.3 * c.excess;
    if (c.what.starts_with("position of joint ")) {
      const int j = problem.machine.joint_index(c.what.substr(18));
      const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
      position[static_cast<std::size_t>(j)] += 1.3 * c.excess * (r.hi - r.lo);
    }
  }
  return any;
}

bool split_where_it_touches(const MotionProblem& problem, const Trajectory& motion, int parts,
                            int most, PhaseMesh& mesh) {
  if (problem.obstacles.empty() || mesh.modes.rows() == 0) return false;
  /// Depth of a violation between two knots from which the interval is split.
  /// @threshold [m] 0..0.1; chosen: a smaller one is cured by tightening the row
  constexpr double kDeep = 5e-3;
  /// Parts into which such an interval is cut.
  /// @threshold [1] 2..16; chosen: the sag of a curved path between knots falls to a sixteenth
  constexpr int kParts = 4;
  if (motion.size() > most) return false;
  ClearanceModel clearance(problem);
  std::vector<double> times = {motion.t[0]};
  std::vector<Eigen::Index> source;
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double h = motion.t[k + 1] - motion.t[k];
    bool touches = false;
    Eigen::VectorXd q;
    for (int part = 1; part < parts && !touches; ++part) {
      const double dt = h * part / parts;
      q = motion.q.row(k) + dt * motion.qd.row(k) + 0.5 * dt * dt * motion.qdd.row(k);
      touches = clearance.nearest(q.data()).distance < -kDeep;
    }
    const int pieces = touches ? kParts : 1;
    for (int part = 1; part <= pieces; ++part) {
      times.push_back(part == pieces ? motion.t[k + 1] : motion.t[k] + h * part / pieces);
      source.push_back(k);
    }
  }
  const auto intervals = static_cast<Eigen::Index>(source.size());
  if (intervals + 1 == motion.size()) return false;
  PhaseMesh split;
  for (const int knot : mesh.waypoint_knots) {
    const auto at = std::find(times.begin(), times.end(), motion.t[knot]);
    split.waypoint_knots.push_back(static_cast<int>(at - times.begin()));
  }
  split.times = Eigen::Map<const Eigen::VectorXd>(times.data(), intervals + 1);
  split.modes.resize(intervals, mesh.modes.cols());
  for (Eigen::Index k = 0; k < intervals; ++k) {
    const Eigen::Index old = source[static_cast<std::size_t>(k)];
    split.modes.row(k) = mesh.modes.row(old);
    if (!mesh.of_interval.empty())
      split.of_interval.push_back(mesh.of_interval[static_cast<std::size_t>(old)]);
  }
  mesh = std::move(split);
  return true;
}

}  // namespace sparflow
