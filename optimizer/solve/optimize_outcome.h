#pragma once
/// What is made of a search's starts: which one wins, what the seeds would cost, why nothing was found.
#include <string>
#include <vector>

#include "optimizer/solve/optimize.h"

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

/// The limit that is broken worst: the one that asks for the most time. @param checks not empty
const LimitCheck& worst_limit(const std::vector<LimitCheck>& checks);

/// "flow of pump main at t=1.84 s, 134 against a limit of 120 l/min".
std::string limit_text(const LimitCheck& check);

/// Names the worst constraint, where and when, and the shortest feasible duration known.
/// @param result with the checks of its nearest motion, if there is one
void say_why_infeasible(const MotionProblem& problem, const std::vector<SeedMotion>& seeds,
                        double duration, OptimizeResult& result);

}  // namespace sparflow
