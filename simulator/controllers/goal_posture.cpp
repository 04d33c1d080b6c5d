#include "simulator/controllers/goal_posture.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/controllers/inverse_kinematics.h"

namespace sparflow::control {
namespace {

/// Joints that take part in a lattice of postures.
/// @threshold [joints] 1..10; numerical: three to this power are searches
constexpr int kLatticeJoints = 5;

/// Postures with each driven joint in the lower part, middle and upper part of its range.
std::vector<Eigen::VectorXd> lattice(const Machine& machine, const Eigen::VectorXd& from) {
  const Eigen::VectorXd range = driven_ranges(machine);
  std::vector<Eigen::VectorXd> postures = {from};
  int joints = 0;
  for (Eigen::Index k = 0; k < range.size() && joints < kLatticeJoints; ++k) {
    if (range[k] <= 0.0) continue;
    ++joints;
    std::vector<Eigen::VectorXd> next;
    for (const Eigen::VectorXd& q : postures) {
      for (const double share : {0.2, 0.5, 0.8}) {
        next.push_back(q);
        next.back()[k] = machine.joints[static_cast<std::size_t>(k)].position.lo + share * range[k];
      }
    }
    postures = std::move(next);
  }
  return postures;
}

}  // namespace

Eigen::VectorXd goal_posture(const Machine& machine, const Task& task,
                             const Eigen::VectorXd& from) {
  if (task.q) return *task.q;
  const double within = 0.5 * task.tolerance;
  if (const auto q = posture_with_tip(machine, from, task.tip, within)) return *q;
  // from there the search may end at the joints' ranges, as behind a slewing column; then the nearest of others is taken
  const Eigen::VectorXd range = driven_ranges(machine);
  std::optional<Eigen::VectorXd> nearest;
  double least = 0.0;
  for (const Eigen::VectorXd& begin : lattice(machine, from)) {
    const auto q = posture_with_tip(machine, begin, task.tip, within);
    if (!q) continue;
    double way = 0.0;
    for (Eigen::Index k = 0; k < range.size(); ++k)
      if (range[k] > 0.0) way += std::pow(((*q)[k] - from[k]) / range[k], 2);
    if (nearest && way >= least) continue;
    nearest = q;
    least = way;
  }
  if (!nearest)
    throw ControllerFailure("no posture within the joints' ranges was found for the goal");
  return *nearest;
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
