#pragma once
/// One reach near its shortest time: the shortest time, and the energy at a multiple of it, found with default settings
/// and with more extensive searches.
#include <string>
#include <vector>

#include "studies/reach_tasks.h"

namespace sparflow::bench {

struct ShortTimeSettings {
  double factor = 1.2;  ///< [-] duration of the energies, as a multiple of the shortest time known
  int paths = 48;       ///< seed paths of an extensive search
  int paths_beside_obstacles = 12;
  int intervals = 150;  ///< mesh intervals of an extensive search; beside obstacles as by default
  int seeds = 2;        ///< number of extensive searches, each with random paths of its own
  int grid_nodes =
      60000;  ///< of the joint grid whose cheapest path is driven without further optimisation
  bool bounds = true;  ///< estimated lower bounds
};

/// Result of one search.
struct ShortTimeFound {
  std::string search;
  double value = 0.0;    ///< [s] or [J]; 0 = nothing
  double seconds = 0.0;  ///< [s] wall time of the search
  std::string from;      ///< the best start
};

struct ShortTimeFigures {
  std::vector<ShortTimeFound> times;  ///< shortest times [s]; the first by default settings
  std::vector<ShortTimeFound>
      energies;                 ///< energies at `duration` [J]; the first by default settings
  double duration = 0.0;        ///< [s]
  double least_duration = 0.0;  ///< [s] estimated lower bound, 0 = none
  double least_energy = 0.0;    ///< [J] estimated lower bound in `duration`, 0 = none
};

/// Name of the search on a joint grid, whose path is driven without further optimisation.
inline constexpr const char* kDynamicProgramming = "dynamic programming";

/// Returns the least value found, 0 when there is none.
double best_of(const std::vector<ShortTimeFound>& found);

/// Runs all searches of one reach.
ShortTimeFigures short_time_of(const ReachTask& task, const ShortTimeSettings& settings);

/// Serialise figures for the pipe of a child process.
std::string pack_short_time(const ShortTimeFigures& f);
ShortTimeFigures unpack_short_time(const std::string& bytes);

}  // namespace sparflow::bench
