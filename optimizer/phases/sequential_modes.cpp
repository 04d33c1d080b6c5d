#include "optimizer/phases/sequential_modes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>

#include "models/effects/effective_machine.h"
#include "models/math/linear_algebra.h"
#include "optimizer/crane/exact_energy.h"
#include "problems/clearance.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Highest speed that joint, valve and pump allow everywhere on a joint's travel. [rad/s] or [m/s]
double joint_speed(const CraneModel& model, const MotionProblem& problem, int joint, double from,
                   double to) {
  const Range& v = problem.limits.velocity[static_cast<std::size_t>(joint)];
  double speed = to > from ? v.hi : -v.lo;
  const int c = model.machine.cylinder_of_joint(joint);
  if (c < 0) return speed;
  const Cylinder& cylinder = model.machine.cylinders[static_cast<std::size_t>(c)];
  if (!cylinder.hydraulic()) return speed;
  const Valve* valve = model.machine.valve_of_cylinder(c);
  const int pump = model.machine.pump_of_cylinder(c);
  /// Positions of a leg at which the highest speed is taken.
  /// @threshold [1] 3..100; chosen: an initial guess only
  constexpr int kSamples = 9;
  for (int i = 0; i < kSamples; ++i) {
    const double q = from + (to - from) * i / (kSamples - 1);
    const double rate = linkage_rates(model.machine, c, q).d1;
    const bool extends = (to > from) == (rate > 0.0);
    const double area = extends ? cylinder.area_piston() : cylinder.area_rod();
    double flow = std::numeric_limits<double>::infinity();
    if (valve != nullptr) {
      const double full = extends ? valve->max_flow_extend : valve->max_flow_retract;
      if (full > 0.0) flow = problem.limits.valve_fraction * full;
    }
    if (pump >= 0) {
      const double most =
          effect_flow_limit(model.machine, model.effects, pump,
                            problem.limits.pump_max_flow[static_cast<std::size_t>(pump)]);
      if (most > 0.0) flow = std::min(flow, most);
    }
    speed = std::min(speed, flow / (area * std::abs(rate)));
  }
  return speed;
}

/// Depth by which a guess may violate the clearance.
/// @threshold [m] 0..0.5; chosen: a guess this near is worth a solve
constexpr double kDeepestGuess = 0.05;

struct Leg {
  int joint = 0;
  double from = 0.0, to = 0.0;
  double acceleration = 0.0;
  double shortest = 0.0;  ///< [s]
};

Leg make_leg(const CraneModel& model, const MotionProblem& problem, int joint, double from,
             double to) {
  Leg leg{joint, from, to, 0.0, 0.0};
  const Range& a = problem.limits.acceleration[static_cast<std::size_t>(joint)];
  leg.acceleration = std::min(a.hi, -a.lo);
  const double speed = joint_speed(model, problem, joint, from, to), way = std::abs(to - from);
  const double ramp = speed / leg.acceleration;
  leg.shortest = way > speed * ramp ? way / speed + ramp : 2.0 * std::sqrt(way / leg.acceleration);
  return leg;
}

/// Velocity at the knots of a rest-to-rest trapezoid over [begin, end], scaled to cover the way exactly.
void drive(const Leg& leg, const VectorXd& times, Eigen::Index begin, Eigen::Index end,
           Trajectory& motion) {
  const double duration = times[end] - times[begin], way = std::abs(leg.to - leg.from);
  const double a = leg.acceleration;
  const double root = std::max(0.0, a * a * duration * duration - 4.0 * a * way);
  const double speed = 0.5 * (a * duration - std::sqrt(root));
  VectorXd v = VectorXd::Zero(times.size());
  double covered = 0.0;
  for (Eigen::Index k = begin; k <= end; ++k) {
    const double t = times[k] - times[begin];
    v[k] = std::min({a * t, speed, a * (duration - t)});
    if (k > begin) covered += 0.5 * (times[k] - times[k - 1]) * (v[k] + v[k - 1]);
  }
  if (!(covered > 0.0)) return;
  const double scale = (leg.to - leg.from) / covered;
  for (Eigen::Index k = begin + 1; k < times.size(); ++k) {
    motion.qd(k, leg.joint) += k < end ? scale * v[k] : 0.0;
  }
}

void integrate(const VectorXd& start, Trajectory& motion) {
  motion.q.row(0) = start.transpose();
  for (Eigen::Index k = 0; k + 1 < motion.size(); ++k) {
    const double h = motion.t[k + 1] - motion.t[k];
    motion.qdd.row(k) = (motion.qd.row(k + 1) - motion.qd.row(k)) / h;
    motion.q.row(k + 1) = motion.q.row(k) + 0.5 * h * (motion.qd.row(k) + motion.qd.row(k + 1));
  }
  motion.qdd.row(motion.size() - 1) = motion.qdd.row(motion.size() - 2);
}

/// Modes and guess of legs driven one after another over the whole mesh. @return nothing when time is too short
std::optional<ModeCandidate> build(const CraneModel& model, const MotionProblem& problem,
                                   const VectorXd& times, const std::vector<Leg>& legs,
                                   ClearanceModel* clearance) {
  const double total = times[times.size() - 1];
  // Each leg gets two more intervals, because its trapezoid can start and stop at knots only.
  const double slack = 2.0 * total / static_cast<double>(times.size() - 1);
  const double needed = std::accumulate(legs.begin(), legs.end(), 0.0, [&](double s, const Leg& l) {
    return s + l.shortest + slack;
  });
  if (needed - slack * static_cast<double>(legs.size()) > total || legs.empty())
    return std::nullopt;
  const Eigen::Index intervals = times.size() - 1;
  ModeCandidate out;
  out.modes = ModeTable::Constant(intervals, model.machine.cylinder_count(), CylinderMode::kRest);
  Trajectory& m = out.guess;
  m.t = times;
  m.q.setZero(times.size(), model.machine.joint_count());
  m.qd = m.qdd = m.q;
  double until = 0.0;
  Eigen::Index begin = 0;
  for (std::size_t i = 0; i < legs.size(); ++i) {
    until += (legs[i].shortest + slack) / needed * total;
    Eigen::Index end = begin;
    while (end < intervals && times[end] < until - 1e-9) ++end;
    if (i + 1 == legs.size()) end = intervals;
    if (end - begin < 3) return std::nullopt;
    drive(legs[i], times, begin, end, m);
    const int c = model.machine.cylinder_of_joint(legs[i].joint);
    if (c >= 0) {
      const double rate = linkage_rates(model.machine, c, legs[i].from).d1;
      const bool extends = (legs[i].to > legs[i].from) == (rate > 0.0);
      for (Eigen::Index k = begin; k < end; ++k)
        out.modes(k, c) = extends ? CylinderMode::kExtend : CylinderMode::kRetract;
    }
    begin = end;
  }
  integrate(problem.start, m);
  // With fixed modes the solver rarely moves a guess out of an obstacle.
  if (clearance != nullptr && clearance->nearest_on(m, 1).distance < -kDeepestGuess)
    return std::nullopt;
  out.energy = exact_total_energy(model, m, problem.payload, 2);
  return out;
}

std::string order_name(const Machine& machine, const std::vector<Leg>& legs) {
  std::string name = "sequential: ";
  for (std::size_t i = 0; i < legs.size(); ++i) {
    name += (i > 0 ? ", " : "") + machine.joints[static_cast<std::size_t>(legs[i].joint)].name;
  }
  return name;
}

}  // namespace

bool solve_end_posture(const Machine& machine, const MotionLimits& limits,
                       const Eigen::Vector3d& goal, const std::vector<bool>& free, VectorXd& q) {
  /// Largest number of Newton steps to an end posture.
  /// @threshold [1] 10..500; chosen: steps of at most 0.3 rad cross any range in twenty
  constexpr int kNewtonSteps = 60;
  for (int iteration = 0; iteration < kNewtonSteps; ++iteration) {
    const Eigen::Vector3d error = goal - tip_position<double>(machine, q);
    /// Distance of the tip at which Newton's method stops.
    /// @threshold [m] 1e-13..1e-6; numerical: far below the end's tolerance
    constexpr double kTipConverged = 1e-9;
    if (error.norm() < kTipConverged) return true;
    Eigen::Matrix3Xd jacobian =
        point_jacobian_matrix(machine, q, machine.tip.joint, machine.tip.xyz);
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      if (!free[static_cast<std::size_t>(j)]) jacobian.col(j).setZero();
    }
    VectorXd step;
    // A joint at a limit that the step would push further is removed from the step; a shortened step instead would stop
    // the other joints too.
    for (bool pushes = true; pushes;) {
      const Eigen::Matrix3d normal =
          jacobian * jacobian.transpose() + 1e-9 * Eigen::Matrix3d::Identity();
      step = jacobian.transpose() * solve_symmetric(normal, error);
      pushes = false;
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        const Range& r = limits.position[static_cast<std::size_t>(j)];
        if (!((q[j] <= r.lo && step[j] < 0.0) || (q[j] >= r.hi && step[j] > 0.0))) continue;
        jacobian.col(j).setZero();
        pushes = true;
      }
    }
    /// Longest step of a joint.
    /// @threshold [rad or m] 0.05..1; chosen: a linearised arm is wrong beyond some 20 degrees
    constexpr double kLongestStep = 0.3;
    const double length = step.cwiseAbs().maxCoeff();
    if (length > kLongestStep) step *= kLongestStep / length;
    q += step;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const Range& r = limits.position[static_cast<std::size_t>(j)];
      q[j] = std::clamp(q[j], r.lo, r.hi);
    }
  }
  /// Distance of the tip beyond which the goal was not reached.
  /// @threshold [m] 1e-9..1e-4; numerical: a tenth of what the check of a motion's end accepts
  constexpr double kTipReached = 1e-6;
  return (goal - tip_position<double>(machine, q)).norm() < kTipReached;
}

std::vector<ModeCandidate> sequential_candidates(const CraneModel& model,
                                                 const MotionProblem& problem,
                                                 const VectorXd& times,
                                                 const std::vector<VectorXd>& end_postures,
                                                 int most) {
  const int n = model.machine.joint_count();
  std::vector<ModeCandidate> found;
  /// Largest number of joints whose motions are put in order.
  /// @threshold [joints] 1..10; chosen: 7! orders are the most that is worth enumerating
  constexpr int kMostOrdered = 7;
  if (n > kMostOrdered)
    return found;  // kMostOrdered! orders are the most that is worth enumerating
  std::unique_ptr<ClearanceModel> clearance;
  if (!problem.obstacles.empty()) clearance = std::make_unique<ClearanceModel>(problem);
  std::vector<VectorXd> ends;
  /// Distance below which two end postures count as equal.
  /// @threshold [rad or m] 1e-9..0.1; chosen: a millimetre of stroke changes no energy visibly
  constexpr double kSamePosture = 1e-3;
  const auto add_end = [&](const VectorXd& q) {
    for (const VectorXd& known : ends) {
      if ((known - q).cwiseAbs().maxCoeff() < kSamePosture) return;
    }
    ends.push_back(q);
  };
  if (const auto* joint_goal = std::get_if<JointGoal>(&problem.goal)) {
    add_end(joint_goal->q);
  } else {
    const Eigen::Vector3d& goal = std::get<TipGoal>(problem.goal).tip;
    for (const VectorXd& end : end_postures) {
      for (unsigned still = 0; still < (1u << n) - 1u; ++still) {
        std::vector<bool> free(static_cast<std::size_t>(n));
        VectorXd q = end;
        for (int j = 0; j < n; ++j) {
          free[static_cast<std::size_t>(j)] = (still >> j & 1u) == 0;
          if (!free[static_cast<std::size_t>(j)]) q[j] = problem.start[j];
        }
        if (solve_end_posture(model.machine, problem.limits, goal, free, q)) add_end(q);
      }
    }
  }
  for (const VectorXd& end : ends) {
    /// Travel up to which a joint is at rest.
    /// @threshold [rad or m] 1e-9..1e-2; chosen: no machine moves a joint by 0.1 mm on purpose
    constexpr double kStandsStill = 1e-4;
    std::vector<Leg> legs;
    for (int j = 0; j < n; ++j) {
      if (std::abs(end[j] - problem.start[j]) > kStandsStill)
        legs.push_back(make_leg(model, problem, j, problem.start[j], end[j]));
    }
    /// Largest number of legs whose orders are enumerated.
    /// @threshold [legs] 1..8; chosen: 120 orders for five; 720 for six
    constexpr std::size_t kMostLegsInOrder = 5;
    if (legs.size() > kMostLegsInOrder) continue;
    std::sort(legs.begin(), legs.end(),
              [](const Leg& a, const Leg& b) { return a.joint < b.joint; });
    do {
      std::optional<ModeCandidate> candidate = build(model, problem, times, legs, clearance.get());
      if (!candidate) continue;
      candidate->name = order_name(model.machine, legs);
      found.push_back(std::move(*candidate));
    } while (std::next_permutation(legs.begin(), legs.end(),
                                   [](const Leg& a, const Leg& b) { return a.joint < b.joint; }));
  }
  std::sort(found.begin(), found.end(),
            [](const ModeCandidate& a, const ModeCandidate& b) { return a.energy < b.energy; });
  // One candidate of each order is kept: two of one order differ in their end posture only, which the solver varies.
  std::vector<ModeCandidate> best;
  for (ModeCandidate& candidate : found) {
    const bool known = std::any_of(best.begin(), best.end(), [&](const ModeCandidate& b) {
      return b.name == candidate.name && (b.modes.array() == candidate.modes.array()).all();
    });
    if (!known && static_cast<int>(best.size()) < most) best.push_back(std::move(candidate));
  }
  return best;
}

}  // namespace sparflow
