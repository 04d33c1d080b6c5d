#include "optimizer/baselines/baselines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/machine/kinematics.h"
#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "models/math/golden_section.h"
#include "models/math/linear_algebra.h"
#include "problems/motion_limits.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Largest number of goal configurations to which straight lines are tried.
/// @threshold [1] 1..1000; chosen: as many as a goal region gives that differ visibly
constexpr std::size_t kMostLines = 16;

/// Joint position at which the cylinder has length x, between two positions that enclose it.
double position_at_length(const Machine& machine, int cylinder, double x, double a, double b) {
  const bool grows =
      linkage_rates(machine, cylinder, b).value > linkage_rates(machine, cylinder, a).value;
  /// Halvings of the joint's range.
  /// @threshold [1] 53..200; derived: 53 bits of a double are exhausted
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (a + b);
    if ((linkage_rates(machine, cylinder, middle).value < x) == grows) {
      a = middle;
    } else {
      b = middle;
    }
  }
  return 0.5 * (a + b);
}

std::string posture_text(const Machine& machine, const VectorXd& q) {
  std::string text = "to ";
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    text += fmt::format("{}{} {:.2f}", j > 0 ? ", " : "",
                        machine.joints[static_cast<std::size_t>(j)].name, q[j]);
  }
  return text;
}

}  // namespace

MatrixXd actuator_line(const Machine& machine, const VectorXd& from, const VectorXd& to,
                       int pieces) {
  MatrixXd path(pieces + 1, from.size());
  for (int k = 0; k <= pieces; ++k) {
    const double s = static_cast<double>(k) / pieces;
    for (int j = 0; j < machine.joint_count(); ++j) {
      const int c = machine.cylinder_of_joint(j);
      path(k, j) = from[j] + s * (to[j] - from[j]);
      if (c < 0 || k == 0 || k == pieces || from[j] == to[j]) continue;
      const double x0 = linkage_rates(machine, c, from[j]).value,
                   x1 = linkage_rates(machine, c, to[j]).value;
      path(k, j) = position_at_length(machine, c, x0 + s * (x1 - x0), from[j], to[j]);
    }
  }
  return path;
}

MatrixXd pseudo_inverse_line(const Machine& machine, const MotionProblem& problem,
                             const Eigen::Vector3d& goal, double* share, int pieces) {
  const VectorXd speed = speed_scale(problem);
  const Eigen::Vector3d first = tip_position<double>(machine, problem.start);
  MatrixXd path(pieces + 1, speed.size());
  path.row(0) = problem.start.transpose();
  VectorXd q = problem.start;
  *share = 1.0;
  for (int k = 1; k <= pieces; ++k) {
    const Eigen::Vector3d wanted = first + (goal - first) * (static_cast<double>(k) / pieces);
    std::vector<bool> held(static_cast<std::size_t>(q.size()), false);
    double miss = 0.0;
    /// Largest number of Newton steps to one point of the line.
    /// @threshold [1] 10..200; chosen: from a neighbouring point Newton's method converges in a few; steps that hit a
    /// joint limit begin anew
    constexpr int kNewtonSteps = 40;
    for (int i = 0; i < kNewtonSteps; ++i) {
      const Eigen::Vector3d error = wanted - tip_position<double>(machine, q);
      miss = error.norm();
      /// Distance of the tip at which Newton's method stops.
      /// @threshold [m] 1e-13..1e-7; numerical: rounding of a tip position is near 1e-15 m
      constexpr double kConvergedTip = 1e-10;
      if (miss < kConvergedTip) break;
      Eigen::Matrix3Xd weighted =
          point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz) *
          speed.asDiagonal();
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        if (held[static_cast<std::size_t>(j)]) weighted.col(j).setZero();
      }
      // The small term keeps the matrix regular for a planar machine, whose Jacobian is zero along its normal.
      const Eigen::Matrix3d normal =
          weighted * weighted.transpose() + 1e-12 * Eigen::Matrix3d::Identity();
      q += speed.asDiagonal() * (weighted.transpose() * solve_symmetric(normal, error));
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
        if (q[j] >= r.lo && q[j] <= r.hi) continue;
        q[j] = std::clamp(q[j], r.lo, r.hi);
        held[static_cast<std::size_t>(j)] = true;
      }
    }
    /// Distance beyond which a point of the line is not reached.
    /// @threshold [m] 1e-10..1e-4; numerical: far below what a limit check sees, far above what convergence leaves
    constexpr double kOnTheLine = 1e-7;
    if (!(miss < kOnTheLine)) {
      *share = static_cast<double>(k - 1) / pieces;
      return path.topRows(k);
    }
    path.row(k) = q.transpose();
  }
  return path;
}

const std::vector<std::string>& BaselineSet::kinds() {
  static const std::vector<std::string> all = {kSequential,   kJointLine, kNearestJointLine,
                                               kActuatorLine, kTipLine,   kBestTipLine};
  return all;
}

BaselineSet::BaselineSet(const CraneModel& model, const MotionProblem& problem,
                         const std::vector<VectorXd>& end_postures, BaselineOptions options)
    : model_(model), problem_(problem), options_(std::move(options)) {
  options_.optimize.intervals = options_.intervals;
  find_end_postures(end_postures);
  make_sequences();
  make_lines();
  make_best_tip_lines();
}

void BaselineSet::make_lines() {
  const Machine& machine = model_.machine;
  TimingOptions timing;
  timing.intervals = options_.intervals;
  const auto drive = [&](const MatrixXd& path, const std::string& detail,
                         std::vector<DrivenPath>& out, std::string& refused) {
    const TimedMotion motion = time_parametrise(problem_, path, 0.0, timing);
    if (motion.status != TimingStatus::kOk || motion.motion.size() < 2) {
      refused = motion.message;
      return;
    }
    out.push_back({detail, {motion.motion}, {}, motion.shortest});
  };
  no_line_ = no_nearest_ = no_actuator_ = "no goal configuration was found";
  for (std::size_t i = 0; i < std::min(kMostLines, ends_.size()); ++i) {
    const std::string detail = posture_text(machine, ends_[i]);
    MatrixXd line(2, ends_[i].size());
    line << problem_.start.transpose(), ends_[i].transpose();
    drive(line, detail, joint_lines_, i == 0 ? no_nearest_ : no_line_);
    if (i == 0 && !joint_lines_.empty()) nearest_line_ = joint_lines_;
    drive(actuator_line(machine, problem_.start, ends_[i]), detail, actuator_lines_, no_actuator_);
  }
  if (joint_lines_.empty() && !ends_.empty()) no_line_ = no_nearest_;
  const auto* goal = std::get_if<TipGoal>(&problem_.goal);
  if (goal == nullptr) {
    no_tip_ = "the goal is a posture: a tip line does not say how to reach it";
    return;
  }
  double share = 0.0;
  const MatrixXd path = pseudo_inverse_line(machine, problem_, goal->tip, &share);
  if (share < 1.0) {
    no_tip_ = fmt::format("the tip's straight line leaves the joints' range after {:.0f} % of it",
                          100.0 * share);
    return;
  }
  drive(path, "pseudo-inverse", tip_lines_, no_tip_);
}

const std::vector<DrivenPath>& BaselineSet::paths(const std::string& kind) const {
  if (kind == kSequential) return sequences_;
  if (kind == kJointLine) return joint_lines_;
  if (kind == kNearestJointLine) return nearest_line_;
  if (kind == kActuatorLine) return actuator_lines_;
  if (kind == kTipLine) return tip_lines_;
  SPARFLOW_CHECK(kind == kBestTipLine, "a kind of baseline");
  return best_tip_lines_;
}

const std::string& BaselineSet::refusal(const std::string& kind) const {
  if (kind == kSequential) return no_sequence_;
  if (kind == kJointLine) return no_line_;
  if (kind == kNearestJointLine) return no_nearest_;
  if (kind == kBestTipLine) return no_best_tip_;
  return kind == kActuatorLine ? no_actuator_ : no_tip_;
}

BaselineMotion BaselineSet::timed(const std::string& kind, const DrivenPath& path,
                                  double duration) const {
  BaselineMotion m;
  m.kind = kind;
  m.detail = path.detail;
  m.duration = duration;
  m.shortest = path.shortest;
  if (duration < path.shortest * (1.0 - 1e-12)) {
    m.why = fmt::format("needs {:.2f} s", path.shortest);
    return m;
  }
  if (path.legs.size() == 1) {
    m.motion = with_duration(path.legs.front(), duration);
    return m;
  }
  const std::vector<double> times = shared_time(model_, problem_.payload, path.legs, duration);
  std::vector<Trajectory> legs;
  for (std::size_t i = 0; i < times.size(); ++i)
    legs.push_back(with_duration(path.legs[i], times[i]));
  m.motion = joined(legs);
  return m;
}

std::vector<BaselineMotion> BaselineSet::orders_at(double duration) const {
  return sequences_at(duration, options_.polished_orders, false);
}

BaselineMotion BaselineSet::cheapest(const std::string& kind, double duration, bool polish) const {
  BaselineMotion none;
  none.kind = kind;
  none.duration = duration;
  none.why = refusal(kind);
  if (kind == kSequential) {
    std::vector<BaselineMotion> orders =
        sequences_at(duration, polish ? options_.polished_orders : 0, true);
    if (!orders.empty()) {
      double shortest = std::numeric_limits<double>::infinity();
      for (const BaselineMotion& m : orders) {
        if (m.shortest > 0.0) shortest = std::min(shortest, m.shortest);
      }
      BaselineMotion best = std::move(orders.front());
      if (!best.found() && std::isfinite(shortest)) {
        best.shortest = shortest;
        if (duration < shortest) best.why = fmt::format("needs {:.2f} s", shortest);
      }
      return best;
    }
    return none;
  }
  // Coarse energies are computed first and limits for the cheapest motions only, because checking limits costs more.
  std::vector<BaselineMotion> all;
  for (const DrivenPath& path : paths(kind)) {
    all.push_back(timed(kind, path, duration));
    if (all.back().found())
      all.back().energy = exact_energy(model_, problem_, all.back().motion, 2);
  }
  // The best redundancy depends on the duration, so it is solved again for a result, but not during a search.
  if (kind == kBestTipLine && polish && !all.empty()) {
    BaselineMotion anew = best_tip_line(duration);
    if (anew.found()) all.push_back(std::move(anew));
  }
  std::stable_sort(all.begin(), all.end(), [](const BaselineMotion& a, const BaselineMotion& b) {
    if (a.found() != b.found()) return a.found();
    return a.found() ? a.energy.total < b.energy.total : a.shortest < b.shortest;
  });
  for (BaselineMotion& m : all) {
    if (!m.found()) return m;
    const std::vector<LimitCheck> checks =
        check_limits(model_, problem_, m.motion, options_.optimize.refine);
    if (worst_excess(checks) > options_.limit_tolerance) {
      const LimitCheck& c = checks.front();
      none.why = fmt::format("{} at t={:.2f} s: {:.4g} against {:.4g} {}", c.what, c.time, c.value,
                             c.limit, c.unit);
      continue;
    }
    m.energy = exact_energy(model_, problem_, m.motion, options_.optimize.refine);
    return std::move(m);
  }
  return none;
}

BaselineMotion BaselineSet::at(const std::string& kind, double duration) const {
  return cheapest(kind, duration, true);
}

double BaselineSet::shortest(const std::string& kind) const {
  double shortest = std::numeric_limits<double>::infinity();
  for (const DrivenPath& path : paths(kind)) shortest = std::min(shortest, path.shortest);
  if (!std::isfinite(shortest)) return 0.0;
  // A pump pressure that is too high at full speed may be kept in a longer duration.
  for (const double factor :
       {1.0, 1.01, 1.05, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0}) {
    if (cheapest(kind, factor * shortest, false).found()) return factor * shortest;
  }
  return 0.0;
}

BaselineMotion BaselineSet::at_own_best(const std::string& kind, double idle_power) const {
  const double first = shortest(kind);
  if (first <= 0.0) return cheapest(kind, std::max(problem_.duration.min, 1.0), false);
  if (idle_power <= 0.0) return cheapest(kind, first, true);
  const auto cost = [&](double duration) {
    const BaselineMotion m = cheapest(kind, duration, false);
    return m.found() ? m.energy.total + idle_power * duration
                     : std::numeric_limits<double>::infinity();
  };
  // Bracketing by steps of 15 % and golden section suffice, because the cost is nearly convex in the duration.
  /// Longest duration tried, in units of the first.
  /// @threshold [1] 2..100; chosen: at a twelfth of the speed the flow losses are gone, a longer motion only costs
  /// idle power
  constexpr double kLongestShare = 12.0;
  /// Cost over the least, from which longer durations are no longer tried.
  /// @threshold [1] 1..2; chosen: beyond a shallow second minimum of a nearly convex cost
  constexpr double kPastTheMinimum = 1.05;
  double best = first, least = cost(first), step = 1.15;
  for (double t = first * step; t < kLongestShare * first; t *= step) {
    const double value = cost(t);
    if (value < least) {
      least = value;
      best = t;
    } else if (value > kPastTheMinimum * least) {
      break;
    }
  }
  // Seven sections shrink the bracket of 30 % to 1 % of the duration.
  const GoldenSection found = golden_section(std::max(first, best / step), best * step, 7, cost);
  return cheapest(kind, found.value < least ? found.x : best, true);
}

}  // namespace sparflow
