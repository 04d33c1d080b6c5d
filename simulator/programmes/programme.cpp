#include "simulator/programmes/programme.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"

namespace sparflow::plant {

LeverMap::LeverMap(const Machine& machine, const PlantParameters& parameters)
    : machine_(machine), parameters_(parameters) {}

double LeverMap::lever(int cylinder, double speed) const {
  const auto c = static_cast<std::size_t>(cylinder);
  const Cylinder& drive = machine_.cylinders[c];
  if (speed == 0.0) return 0.0;
  const double share = std::abs(speed) / fastest(cylinder, speed > 0.0);
  if (!drive.hydraulic()) return std::copysign(std::min(share, 1.0), speed);
  const SpoolParameters& spool = parameters_.cylinders[c].spool;
  const double band = speed > 0.0 ? spool.dead_band_extend : spool.dead_band_retract;
  // what a small lever must do beyond the dead band, so that a slow reference does not rattle over it
  const double opened = std::min(1.0, share / 0.01);
  return std::copysign(std::clamp(band * opened + (1.0 - band) * share, 0.0, 1.0), speed);
}

double LeverMap::fastest(int cylinder, bool extend) const {
  const auto c = static_cast<std::size_t>(cylinder);
  const Cylinder& drive = machine_.cylinders[c];
  if (!drive.hydraulic()) {
    const Joint& joint = machine_.joints[static_cast<std::size_t>(drive.joint)];
    const double middle = 0.5 * (joint.position.lo + joint.position.hi);
    return std::max(joint.velocity.hi, -joint.velocity.lo) *
           std::abs(linkage_rates(machine_, cylinder, middle).d1);
  }
  const CylinderParameters& p = parameters_.cylinders[c];
  return extend ? p.max_flow_extend / drive.area_piston() : p.max_flow_retract / drive.area_rod();
}

std::vector<double> follow(const LeverMap& levers, const Record& measured, const Eigen::VectorXd& q,
                           const Eigen::VectorXd& qd, const FollowerOptions& options) {
  const Machine& machine = levers.machine();
  std::vector<double> command(machine.cylinders.size(), 0.0);
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const int j = machine.cylinders[static_cast<std::size_t>(c)].joint;
    const Taylor3 wanted = linkage_rates(machine, c, q[j]);
    const double error =
        wanted.value - cylinder_length(machine, c, measured.q[static_cast<std::size_t>(j)]);
    if (qd[j] == 0.0 && std::abs(error) < options.rest) continue;
    command[static_cast<std::size_t>(c)] =
        levers.lever(c, wanted.d1 * qd[j] + options.gain * error);
  }
  return command;
}

}  // namespace sparflow::plant
