#pragma once
/// What the problem set prints: reach by reach, then what came out in all.
#include <vector>

#include "bench/reach_figures.h"

namespace sparflow::bench {

/// Each reach, then counts and spreads. @param figures in the order of the tasks
void print_reaches(const std::vector<ReachTask>& tasks, const std::vector<ReachFigures>& figures);

/// The gap to the bound by the reach's time as a multiple of the shortest.
void print_gap_by_time(const std::vector<ReachTask>& tasks,
                       const std::vector<ReachFigures>& figures);

}  // namespace sparflow::bench
