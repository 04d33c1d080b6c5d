/// Sequential motions in every order and with every set of joints at rest with which the goal can be reached.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "models/machine/linkage.h"
#include "optimizer/baselines/baselines.h"
#include "optimizer/phases/phases.h"
#include "problems/clearance.h"
#include "problems/motion_limits.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;

/// Travel below which a joint counts as at rest throughout.
/// @threshold [rad or m] 1e-9..1e-2; chosen: no machine moves a joint by 0.1 mm on purpose
constexpr double kStill = 1e-4;
/// Distance below which two goal configurations count as equal.
/// @threshold [rad or m] 1e-9..1e-1; chosen: a millimetre of stroke changes no energy visibly
constexpr double kSameEnd = 1e-3;
/// Number of values of each joint at which goal configurations are sought.
/// @threshold [1] 3..100; chosen: a twelfth of the range between two cuts, quick enough for four joints
constexpr int kRedundancyCuts = 13;
/// Largest number of goal configurations for which orders are estimated.
/// @threshold [1] 1..1000; chosen: each takes all orders of its joints, at most 120
constexpr std::size_t kMostEnds = 120;
/// Largest number of goal configurations kept for one order.
/// @threshold [1] 1..100; chosen: else the cheapest order's neighbours displace every other order
constexpr std::size_t kEndsOfAnOrder = 3;
/// Mesh intervals of one leg.
/// @threshold [intervals] 8..200; chosen: one joint that accelerates, cruises and stops
constexpr int kLegIntervals = 24;
/// Largest number of moving joints whose orders are enumerated.
/// @threshold [legs] 1..8; chosen: 120 orders for five; 720 for six
constexpr std::size_t kMostLegs = 5;

/// Quasi-static estimate of one joint's move.
struct LegEstimate {
  double energy = 0.0;    // [J]
  double shortest = 0.0;  // [s]
};

struct LegMove {
  const VectorXd& from;  // posture
  int joint;
  double to;
};

/// Estimates the move of one joint at constant speed, half of the highest that flows allow everywhere on its travel.
LegEstimate estimate_leg(const MotionProblem& problem, Chain& chain, LimitRatios& ratios,
                         const LegMove& move) {
  const auto& [from, joint, to] = move;
  /// Positions of a leg at which the estimate is taken.
  /// @threshold [1] 3..100; chosen: midpoints of a tenth of the travel; estimates only rank orders
  constexpr int kSamples = 10;
  const double way = to - from[joint];
  VectorXd q = from, qd = VectorXd::Zero(from.size());
  double ratio = 0.0;
  for (int i = 0; i <= kSamples; ++i) {
    q[joint] = from[joint] + way * i / kSamples;
    qd[joint] = way;
    ratio = std::max(ratio, ratios.speed(q, qd, nullptr));
  }
  const Range& limit = problem.limits.acceleration[static_cast<std::size_t>(joint)];
  const double acceleration = std::min(limit.hi, -limit.lo), speed = std::abs(way) / ratio;
  LegEstimate leg;
  leg.shortest = ratio + speed / acceleration;  // travel at full speed, and ramps
  const double slow = 0.5 / ratio;              // [1/s] share of the travel in a second
  qd[joint] = way * slow;
  for (int i = 0; i < kSamples; ++i) {
    q[joint] = from[joint] + way * (i + 0.5) / kSamples;
    leg.energy += chain.evaluate({q.data(), qd.data()}, problem.payload).power / (slow * kSamples);
  }
  return leg;
}

struct SequenceEstimate {
  std::vector<int> order;
  std::size_t end = 0;
  LegEstimate sum;
};

/// Energy of a leg at some durations, interpolated linearly.
struct LegTable {
  std::vector<double> duration, energy;
  double at(double t) const {
    const auto above = std::lower_bound(duration.begin(), duration.end(), t);
    if (above == duration.begin()) return energy.front();
    if (above == duration.end()) return energy.back();
    const auto k = static_cast<std::size_t>(above - duration.begin());
    const double w = (t - duration[k - 1]) / (duration[k] - duration[k - 1]);
    return (1.0 - w) * energy[k - 1] + w * energy[k];
  }
};

}  // namespace

Trajectory joined(const std::vector<Trajectory>& legs) {
  Trajectory all;
  Eigen::Index rows = 1;
  for (const Trajectory& leg : legs) rows += leg.size() - 1;
  const Eigen::Index n = legs.front().q.cols();
  all.t.setZero(rows);
  all.q.setZero(rows, n);
  all.qd = all.qdd = all.q;
  Eigen::Index at = 0;
  double begin = 0.0;
  for (const Trajectory& leg : legs) {
    const Eigen::Index count = leg.size() - 1;
    for (Eigen::Index k = 0; k <= count; ++k) {
      all.t[at + k] = begin + leg.t[k] - leg.t[0];
      all.q.row(at + k) = leg.q.row(k);
      all.qd.row(at + k) = leg.qd.row(k);
      all.qdd.row(at + k) = leg.qdd.row(k);
    }
    begin = all.t[at + count];
    at += count;
  }
  return all;
}

std::vector<double> shared_time(const CraneModel& model, double payload,
                                const std::vector<Trajectory>& legs, double duration) {
  /// Equal parts into which the spare time is cut to be shared out.
  /// @threshold [1] 10..1000; chosen: a part is a sixtieth of the spare time, below what the energy feels
  constexpr int kUnits = 60;
  /// Durations at which a leg's energy is tabulated.
  /// @threshold [1] 3..60; chosen: the energy is smooth and nearly convex in the duration
  constexpr int kTableSize = 7;
  double shortest = 0.0;
  for (const Trajectory& leg : legs) shortest += leg.duration();
  const double spare = std::max(0.0, duration - shortest), unit = spare / kUnits;
  std::vector<double> times;
  times.reserve(legs.size());
  for (const Trajectory& leg : legs) times.push_back(leg.duration());
  /// Spare time over the shortest time, up to which there is none.
  /// @threshold [1] 0..1e-6; numerical: rounding of the sum of the legs' durations
  constexpr double kNoSpare = 1e-9;
  if (spare <= kNoSpare * shortest || legs.size() == 1) {
    times.back() += duration - shortest;
    return times;
  }
  // value[k] = least energy of the legs so far with k units spent; choice[i][k] = units of leg i then
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::vector<double> value(kUnits + 1, kNever);
  value[0] = 0.0;
  std::vector<std::vector<int>> choice(legs.size(), std::vector<int>(kUnits + 1, 0));
  for (std::size_t i = 0; i < legs.size(); ++i) {
    LegTable table;
    for (int s = 0; s < kTableSize; ++s) {
      // Points are denser at short durations, where the energy changes most.
      const double extra = spare * std::pow(static_cast<double>(s) / (kTableSize - 1), 2);
      table.duration.push_back(times[i] + extra);
      table.energy.push_back(
          exact_total_energy(model, with_duration(legs[i], times[i] + extra), payload, 2));
    }
    std::vector<double> next(kUnits + 1, kNever);
    for (int k = 0; k <= kUnits; ++k) {
      for (int own = 0; own <= k; ++own) {
        const double sum =
            value[static_cast<std::size_t>(k - own)] + table.at(times[i] + own * unit);
        if (sum >= next[static_cast<std::size_t>(k)]) continue;
        next[static_cast<std::size_t>(k)] = sum;
        choice[i][static_cast<std::size_t>(k)] = own;
      }
    }
    value = std::move(next);
  }
  int left = kUnits;
  for (std::size_t i = legs.size(); i-- > 0;) {
    const int own = choice[i][static_cast<std::size_t>(left)];
    times[i] += own * unit;
    left -= own;
  }
  return times;
}

void BaselineSet::find_end_postures(const std::vector<VectorXd>& given) {
  const int n = model_.machine.joint_count();
  std::unique_ptr<ClearanceModel> clearance;
  if (!problem_.obstacles.empty()) clearance = std::make_unique<ClearanceModel>(problem_);
  const auto add = [&](const VectorXd& q) {
    if (ends_.size() >= kMostEnds) return;
    for (const VectorXd& known : ends_) {
      if ((known - q).cwiseAbs().maxCoeff() < kSameEnd) return;
    }
    if (clearance && !clearance->clear(q.data())) return;
    ends_.push_back(q);
  };
  if (const auto* posture = std::get_if<JointGoal>(&problem_.goal)) {
    add(posture->q);
    return;
  }
  const Eigen::Vector3d& goal = std::get<TipGoal>(problem_.goal).tip;
  const std::vector<bool> all_free(static_cast<std::size_t>(n), true);
  std::vector<VectorXd> starts;
  for (VectorXd q : given) {
    if (!solve_end_posture(model_.machine, problem_.limits, goal, all_free, q)) continue;
    add(q);
    /// Largest number of given end postures from which further ones are sought.
    /// @threshold [1] 1..100; chosen: the time grows with it, and further ones rarely lead to new postures
    constexpr std::size_t kMostGivenStarts = 4;
    if (starts.size() < kMostGivenStarts) starts.push_back(q);
  }
  if (VectorXd q = problem_.start;
      solve_end_posture(model_.machine, problem_.limits, goal, all_free, q)) {
    add(q);
    starts.push_back(q);
  }
  // Goal configurations with every set of joints at rest.
  /// Largest number of joints whose sets at rest are enumerated.
  /// @threshold [joints] 1..10; chosen: 126 sets for seven joints; twice as many for each further joint
  constexpr int kMostEnumerated = 7;
  for (const VectorXd& from : starts) {
    for (unsigned still = 1; still < (1u << n) - 1u && n <= kMostEnumerated; ++still) {
      std::vector<bool> free(static_cast<std::size_t>(n));
      VectorXd q = from;
      for (int j = 0; j < n; ++j) {
        free[static_cast<std::size_t>(j)] = (still >> j & 1u) == 0;
        if (!free[static_cast<std::size_t>(j)]) q[j] = problem_.start[j];
      }
      if (solve_end_posture(model_.machine, problem_.limits, goal, free, q)) add(q);
    }
  }
  // Goal configurations at given values of each joint.
  for (const VectorXd& from : starts) {
    for (int j = 0; j < n; ++j) {
      const Range& r = problem_.limits.position[static_cast<std::size_t>(j)];
      for (int i = 0; i < kRedundancyCuts; ++i) {
        std::vector<bool> free = all_free;
        free[static_cast<std::size_t>(j)] = false;
        VectorXd q = from;
        q[j] = r.lo + (r.hi - r.lo) * i / (kRedundancyCuts - 1);
        if (solve_end_posture(model_.machine, problem_.limits, goal, free, q)) add(q);
      }
    }
  }
}

void BaselineSet::make_sequences() {
  const Machine& machine = model_.machine;
  Chain chain(model_);
  LimitRatios ratios(problem_);
  std::unique_ptr<ClearanceModel> clearance;
  if (!problem_.obstacles.empty()) clearance = std::make_unique<ClearanceModel>(problem_);
  no_sequence_ =
      ends_.empty() ? "no goal configuration was found" : "every order meets an obstacle";
  std::map<std::vector<int>, std::vector<SequenceEstimate>> by_order;
  for (std::size_t e = 0; e < ends_.size(); ++e) {
    std::vector<int> order;
    for (int j = 0; j < machine.joint_count(); ++j) {
      if (std::abs(ends_[e][j] - problem_.start[j]) > kStill) order.push_back(j);
    }
    if (order.empty() || order.size() > kMostLegs) continue;
    do {
      SequenceEstimate s{order, e, {}};
      VectorXd q = problem_.start;
      bool clear = true;
      for (const int j : order) {
        const LegEstimate leg = estimate_leg(problem_, chain, ratios, {q, j, ends_[e][j]});
        s.sum.energy += leg.energy;
        s.sum.shortest += leg.shortest;
        VectorXd next = q;
        next[j] = ends_[e][j];
        clear = clear && (!clearance || clearance->motion_clear(q.data(), next.data()));
        q = next;
        if (!clear) break;
      }
      if (clear) by_order[order].push_back(s);
    } while (std::next_permutation(order.begin(), order.end()));
  }
  // Of each order the cheapest goal configurations are kept, and the one reached in the shortest time.
  std::vector<std::vector<SequenceEstimate>> kept;
  for (auto& [order, all] : by_order) {
    const auto soonest = *std::min_element(
        all.begin(), all.end(), [](const SequenceEstimate& a, const SequenceEstimate& b) {
          return a.sum.shortest < b.sum.shortest;
        });
    std::sort(all.begin(), all.end(), [](const SequenceEstimate& a, const SequenceEstimate& b) {
      return a.sum.energy < b.sum.energy;
    });
    if (all.size() > kEndsOfAnOrder - 1) all.resize(kEndsOfAnOrder - 1);
    if (std::none_of(all.begin(), all.end(),
                     [&](const SequenceEstimate& s) { return s.end == soonest.end; }))
      all.push_back(soonest);
    kept.push_back(all);
  }
  std::sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) {
    return a.front().sum.energy < b.front().sum.energy;
  });
  if (kept.size() > static_cast<std::size_t>(options_.most_orders))
    kept.resize(static_cast<std::size_t>(options_.most_orders));
  TimingOptions timing;
  timing.intervals = kLegIntervals;
  for (const auto& of_order : kept) {
    for (const SequenceEstimate& s : of_order) {
      DrivenPath path;
      VectorXd q = problem_.start;
      bool driven = true;
      for (const int j : s.order) {
        VectorXd next = q;
        next[j] = ends_[s.end][j];
        Eigen::MatrixXd line(2, q.size());
        line << q.transpose(), next.transpose();
        const TimedMotion leg = time_parametrise(problem_, line, 0.0, timing);
        driven = driven && leg.status == TimingStatus::kOk && leg.motion.size() > 1;
        if (!driven) break;
        path.legs.push_back(leg.motion);
        path.joints.push_back(j);
        path.shortest += leg.motion.duration();
        path.detail +=
            (path.detail.empty() ? "" : ", ") + machine.joints[static_cast<std::size_t>(j)].name;
        q = next;
      }
      if (driven) sequences_.push_back(std::move(path));
    }
  }
}

std::vector<BaselineMotion> BaselineSet::sequences_at(double duration, int polished_count,
                                                      bool only_best) const {
  // Of each order the cheapest goal configuration is kept.
  std::map<std::string, std::pair<BaselineMotion, const DrivenPath*>> best;
  for (const DrivenPath& path : sequences_) {
    BaselineMotion m = timed(kSequential, path, duration);
    if (m.found()) {
      m.energy = exact_energy(model_, problem_, m.motion, 4);
    }
    const auto [at, first] = best.try_emplace(path.detail, m, &path);
    if (first) continue;
    BaselineMotion& known = at->second.first;
    const double shortest = std::min(known.shortest, m.shortest);
    const bool better = m.found() ? !known.found() || m.energy.total < known.energy.total
                                  : !known.found() && m.shortest < known.shortest;
    if (better) at->second = {m, &path};
    at->second.first.shortest = shortest;
  }
  std::vector<std::pair<BaselineMotion, const DrivenPath*>> all;
  all.reserve(best.size());
  for (auto& [order, entry] : best) all.push_back(std::move(entry));
  const auto cheaper = [](const auto& a, const auto& b) {
    if (a.first.found() != b.first.found()) return a.first.found();
    return a.first.found() ? a.first.energy.total < b.first.energy.total
                           : a.first.shortest < b.first.shortest;
  };
  std::stable_sort(all.begin(), all.end(), cheaper);
  int left = polished_count;
  bool kept_one = false;
  for (auto& [m, path] : all) {
    if (!m.found()) continue;
    if (only_best && kept_one && left <= 0) {
      // It costs more than the motion that is kept, and its limits were not checked.
      m.motion = Trajectory{};
      m.why = "costs more than another order";
      continue;
    }
    const std::vector<LimitCheck> checks =
        check_limits(model_, problem_, m.motion, options_.optimize.refine);
    if (worst_excess(checks) > options_.limit_tolerance) {
      const LimitCheck& c = checks.front();
      m.why = fmt::format("{} at t={:.2f} s: {:.4g} against {:.4g} {}", c.what, c.time, c.value,
                          c.limit, c.unit);
      m.motion = Trajectory{};
      continue;
    }
    kept_one = true;
    m.energy = exact_energy(model_, problem_, m.motion, options_.optimize.refine);
    if (left-- > 0) m = polished(m, *path);
  }
  std::stable_sort(all.begin(), all.end(), cheaper);
  std::vector<BaselineMotion> motions;
  motions.reserve(all.size());
  for (auto& entry : all) motions.push_back(std::move(entry.first));
  return motions;
}

BaselineMotion BaselineSet::polished(const BaselineMotion& from, const DrivenPath& path) const {
  ModeCandidate candidate;
  candidate.name = "sequential: " + path.detail;
  candidate.guess = from.motion;
  candidate.energy = from.energy.total;
  candidate.modes = ModeTable::Constant(from.motion.size() - 1, model_.machine.cylinder_count(),
                                        CylinderMode::kRest);
  Eigen::Index at = 0;  // first interval of the leg
  for (std::size_t i = 0; i < path.legs.size(); ++i) {
    const Trajectory& leg = path.legs[i];
    const int joint = path.joints[i], c = model_.machine.cylinder_of_joint(joint);
    if (c >= 0) {
      const double first = leg.q(0, joint), last = leg.q(leg.size() - 1, joint);
      const double rate = linkage_rates(model_.machine, c, 0.5 * (first + last)).d1;
      const bool extends = (last > first) == (rate > 0.0);
      candidate.modes.col(c)
          .segment(at, leg.size() - 1)
          .setConstant(extends ? CylinderMode::kExtend : CylinderMode::kRetract);
    }
    at += leg.size() - 1;
  }
  // Overlaps are not allowed, so the motion stays sequential; the durations of its legs are free.
  OptimizeOptions options = options_.optimize;
  options.overlap = 0.0;
  const StartResult solved = optimize_with_phases(
      model_, problem_,
      {candidate.name, plan_of(candidate.modes, from.motion.t), from.motion, false},
      TimeWindow::fixed(from.duration), options);
  if (!solved.usable(options_.limit_tolerance) || solved.energy_exact >= from.energy.total)
    return from;
  BaselineMotion better = from;
  better.motion = solved.motion;
  better.energy = exact_energy(model_, problem_, solved.motion, options_.optimize.refine);
  return better;
}

}  // namespace sparflow
