#pragma once
/// What a run of the problem set leaves on disk.
#include <string>
#include <vector>

#include "studies/reach_figures.h"

namespace sparflow::bench {

/// Energies and times of all ways, and the bounds, by problem: ReachSettings::optima reads them back.
void write_optima(const std::string& path, const std::vector<ReachTask>& tasks,
                  const std::vector<ReachFigures>& figures);

/// Best known energies: what the file has, or what was found now where that is less. Where it is not, a larger bound found
/// now for the same time and a shorter shortest time are kept all the same. Each entry names the model (file and SHA-256 of
/// its bytes) and the program that found it; what was found with another model is forgotten.
void write_best_known(const std::string& path, const std::vector<ReachTask>& tasks,
                      const std::vector<ReachFigures>& figures);

}  // namespace sparflow::bench
