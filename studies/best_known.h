#pragma once
/// Files that a run of the problem set writes.
#include <string>
#include <vector>

#include "studies/reach_figures.h"

namespace sparflow::bench {

/// Writes energies and times of all strategies and the bounds, by problem; ReachSettings::optima reads them back.
void write_optima(const std::string& path, const std::vector<ReachTask>& tasks,
                  const std::vector<ReachFigures>& figures);

/// Updates the best known energies: an entry is replaced by a lower energy; otherwise only a larger bound for the same
/// duration and a shorter shortest time are taken over. Each entry names the model (file and SHA-256 of its bytes) and
/// the program that found it; entries found with another model are dropped.
void write_best_known(const std::string& path, const std::vector<ReachTask>& tasks,
                      const std::vector<ReachFigures>& figures);

}  // namespace sparflow::bench
