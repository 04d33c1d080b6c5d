#pragma once
/// One row of the benchmark: what a controller did with a scenario. A failure is a row, too, with its reason.
#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "simulator/plant/system/plant_system.h"

namespace sparflow::benchmark {

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// True values over the run, thinned for pictures.
struct Trace {
  std::vector<double> t;               ///< [s]
  std::vector<std::vector<double>> q;  ///< by instant and joint
  std::vector<double> power;           ///< [W] of all pumps into the valves
  std::vector<double> loss;            ///< [W] turned into heat, mean since the instant before
};

struct Row {
  std::string scenario, controller;
  std::uint64_t seed = 0;
  bool done = false;       ///< every goal was reached and held
  std::string reason;      ///< why not, one sentence
  double energy = 0.0;     ///< [J] pumps' pressure times flow into the valves; drives' work
  double pump_work = 0.0;  ///< [J] ideal work of the pumps on their oil
  double useful = 0.0;  ///< [J] gained by machine and payload: stored, less what payloads brought
  std::array<double, plant::kLosses> loss{};                  ///< [J] by place, all cylinders
  double pump_loss = 0.0, tank_loss = 0.0, swing_loss = 0.0;  ///< [J]
  double time = kNotKnown;  ///< [s] sum over the goals until the tip is there to stay
  double ran = 0.0;         ///< [s] of the plant
  double tip_error_path =
      kNotKnown;  ///< [m] RMS from the controller's own path; unknown without one
  double tip_error_end = kNotKnown;  ///< [m] the largest over the goals, when they end
  double sway = kNotKnown;     ///< [rad] of the payload while it is held at a goal, the largest
  double sway_path = 0.0;      ///< [rad] of the payload over the whole run, the largest
  double peak_pressure = 0.0;  ///< [Pa] of all chambers and pumps
  std::vector<std::string> limits;             ///< broken ones, in words
  double roughness = 0.0;                      ///< [1/s] RMS rate of the commands
  double step_median = 0.0, step_worst = 0.0;  ///< [s] the controller's time for a step
  Trace trace;
};

/// As text that row_from() reads back exactly.
std::string packed(const Row& row);
Row row_from(const std::string& text);
/// The keys of `--json` (docs/benchmark.md), without the trace. Ends without a line break.
std::string row_json(const Row& row);
/// A row of the CSV, and its head.
std::string row_csv(const Row& row);
std::string csv_head();

}  // namespace sparflow::benchmark
