#pragma once
/// Evaluation of a search's starts: ranking, energies of the seeds, and why nothing was found.
#include <functional>
#include <string>
#include <vector>

#include "optimizer/solve/optimize.h"

namespace sparflow {

/// Relative difference up to which two costs count as equal: a motion of a solve that converged, or on a finer mesh, is then
/// preferred.
/// @threshold [1] 0..1e-3; chosen: OptimizeOptions::mesh_error
inline constexpr double kSameCost = 1e-4;

/// Whether two motions are equal: all joints within a thousandth of their range at all of a's knots.
bool same_motion(const MotionProblem& problem, const Trajectory& a, const Trajectory& b);

/// Starts of one step of a search.
struct StartJobs {
  int count = 0;
  std::function<StartResult(int)> start;  ///< solves one of them, in a child process
  std::function<std::string(int)> name;
  double duration = 0.0;  ///< [s] told for a start whose child failed
  bool last = false;      ///< solved to the tolerance of results; otherwise they are only compared
};

/// Solves all of them and adds them to the result, each with the first start that has the same motion.
void solve_starts(const StartJobs& jobs, const MotionProblem& problem, int processes,
                  const WorkProgress& progress, OptimizeResult& result);

/// Shortest duration in which a seed path keeps all limits; 0 = none does. [s]
double shortest_seed(const std::vector<SeedMotion>& seeds);

/// Indices of the starts that keep all limits, each motion once, by increasing cost.
std::vector<int> ranking(const OptimizeResult& result, double limit_tolerance);

/// The start whose motion is the result: the cheapest within all limits, or one of (nearly) the same cost that converged,
/// on the finest mesh. @param ranked not empty
int best_of(const OptimizeResult& result, const std::vector<int>& ranked);

/// Sets the energies of the seeds in the result's duration, where they keep the limits.
void set_baselines(const CraneModel& model, const MotionProblem& problem,
                   const std::vector<SeedMotion>& seeds, int refine, OptimizeResult& result);

/// The start with the smallest violation; null when no start has a motion.
const StartResult* nearest_start(const OptimizeResult& result);

/// The most violated limit: the one that would need the longest duration. @param checks not empty
const LimitCheck& worst_limit(const std::vector<LimitCheck>& checks);

/// "flow of pump main at t=1.84 s, 134 against a limit of 120 l/min".
std::string limit_text(const LimitCheck& check);

/// Sets the message: the worst violation, where and when, and the shortest feasible duration known.
/// @param result with the checks of the motion with the smallest violation, if there is one
void say_why_infeasible(const MotionProblem& problem, const std::vector<SeedMotion>& seeds,
                        double duration, OptimizeResult& result);

}  // namespace sparflow
