#pragma once
/// A small complete model for the tests of the model file.
#include <limits>
#include <string>

#include "models/chain/crane_model.h"
#include "models/files/machine_file.h"

namespace sparflow {

inline const char* small_machine_yaml() {
  return R"(name: lift
joints:
  - {name: arm, type: revolute, parent: base, origin: {xyz: [0, 0, 1]}, axis: [0, -1, 0],
     position: [-0.2, 1.2], velocity: [-0.1, 0.1], acceleration: [-0.3, 0.3]}
tip: {joint: arm, xyz: [3, 0, 0]}
links:
  - {name: arm, joint: arm, mass: 400, cog: [1.5, 0, 0], inertia: 300}
cylinders:
  - name: arm
    joint: arm
    bore: 0.12
    rod: 0.07
    linkage: {type: pins, barrel: {frame: base, xyz: [0.4, 0, -0.4]}, rod: {frame: arm, xyz: [0.7, 0, -0.1]}}
pumps:
  - {name: main, feeds: [arm], max_flow_lpm: 60, max_pressure_bar: 250, standby_bar: 20}
valves:
  - {cylinder: arm, max_flow_lpm: {extend: 50, retract: 30}}
)";
}

/// Numbers that no short decimal can hold, so that a lossy writer shows.
inline CraneModel small_model() {
  CraneModel model = CraneModel::untrained(parse_machine(small_machine_yaml(), "lift.yaml", ""));
  GpParameters p;
  p.length_flow = 1e-3 / 3.0;
  p.length_force = 1e5 / 7.0;
  p.signal_std = 1e6 / 3.0;
  p.noise_std = 8e4 / 3.0;
  p.mean_constant = -1e5 / 9.0;
  p.mean_slope = 1e2 / 3.0;
  p.flow = Eigen::ArrayXd::LinSpaced(4, 1e-5, 1e-3) / 3.0;
  p.force = Eigen::ArrayXd::LinSpaced(4, 1e4, 9e4) / 7.0;
  p.weight = Eigen::ArrayXd::LinSpaced(4, -1e-6, 1e-6) / 3.0;
  p.variance_core = Eigen::MatrixXd::Identity(6, 6) / 3e12;
  p.variance_core(1, 0) = p.variance_core(0, 1) = 1e-13 / 7.0;
  p.flow_min = 1e-5 / 3.0;
  p.flow_max = 1e-3 / 3.0;
  p.force_min = 1e4 / 7.0;
  p.force_max = 9e4 / 7.0;
  p.data_count = 1234;
  p.corner = {-1e6 / 3.0, 1e9 / 7.0, 1e2 / 9.0};
  p.beyond = {1, 1e2 / 3.0, 1e5 / 7.0, 1e2 / 7.0, 1e1 / 3.0, 1e5 / 9.0};
  model.cylinders[0].extend = GaussianProcess(p);
  model.cylinders[0].margin = 1.5e6 / 7.0;
  model.cylinders[0].valve_gain_extend = 8e-4 / 3.0;
  model.cylinders[0].valve_gain_retract = 5e-4 / 3.0;
  model.pumps[0].standby = 2.2e6 / 7.0;
  model.data.push_back({"train.csv", std::string(64, 'a'), 12000, "train"});
  model.quality.push_back({"pressure", "arm extend", "train", 0.8 / 3.0, "bar", 97.1, 400});
  model.quality.push_back(
      {"pump", "main", "train", 0.0, "bar", std::numeric_limits<double>::quiet_NaN(), 400});
  return model;
}

}  // namespace sparflow
