#include "simulator/controllers/goal_posture.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/controllers/inverse_kinematics.h"

namespace sparflow::control {

Eigen::VectorXd goal_posture(const Machine& machine, const Task& task,
                             const Eigen::VectorXd& from) {
  if (task.q) return *task.q;
  const std::optional<Eigen::VectorXd> q =
      posture_with_tip(machine, from, task.tip, 0.5 * task.tolerance);
  if (!q) throw ControllerFailure("no posture within the joints' ranges was found for the goal");
  return *q;
}

double least_time(const Knowledge& knowledge, const Eigen::VectorXd& from,
                  const Eigen::VectorXd& to, bool together) {
  const Machine& machine = *knowledge.machine;
  double longest = 0.0, sum = 0.0;
  std::vector<double> volume(machine.pumps.size(), 0.0);
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const Cylinder& drive = machine.cylinders[static_cast<std::size_t>(c)];
    const double way = cylinder_length(machine, c, to[drive.joint]) -
                       cylinder_length(machine, c, from[drive.joint]);
    double time = std::abs(way) / knowledge.valves->full_speed(c, way > 0.0);
    longest = std::max(longest, time);
    const int pump = machine.pump_of_cylinder(c);
    if (pump >= 0 && drive.hydraulic()) {
      const auto p = static_cast<std::size_t>(pump);
      const double oil = std::abs(way) * (way > 0.0 ? drive.area_piston() : drive.area_rod());
      volume[p] += oil;
      time = std::max(time, oil / machine.pumps[p].max_flow);
    }
    sum += time;
  }
  if (!together) return sum;
  for (std::size_t p = 0; p < volume.size(); ++p)
    longest = std::max(longest, volume[p] / machine.pumps[p].max_flow);
  return longest;
}

}  // namespace sparflow::control
