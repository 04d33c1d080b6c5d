#pragma once
/// A piece of work on the dynamic plant that controllers are compared on. Plain data, SI; read by scenario_file.h.
#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow::benchmark {

/// One move from rest to rest, then perhaps a change of payload.
struct ScenarioGoal {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< [m]
  std::optional<Eigen::VectorXd> q;               ///< where the work asks for a posture
  double duration = 10.0;                         ///< [s] in which the tip shall be there
  std::optional<double> payload;                  ///< [kg] from then on
};

struct Scenario {
  std::string id;
  std::string file;                                  ///< as read
  std::string set;                                   ///< "tuning", "test", or empty
  std::string machine_path, plant_path, model_path;  ///< resolved; empty: the file names none
  Machine machine;
  plant::PlantParameters plant;  ///< with the scenario's oil, sensors and effects
  Eigen::VectorXd start;         ///< [rad] or [m]
  double payload = 0.0;          ///< [kg] at the start
  std::vector<ScenarioGoal> goals;
  std::vector<std::uint64_t> seeds = {1};  ///< of the sensors
  double time_limit = 120.0;               ///< [s] of the whole
  double tolerance = 0.08;                 ///< [m] of the tip, within which the work can be done
};

}  // namespace sparflow::benchmark
