#pragma once
/// Seed paths of the planners as timed motions, as `sparflow optimize` uses them.
#include <cstdint>
#include <vector>

#include "optimizer/solve/optimize.h"
#include "planners/seed_paths.h"

namespace sparflow::bench {

/// @param most largest number of paths  @param intervals of a motion's mesh  @param seed of the planners' random numbers
/// @param planned if not null, set to the planner's result: the number of paths, or why there is none
std::vector<SeedMotion> planned_seeds(const MotionProblem& problem, int most, int intervals,
                                      std::uint64_t seed = 1, SeedResult* planned = nullptr);

}  // namespace sparflow::bench
