#include "apps/tasks/benchmark/learned_machine.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"

namespace sparflow {

std::vector<control::ValveSection> learned_sections(const CraneModel& model) {
  std::vector<control::ValveSection> sections = control::sections_of(model.machine);
  for (std::size_t c = 0; c < sections.size(); ++c) {
    const Cylinder& drive = model.machine.cylinders[c];
    if (!drive.hydraulic()) continue;
    control::ValveSection& s = sections[c];
    const CylinderModel& learned = model.cylinders[c];
    if (learned.valve_gain_extend > 0.0)
      s.full_extend = learned.valve_gain_extend / drive.area_piston();
    if (learned.valve_gain_retract > 0.0)
      s.full_retract = learned.valve_gain_retract / drive.area_rod();
    for (const AppliedEffect& e : model.effects) {
      if (e.effect->info().id != "valve_deadband" || e.at != static_cast<int>(c)) continue;
      s.dead_extend = e.values[0];
      s.dead_retract = e.values[1];
      // the gain is the slope of the line through zero; with the third value it is kept at full lever (valve_deadband.cpp)
      const bool full = e.values.size() > 2 && e.values[2] >= 0.5;
      if (!full) {
        s.full_extend *= 1.0 - s.dead_extend;
        s.full_retract *= 1.0 - s.dead_retract;
      }
    }
  }
  return sections;
}

void limit_accelerations(const CraneModel& model, const Eigen::VectorXd& q, double ramp,
                         MotionLimits& limits) {
  const std::vector<control::ValveSection> sections = learned_sections(model);
  for (int c = 0; c < model.machine.cylinder_count(); ++c) {
    const auto k = static_cast<std::size_t>(c);
    const int j = model.machine.cylinders[k].joint;
    const double arm = std::abs(linkage_rates(model.machine, c, q[j]).d1);
    if (arm <= 0.0 || ramp <= 0.0) continue;
    const double most = std::min(sections[k].full_extend, sections[k].full_retract) / arm / ramp;
    Range& a = limits.acceleration[static_cast<std::size_t>(j)];
    a = {std::max(a.lo, -most), std::min(a.hi, most)};
  }
}

}  // namespace sparflow
