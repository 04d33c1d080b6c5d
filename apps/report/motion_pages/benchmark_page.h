#pragma once
/// The page of `benchmark`: controllers compared over scenarios, and one scenario in detail with the machines side by side.
#include <string>
#include <utility>
#include <vector>

#include "apps/report/page/page.h"

namespace sparflow {

/// One controller over all scenarios. Energies in kJ, relative differences in %; NaN where nothing is known.
struct BenchmarkedController {
  std::string name, words;
  double runs = 0, failed = 0, rank = 0, energy_kJ = 0, time_s = 0;
  double tip_path_mm = 0, tip_end_mm = 0, sway_deg = 0, roughness = 0, limits = 0;
  double step_median_ms = 0, step_worst_ms = 0;
  double above = 0, above_lower = 0, above_upper = 0, pairs = 0;  ///< [%] over the reference
  double dearer = 0;                                              ///< [%] of the scenarios
  double above_promise = 0, above_bound = 0;                      ///< [%]
  Eigen::VectorXd scenario_energy, scenario_time;  ///< [kJ], [s] by run that was done
  Eigen::VectorXd reference_energy;  ///< [kJ] of the reference in the same scenario, NaN: none
};

/// A place where energy of a run went.
struct EnergyPlace {
  std::string name, group;  ///< in words; group "" for what machine and payload gained in height
  double kJ = 0.0;
};

/// One run of the scenario shown.
struct BenchmarkedRun {
  std::string controller;
  Trajectory motion;  ///< true positions
  Eigen::VectorXd t, power_kW, loss_kW;
  std::vector<EnergyPlace> went;  ///< all of the pumps' work, in the same order for every run
};

struct BenchmarkView {
  std::string headline, text, banner;
  std::string reference;
  std::vector<BenchmarkedController> controllers;
  std::vector<std::vector<std::string>> failures;  ///< scenario, controller, seed, reason
  std::string shown;                               ///< scenario in detail; empty: none
  Machine machine;                                 ///< of that scenario
  std::vector<BenchmarkedRun> runs;
  std::vector<std::pair<std::string, std::string>> provenance;
};

Page benchmark_page(const BenchmarkView& view);

}  // namespace sparflow
