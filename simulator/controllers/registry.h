#pragma once
/// The controllers that come with the program: one line each in registry.cpp, which the verb, its help and the study of the
/// gains read.
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "simulator/controllers/controller.h"

namespace sparflow::control {

/// A number of a controller that tuning may change.
struct Gain {
  std::string_view name, unit;
  double value;            ///< as tuned
  double lowest, highest;  ///< of the search
};

struct ControllerInfo {
  std::string_view name;   ///< "joint_pi"
  std::string_view words;  ///< "joint PI with velocity feed-forward"
  std::vector<Gain> gains;
  bool needs_model = false;   ///< of the power, or of optimal motions
  bool needs_motion = false;  ///< an energy-optimal motion is computed before the run
  /// @param gains in the order above
  std::unique_ptr<Controller> (*make)(const Knowledge& knowledge, std::span<const double> gains);
};

/// A controller of type T, for ControllerInfo::make.
template <class T>
std::unique_ptr<Controller> made(const Knowledge& knowledge, std::span<const double> gains) {
  return std::make_unique<T>(knowledge, gains);
}

std::span<const ControllerInfo> controllers();
/// Null when there is none of that name.
const ControllerInfo* find_controller(std::string_view name);
std::vector<std::string> controller_names();
/// With the tuned gains.
std::unique_ptr<Controller> make_controller(const ControllerInfo& info, const Knowledge& knowledge);

// One factory and one entry each, in the file of the controller.
ControllerInfo sequential_operator_info();
ControllerInfo simultaneous_operator_info();
ControllerInfo joint_pi_info();
ControllerInfo tip_rate_info();
ControllerInfo energy_tip_rate_info();
ControllerInfo tracked_optimum_info();
ControllerInfo replanned_optimum_info();

}  // namespace sparflow::control
