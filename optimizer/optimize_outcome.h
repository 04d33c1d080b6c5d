#pragma once
/// What is made of a search's starts: which one wins, what the seeds would cost, why nothing was found.
#include <vector>

#include "optimizer/optimize.h"

namespace sparflow {

/// Two starts that ended in the same motion: all joints within a thousandth of their range at all of a's knots.
bool same_motion(const MotionProblem& problem, const Trajectory& a, const Trajectory& b);

/// The shortest time a seed path takes within all limits; 0 when none does. [s]
double shortest_seed(const std::vector<SeedMotion>& seeds);

/// Starts from the cheapest on: those that keep all limits, each motion once.
std::vector<int> ranking(const OptimizeResult& result, double limit_tolerance);

/// What the seeds themselves cost, driven in the result's time, where they keep the limits in it.
void set_baselines(const CraneModel& model, const MotionProblem& problem,
                   const std::vector<SeedMotion>& seeds, int refine, OptimizeResult& result);

/// The start nearest to keeping every limit; null when none came to a motion.
const StartResult* nearest_start(const OptimizeResult& result);

/// Names the worst constraint, where and when, and the shortest feasible duration known.
/// @param result with the checks of its nearest motion, if there is one
void say_why_infeasible(const MotionProblem& problem, const std::vector<SeedMotion>& seeds,
                        double duration, OptimizeResult& result);

}  // namespace sparflow
