#include "optimizer/baselines/move_audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/machine/kinematics.h"
#include "optimizer/solve/optimize_outcome.h"
#include "problems/time_parametrise.h"

namespace sparflow {
namespace {

using Eigen::Index;

/// The same problem with any posture that holds the tip where the recorded motion left it.
MotionProblem to_tip(const MotionProblem& problem) {
  MotionProblem to = problem;
  to.goal = TipGoal{tip_position<double>(problem.machine, std::get<JointGoal>(problem.goal).q)};
  return to;
}

/// Whether other postures hold the tip at the same point.
bool redundant(const Machine& machine) {
  return machine.joint_count() > static_cast<int>(moving_tip_directions(machine).cols());
}

/// @param starts besides those of the options
OptimizeResult solve(const CraneModel& model, const MotionProblem& problem,
                     const MoveAuditOptions& options, const std::vector<SeedMotion>& starts) {
  std::vector<SeedMotion> seeds = options.seeds(problem);
  seeds.insert(seeds.end(), starts.begin(), starts.end());
  if (!seeds.empty()) return optimize(model, problem, seeds, options.optimize);
  OptimizeResult none;
  none.status = OptimizeStatus::kInfeasible;
  none.message = "no path within the machine's limits was found";
  return none;
}

bool has_motion(const OptimizeResult& r) {
  return r.motion.size() > 1 &&
         (r.status == OptimizeStatus::kOptimal || r.status == OptimizeStatus::kFeasible);
}

/// The recorded path at an even pace in the same time; empty where the limits do not allow it.
Trajectory at_even_pace(const MotionProblem& problem, const Trajectory& recorded, int most_rows) {
  /// Least distance of two rows of the path.
  /// @threshold [rad or m] 1e-6..0.01; chosen: noise of a sensor at rest is no way
  constexpr double kLeastStep = 1e-4;
  const Index step = std::max<Index>(1, recorded.size() / most_rows), last = recorded.size() - 1;
  std::vector<Index> rows;
  for (Index k = 0; k < last; k += step) {
    if (rows.empty() || (recorded.q.row(k) - recorded.q.row(rows.back())).norm() > kLeastStep)
      rows.push_back(k);
  }
  rows.push_back(last);
  Eigen::MatrixXd path(static_cast<Index>(rows.size()), recorded.q.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (Index j = 0; j < path.cols(); ++j) {  // the limits hold at its ends; noise may leave them
      const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
      path(static_cast<Index>(i), j) = std::clamp(recorded.q(rows[i], j), r.lo, r.hi);
    }
  }
  TimedMotion timed = time_parametrise(problem, path, recorded.duration());
  return timed.status == TimingStatus::kOk ? std::move(timed.motion) : Trajectory{};
}

/// What the operator did as starts of the search, besides its own: the recorded motion with its modes, and its path at an
/// even pace. Without them the search may miss a way and an order of the cylinders that the operator had found.
std::vector<SeedMotion> recorded_starts(const Trajectory& recorded, const Trajectory& even) {
  std::vector<SeedMotion> starts = {{"recorded", recorded, 0.0, false}};
  if (even.size() > 1) starts.push_back({"recorded path, even pace", even, 0.0, false});
  return starts;
}

std::string why_no_optimum(const OptimizeResult& r, double duration) {
  if (r.shortest_duration > duration)
    return fmt::format(
        "It took {:.1f} s; within the limits of machine file and model it takes {:.1f} s.",
        duration, r.shortest_duration);
  return "No optimum was found: " + r.message;
}

/// Where the recorded motion takes less than the optimum that was found: with all limits kept it is the better optimum; with
/// one broken the two cannot be compared, and the move is not judged. Accelerations do not count, as those of a recording are
/// differences of smoothed positions.
void keep_cheaper_record(const CraneModel& model, const Trajectory& recorded,
                         const MotionLimits& machine_limits, const MoveAuditOptions& options,
                         MoveAudit& audit) {
  if (audit.recorded.total >= audit.optimum.total) return;
  MotionProblem problem = audit.problem;
  problem.limits = machine_limits;
  for (Index j = 0; j < recorded.q.cols(); ++j) {
    Range& a = problem.limits.acceleration[static_cast<std::size_t>(j)];
    a.lo = std::min(a.lo, recorded.qdd.col(j).minCoeff());
    a.hi = std::max(a.hi, recorded.qdd.col(j).maxCoeff());
  }
  const std::vector<LimitCheck> checks = check_limits(model, problem, recorded, 1);
  if (worst_excess(checks) <= options.limit_tolerance) {
    audit.best = recorded;
    audit.optimum = audit.recorded;
    return;
  }
  if (audit.optimum.total - audit.recorded.total <= options.as_cheap * audit.recorded.total) return;
  audit.not_judged = fmt::format(
      "Its recording takes less than any motion within the limits of machine file and model: {}.",
      limit_text(worst_limit(checks)));
}

}  // namespace

double MoveAudit::saving_std() const {
  return std::hypot(recorded.pressure_uncertainty, optimum.pressure_uncertainty);
}

MotionProblem audit_problem(const Machine& machine, const Trajectory& recorded, double payload) {
  MotionProblem problem;
  problem.machine = machine;
  problem.limits = limits_of(machine);
  problem.payload = payload;
  const Index last = recorded.size() - 1;
  for (Index j = 0; j < recorded.q.cols(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    Range &q = problem.limits.position[i], &qd = problem.limits.velocity[i];
    for (const Index k : {Index{0}, last}) {
      q.lo = std::min(q.lo, recorded.q(k, j));
      q.hi = std::max(q.hi, recorded.q(k, j));
    }
    qd.lo = std::min(qd.lo, recorded.qd.col(j).minCoeff());
    qd.hi = std::max(qd.hi, recorded.qd.col(j).maxCoeff());
  }
  problem.start = recorded.q.row(0).transpose();
  problem.goal = JointGoal{recorded.q.row(last).transpose()};
  problem.duration = {recorded.duration(), recorded.duration()};
  return problem;
}

PumpTrace pumps_along(const CraneModel& model, const Trajectory& motion, double payload) {
  Chain chain(model);
  PumpTrace trace;
  trace.t = motion.t;
  trace.flow.resize(motion.size(), static_cast<Index>(model.machine.pumps.size()));
  trace.pressure.resize(motion.size(), trace.flow.cols());
  for (Index k = 0; k < motion.size(); ++k) {
    const Eigen::VectorXd q = motion.q.row(k), qd = motion.qd.row(k), qdd = motion.qdd.row(k);
    const MachineState& s = chain.evaluate({q.data(), qd.data(), qdd.data()}, payload);
    for (Index p = 0; p < trace.flow.cols(); ++p) {
      const PumpState& pump = s.pumps[static_cast<std::size_t>(p)];
      trace.flow(k, p) = pump.flow;
      trace.pressure(k, p) = pump.pressure;
    }
  }
  return trace;
}

MoveAudit audit_move(const CraneModel& model, const Trajectory& recorded, double payload,
                     const MoveAuditOptions& options) {
  MoveAudit audit;
  audit.problem = audit_problem(model.machine, recorded, payload);
  const MotionLimits machine_limits = audit.problem.limits;
  if (options.narrow) options.narrow(recorded, audit.problem.limits);
  audit.recorded = exact_energy(model, audit.problem, recorded, 1);
  if (audit.recorded.moving_share_outside_data > options.most_outside) {
    audit.not_judged = fmt::format(
        "{:.0f} % of its moving time lies outside the flows and forces that the model has learned.",
        100.0 * audit.recorded.moving_share_outside_data);
    return audit;
  }
  if (audit.recorded.impossible()) {
    audit.not_judged = "By the model the pumps give it less than machine and load gain.";
    return audit;
  }
  const Trajectory even = at_even_pace(audit.problem, recorded, options.path_rows);
  const std::vector<SeedMotion> starts = recorded_starts(recorded, even);
  const OptimizeResult there = solve(model, audit.problem, options, starts);
  audit.interrupted = there.interrupted;
  if (!has_motion(there)) {
    audit.not_judged = why_no_optimum(there, recorded.duration());
    return audit;
  }
  audit.best = there.motion;
  audit.optimum = there.energy;
  keep_cheaper_record(model, recorded, machine_limits, options, audit);
  if (!audit.judged()) return audit;
  const double paced =
      even.size() < 2
          ? audit.recorded.total
          : std::min(audit.recorded.total, exact_total_energy(model, even, audit.problem.payload));
  audit.by_pace = audit.recorded.total - paced;
  audit.by_way = paced - audit.optimum.total;
  if (!redundant(model.machine) || audit.interrupted) return audit;
  const OptimizeResult free_end =
      solve(model, to_tip(audit.problem), options, {{"fixed end", audit.best, 0.0, false}});
  audit.interrupted = free_end.interrupted;
  if (has_motion(free_end) && free_end.energy.total < audit.optimum.total) {
    audit.by_posture = audit.optimum.total - free_end.energy.total;
    audit.by_posture_potential =
        audit.optimum.potential_difference - free_end.energy.potential_difference;
  }
  return audit;
}

}  // namespace sparflow
