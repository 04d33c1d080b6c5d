#pragma once
/// Output of the problem set: one line for each reach, then a summary.
#include <vector>

#include "studies/reach_figures.h"

namespace sparflow::bench {

/// Prints one line for a reach as soon as it is finished, since all of them take an hour; nothing for one left out.
void print_reach(const ReachTask& task, const ReachFigures& figures);

/// Prints counts and distributions over all reaches. @param figures in the order of the tasks
void print_summary(const std::vector<ReachTask>& tasks, const std::vector<ReachFigures>& figures);

/// Prints the gap to the bound by the reach's duration as a multiple of the shortest time.
void print_gap_by_time(const std::vector<ReachTask>& tasks,
                       const std::vector<ReachFigures>& figures);

}  // namespace sparflow::bench
