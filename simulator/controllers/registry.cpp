#include "simulator/controllers/registry.h"

#include <array>

namespace sparflow::control {

std::span<const ControllerInfo> controllers() {
  static const std::array all = {
      sequential_operator_info(),
      simultaneous_operator_info(),
      joint_pi_info(),
      tip_rate_info(),
      energy_tip_rate_info(),
      tracked_optimum_info(),
      replanned_optimum_info(),
  };
  return all;
}

const ControllerInfo* find_controller(std::string_view name) {
  for (const ControllerInfo& info : controllers())
    if (info.name == name) return &info;
  return nullptr;
}

std::vector<std::string> controller_names() {
  std::vector<std::string> names;
  for (const ControllerInfo& info : controllers()) names.emplace_back(info.name);
  return names;
}

std::unique_ptr<Controller> make_controller(const ControllerInfo& info,
                                            const Knowledge& knowledge) {
  std::vector<double> gains;
  for (const Gain& g : info.gains) gains.push_back(g.value);
  return info.make(knowledge, gains);
}

}  // namespace sparflow::control
