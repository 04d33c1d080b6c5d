#include "simulator/controllers/section_valves.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"

namespace sparflow::control {
namespace {

/// Share of the full speed within which the dead band is crossed.
/// @threshold [-] 0..0.1; chosen: a slow motion must not rattle over the dead band
constexpr double kCrossing = 0.01;

}  // namespace

std::vector<ValveSection> sections_of(const Machine& machine) {
  std::vector<ValveSection> sections(machine.cylinders.size());
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const Cylinder& drive = machine.cylinders[static_cast<std::size_t>(c)];
    ValveSection& s = sections[static_cast<std::size_t>(c)];
    if (!drive.hydraulic()) {
      const Joint& joint = machine.joints[static_cast<std::size_t>(drive.joint)];
      const double middle = 0.5 * (joint.position.lo + joint.position.hi);
      s.full_extend = s.full_retract = std::max(joint.velocity.hi, -joint.velocity.lo) *
                                       std::abs(linkage_rates(machine, c, middle).d1);
      continue;
    }
    const int pump = machine.pump_of_cylinder(c);
    double extend = pump >= 0 ? machine.pumps[static_cast<std::size_t>(pump)].max_flow : 0.0;
    double retract = extend;
    for (const Valve& v : machine.valves) {
      if (v.cylinder != c) continue;
      extend = v.max_flow_extend;
      retract = v.max_flow_retract;
    }
    s.full_extend = extend / drive.area_piston();
    s.full_retract = retract / drive.area_rod();
  }
  return sections;
}

double SectionValves::lever(int cylinder, double speed) const {
  if (speed == 0.0) return 0.0;
  const ValveSection& s = sections_[static_cast<std::size_t>(cylinder)];
  const double share = std::abs(speed) / full_speed(cylinder, speed > 0.0);
  const double dead = speed > 0.0 ? s.dead_extend : s.dead_retract;
  const double opened = std::min(1.0, share / kCrossing);
  return std::copysign(std::min(1.0, dead * opened + (1.0 - dead) * share), speed);
}

double SectionValves::full_speed(int cylinder, bool extend) const {
  const ValveSection& s = sections_[static_cast<std::size_t>(cylinder)];
  return extend ? s.full_extend : s.full_retract;
}

}  // namespace sparflow::control
