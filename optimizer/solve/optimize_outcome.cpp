#include "optimizer/solve/optimize_outcome.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "optimizer/solve/child_processes.h"
#include "optimizer/solve/start_bytes.h"

namespace sparflow {

bool same_motion(const MotionProblem& problem, const Trajectory& a, const Trajectory& b) {
  if (a.size() < 2 || b.size() < 2) return false;
  /// Relative difference of durations from which motions differ.
  /// @threshold [1] 0..0.1; chosen: ten times the mesh error
  constexpr double kSameDuration = 1e-3;
  if (std::abs(a.duration() - b.duration()) > kSameDuration * a.duration()) return false;
  const Eigen::MatrixXd other = resampled(b, a.t).q;
  /// Difference of a joint's position, as share of its range, from which motions differ.
  /// @threshold [1] 0..0.1; chosen: ten times the mesh error
  constexpr double kSamePosition = 1e-3;
  for (Eigen::Index j = 0; j < a.q.cols(); ++j) {
    const Range& r = problem.limits.position[static_cast<std::size_t>(j)];
    if ((a.q.col(j) - other.col(j)).cwiseAbs().maxCoeff() > kSamePosition * (r.hi - r.lo))
      return false;
  }
  return true;
}

void solve_starts(const StartJobs& jobs, const MotionProblem& problem, int processes,
                  const WorkProgress& progress, OptimizeResult& result) {
  const std::vector<ChildResult> children = run_in_children(
      jobs.count, processes, [&](int i) { return pack_start(jobs.start(i)); },
      [&](int index, int finished, const ChildResult&) {
        if (progress) progress(static_cast<double>(finished) / jobs.count, jobs.name(index));
      });
  for (int i = 0; i < jobs.count; ++i) {
    const ChildResult& child = children[static_cast<std::size_t>(i)];
    StartResult r;
    if (child.ok) {
      r = unpack_start(child.bytes);
      // A solve of the search is not one to the tolerance of results.
      r.solved = r.converged;
      r.converged = r.converged && jobs.last;
    } else {
      r.seed = jobs.name(i);
      r.message = child.error;
      r.duration = jobs.duration;
    }
    for (std::size_t k = 0; k < result.starts.size() && r.same_as < 0; ++k) {
      if (same_motion(problem, r.motion, result.starts[k].motion)) r.same_as = static_cast<int>(k);
    }
    result.starts.push_back(std::move(r));
  }
}

double shortest_seed(const std::vector<SeedMotion>& seeds) {
  double shortest = 0.0;
  for (const SeedMotion& s : seeds) {
    if (s.shortest_duration > 0.0 && (shortest == 0.0 || s.shortest_duration < shortest))
      shortest = s.shortest_duration;
  }
  return shortest;
}

std::vector<int> ranking(const OptimizeResult& result, double limit_tolerance) {
  std::vector<int> kept;
  for (std::size_t i = 0; i < result.starts.size(); ++i) {
    if (result.starts[i].usable(limit_tolerance)) kept.push_back(static_cast<int>(i));
  }
  std::stable_sort(kept.begin(), kept.end(), [&](int x, int y) {
    return result.starts[static_cast<std::size_t>(x)].cost <
           result.starts[static_cast<std::size_t>(y)].cost;
  });
  return kept;
}

int best_of(const OptimizeResult& result, const std::vector<int>& ranked) {
  const auto start = [&](int i) -> const StartResult& {
    return result.starts[static_cast<std::size_t>(i)];
  };
  int best = ranked.front();
  const double most = start(best).cost + kSameCost * std::abs(start(best).cost);
  for (const int i : ranked) {
    if (start(i).cost > most) break;
    const auto rank = [&](int k) { return std::pair{start(k).converged, start(k).motion.size()}; };
    if (rank(i) > rank(best)) best = i;
  }
  return best;
}

void set_baselines(const CraneModel& model, const MotionProblem& problem,
                   const std::vector<SeedMotion>& seeds, int refine, OptimizeResult& result) {
  result.best_seed_energy = result.straight_line_energy = result.nearest_line_energy = 0.0;
  /// Relative excess up to which a seed keeps the limits.
  /// @threshold [1] 0..0.1; chosen: time scaling of a seed on its own mesh: see time_parametrise
  constexpr double kSeedTolerance = 1e-3;
  bool first_line = true;
  for (const SeedMotion& s : seeds) {
    const bool nearest = s.straight_line && first_line;
    if (s.straight_line) first_line = false;
    const Trajectory timed = with_duration(s.motion, result.duration);
    if (worst_excess(check_limits(model, problem, timed, refine)) > kSeedTolerance) continue;
    const double energy = exact_total_energy(model, timed, problem.payload, refine);
    if (result.best_seed_energy == 0.0 || energy < result.best_seed_energy) {
      result.best_seed_energy = energy;
      result.best_seed_name = s.name;
    }
    if (nearest) result.nearest_line_energy = energy;
    if (s.straight_line &&
        (result.straight_line_energy == 0.0 || energy < result.straight_line_energy)) {
      result.straight_line_energy = energy;
      result.straight_line_name = s.name;
    }
  }
}

const StartResult* nearest_start(const OptimizeResult& result) {
  const StartResult* nearest = nullptr;
  for (const StartResult& s : result.starts) {
    if (s.motion.size() > 1 && (nearest == nullptr || s.excess < nearest->excess)) nearest = &s;
  }
  return nearest;
}

const char* to_string(OptimizeStatus status) {
  switch (status) {
    case OptimizeStatus::kOptimal:
      return "optimal";
    case OptimizeStatus::kFeasible:
      return "feasible";
    case OptimizeStatus::kInfeasible:
      return "infeasible";
    case OptimizeStatus::kFailed:
      return "failed";
    case OptimizeStatus::kInterrupted:
      return "interrupted";
  }
  return "failed";
}

namespace {

/// Factor by which the duration would have to grow for this limit to hold, so that velocities, accelerations and flows
/// are comparable. Violated lengths do not depend on the duration.
double stretch_asked(const LimitCheck& c) {
  if (c.excess <= 0.0 || c.limit == 0.0) return 1.0 + std::max(c.excess, 0.0);
  const double ratio = std::abs(c.value / c.limit);
  if (c.what.starts_with("acceleration of")) return std::sqrt(ratio);
  // Among equal factors the flow is named, because it is the cause of too high accelerations of a shortened path.
  return c.what.starts_with("flow") ? 1.01 * ratio : ratio;
}

}  // namespace

const LimitCheck& worst_limit(const std::vector<LimitCheck>& checks) {
  return *std::max_element(
      checks.begin(), checks.end(),
      [](const LimitCheck& x, const LimitCheck& y) { return stretch_asked(x) < stretch_asked(y); });
}

std::string limit_text(const LimitCheck& check) {
  return fmt::format("{} at t={:.2f} s, {:.4g} against a limit of {:.4g} {}", check.what,
                     check.time, check.value, check.limit, check.unit);
}

void say_why_infeasible(const MotionProblem& problem, const std::vector<SeedMotion>& seeds,
                        double duration, OptimizeResult& result) {
  std::string worst;
  if (!result.checks.empty()) {
    worst = fmt::format(" Worst: {}.", limit_text(worst_limit(result.checks)));
  } else if (!result.starts.empty()) {
    worst = " The solver reports: " + result.starts.front().message + ".";
  }
  const double shortest = shortest_seed(seeds);
  std::string remedy;
  if (result.shortest_duration > duration) {
    remedy = fmt::format(" The shortest motion found takes {:.2f} s; {:g} s was asked for.",
                         result.shortest_duration, duration);
  } else if (shortest > duration) {
    remedy = fmt::format(" A seed path keeps all limits in {:.1f} s; {} s was asked for.", shortest,
                         duration);
  }
  result.status = OptimizeStatus::kInfeasible;
  result.message = fmt::format("{}: infeasible.{}{}", problem.name, worst, remedy);
}

}  // namespace sparflow
