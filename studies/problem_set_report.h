#pragma once
/// What the problem set prints: a line a reach, then what came out in all.
#include <vector>

#include "studies/reach_figures.h"

namespace sparflow::bench {

/// One reach in a line, as soon as it is done, since all of them take an hour; nothing of one left out.
void print_reach(const ReachTask& task, const ReachFigures& figures);

/// Counts and spreads over all reaches. @param figures in the order of the tasks
void print_summary(const std::vector<ReachTask>& tasks, const std::vector<ReachFigures>& figures);

/// The gap to the bound by the reach's time as a multiple of the shortest.
void print_gap_by_time(const std::vector<ReachTask>& tasks,
                       const std::vector<ReachFigures>& figures);

}  // namespace sparflow::bench
