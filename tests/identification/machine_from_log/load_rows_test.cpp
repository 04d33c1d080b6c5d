/// Which rows of a log count as a static balance with a known direction of friction.
#include "identification/machine_from_log/load_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "identification/log/log.h"
#include "models/files/machine_sketch.h"

namespace sparflow::from_log {
namespace {

constexpr const char* kLift =
    "name: lift\ngravity: [0, 0, -9.81]\njoints:\n"
    "  - {name: lift, type: prismatic, parent: base, axis: [0, 0, 1], position: [0, 1], "
    "velocity: [-0.5, 0.5], acceleration: [-500, 500]}\n"
    "tip: {joint: lift, xyz: [0, 0, 0]}\nlinks:\n"
    "  - {name: cage, joint: lift, mass: unknown, cog: [0, 0, 0]}\ncylinders:\n"
    "  - {name: lift, joint: lift, bore: 0.050, rod: 0.035, linkage: {type: direct}}\n"
    "pumps:\n  - {name: main, type: load_sensing, feeds: [lift], max_flow_lpm: 75, "
    "max_pressure_bar: 250, standby_bar: 20}\nvalves:\n"
    "  - {cylinder: lift, max_flow_lpm: {extend: 29.5, retract: 13.2}}\n";

/// [s] times at which the rod begins or ends to move, at 0.1 m/s between them.
constexpr double kTurns[] = {2.0, 4.0, 6.0, 8.0};

double position_at(double t) {
  return 0.3 + 0.1 * std::clamp(t - kTurns[0], 0.0, 2.0) -
         0.1 * std::clamp(t - kTurns[2], 0.0, 2.0);
}

TEST(LoadRows, WhatASmoothedPressureMixesWithARestDoesNotCount) {
  const MachineSketch sketch = parse_sketch(kLift, "lift.yaml", "");
  std::vector<LogColumn> columns = {
      {"t_s", {}}, {"q_lift_m", {}}, {"pA_lift_bar", {}}, {"pB_lift_bar", {}}};
  for (int k = 0; k < 500; ++k) {
    const double t = 0.02 * k, values[] = {t, position_at(t), 40.0, 5.0};
    for (std::size_t c = 0; c < columns.size(); ++c) columns[c].values.push_back(values[c]);
  }
  const MachineFromLogOptions options;
  const SketchRows rows = sketch_rows(
      sketch.machine, {log_from_columns("lift.csv", columns, sketch.machine)}, {}, options);
  const std::vector<bool> resolved = {true};
  const Known known{sketch, sketch.machine, rows, resolved, options};
  // The smoothed speed is not zero beside a motion; its row is inside by a third of half the shortest window (0.2 s).
  const auto inside = [&](Eigen::Index row) {
    const double t = rows.time[row];
    return (t > kTurns[0] + 0.03 && t < kTurns[1] - 0.03) ||
           (t > kTurns[2] + 0.03 && t < kTurns[3] - 0.03);
  };
  Eigen::Index fast_beside = 0;
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    fast_beside += !inside(k) && std::abs(rows.qd(k, 0)) > options.moving;
  EXPECT_GT(fast_beside, 8);  // their speed alone would count them
  const LoadRows kept = load_rows(known, 0, false);
  EXPECT_GT(kept.rows(), 100);  // of 200 rows in motion
  for (const Eigen::Index row : kept.row) EXPECT_TRUE(inside(row)) << rows.time[row];
}

}  // namespace
}  // namespace sparflow::from_log
