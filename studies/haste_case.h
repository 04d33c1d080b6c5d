#pragma once
/// One reach in a hurry: its shortest time, and its energy at a multiple of that, by default settings and by every heavier
/// search there is.
#include <string>
#include <vector>

#include "studies/reach_tasks.h"

namespace sparflow::bench {

struct HasteSettings {
  double factor = 1.2;  ///< of the shortest time known, for the energies
  int paths = 48;       ///< seed paths of a heavy search
  int paths_beside_obstacles = 12;
  int intervals = 150;     ///< of its mesh; beside obstacles that of the default
  int seeds = 2;           ///< heavy searches, each with random paths of its own
  int grid_nodes = 60000;  ///< of the dynamic programming whose path is driven as it is
  bool bounds = true;      ///< certified lower bounds
};

/// What one search came to.
struct HasteFound {
  std::string search;
  double value = 0.0;    ///< [s] or [J]; 0 = nothing
  double seconds = 0.0;  ///< it took
  std::string from;      ///< the start that won
};

struct HasteFigures {
  std::vector<HasteFound> times;     ///< shortest times [s]; the first by default settings
  std::vector<HasteFound> energies;  ///< energies at `duration` [J]; the first by default settings
  double duration = 0.0;             ///< [s]
  double least_duration = 0.0;       ///< [s] certified, 0 = none
  double least_energy = 0.0;         ///< [J] certified of motions that take `duration`, 0 = none
};

/// The search on a joint grid, its path driven as it is.
inline constexpr const char* kDynamicProgramming = "dynamic programming";

/// The least value found; 0 when there is none.
double best_of(const std::vector<HasteFound>& found);

HasteFigures haste_of(const ReachTask& task, const HasteSettings& settings);

/// Through the pipe of a child process.
std::string pack_haste(const HasteFigures& f);
HasteFigures unpack_haste(const std::string& bytes);

}  // namespace sparflow::bench
