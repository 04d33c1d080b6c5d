#include "models/effects/hydraulics.h"

#include "models/effects/effect.h"

namespace sparflow {

std::vector<int> hydraulic_cylinders(const Machine& machine) {
  std::vector<int> found;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    if (machine.cylinders[static_cast<std::size_t>(i)].hydraulic()) found.push_back(i);
  }
  return found;
}

std::vector<int> whole_circuit(const Machine& machine) {
  return hydraulic_cylinders(machine).empty() ? std::vector<int>{} : std::vector<int>{-1};
}

std::vector<int> pumps_of_type(const Machine& machine, PumpType type) {
  std::vector<int> found;
  for (int p = 0; p < machine.pump_count(); ++p) {
    if (machine.pumps[static_cast<std::size_t>(p)].type == type) found.push_back(p);
  }
  return found;
}

double rated_flow(const Machine& machine, int cylinder, int side) {
  if (const Valve* valve = machine.valve_of_cylinder(cylinder)) {
    const double full = side > 0 ? valve->max_flow_extend : valve->max_flow_retract;
    if (full > 0.0) return full;
  }
  const int pump = machine.pump_of_cylinder(cylinder);
  const double largest = pump < 0 ? 0.0 : machine.pumps[static_cast<std::size_t>(pump)].max_flow;
  return largest > 0.0 ? largest : 1e-3;
}

Eigen::VectorXd total_return_flow(const MachineSeries& log) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(log.samples());
  for (const int i : hydraulic_cylinders(*log.machine)) {
    sum += log.cylinders[static_cast<std::size_t>(i)].return_flow;
  }
  return sum;
}

Eigen::VectorXd pump_flow(const MachineSeries& log, int pump) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(log.samples());
  for (const int i : log.machine->pumps[static_cast<std::size_t>(pump)].feeds) {
    sum += log.cylinders[static_cast<std::size_t>(i)].flow;
  }
  return sum;
}

Eigen::VectorXd reaching_pump(const MachineSeries& log, int pump, const Eigen::VectorXd& change) {
  const LawOfModel& law = log.pumps[static_cast<std::size_t>(pump)].following;
  if (law.effect == nullptr) return change;
  return law.effect->followed_demand(log, pump, law.at, law.values, change);
}

const Eigen::VectorXd& carried_force(const CylinderSeries& cylinder) {
  return cylinder.force.size() > 0 ? cylinder.force : cylinder.static_force;
}

const Eigen::VectorXd& steady_force(const CylinderSeries& cylinder) {
  return cylinder.steady_force.size() > 0 ? cylinder.steady_force : carried_force(cylinder);
}

int return_side(EvidenceKind kind) {
  if (kind == EvidenceKind::kReturnExtend) return 1;
  return kind == EvidenceKind::kReturnRetract ? -1 : 0;
}

int supply_side(EvidenceKind kind) {
  if (kind == EvidenceKind::kSupplyExtend) return 1;
  return kind == EvidenceKind::kSupplyRetract ? -1 : 0;
}

}  // namespace sparflow
