#include "simulator/hidden_effects/crane_laws.h"

#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "simulator/hidden_effects/body_forces.h"

namespace sparflow::simulator {
namespace {}  // namespace

CraneLaws draw_crane_laws(const Machine& machine, std::uint64_t crane_seed) {
  Random random(crane_seed, "crane");
  CraneLaws laws;
  for (int i = 0; i < machine.cylinder_count(); ++i) {
    const Cylinder& cylinder = machine.cylinders[static_cast<std::size_t>(i)];
    const Valve* valve = machine.valve_of_cylinder(i);
    CylinderLaws c;
    c.margin = random.uniform(13.0, 25.0) * kBar;
    c.rest_tank = random.uniform(2.2, 3.2) * kBar;
    for (std::size_t d = 0; d < 2; ++d) {
      DirectionLaws& law = c.direction[d];
      const double area = d == 0 ? cylinder.area_piston() : cylinder.area_rod();
      const double other = d == 0 ? cylinder.area_rod() : cylinder.area_piston();
      law.valve_gain = valve ? (d == 0 ? valve->max_flow_extend : valve->max_flow_retract) : 0.0;
      if (law.valve_gain <= 0.0) law.valve_gain = 40.0 * kLpm;
      const double full_return =
          cylinder.hydraulic() ? law.valve_gain * other / area : law.valve_gain;
      law.valve_gain *= random.uniform(0.95, 1.05);
      law.return_offset = random.uniform(2.5, 4.5) * kBar;
      law.return_laminar = random.uniform(0.5, 2.0) * kBar / full_return;
      law.return_orifice = random.uniform(2.0, 6.0) * kBar / (full_return * full_return);
      law.pilot_pressure = random.uniform(32.0, 56.0) * kBar;
      law.pilot_slope = random.uniform(0.17, 0.33);
      law.pilot_flow = random.uniform(0.0, 2.0) * kBar / law.valve_gain;
    }
    laws.cylinders.push_back(c);
  }
  for (const Pump& pump : machine.pumps) {
    const double drawn = random.uniform(0.9, 1.1);
    laws.standby.push_back(pump.type == PumpType::kConstantPressure ? 0.9 * pump.max_pressure
                                                                    : drawn * pump.standby);
  }
  laws.oil_start = random.uniform(22.0, 32.0);
  laws.oil_end = laws.oil_start + random.uniform(24.0, 32.0);
  laws.oil_time = random.uniform(80.0, 140.0);
  laws.operator_deadband_share = random.uniform(0.6, 1.0);
  return laws;
}

double usual_payload(const Machine& machine, std::uint64_t crane_seed) {
  Random random(crane_seed, "payload");
  BodyForces bodies(machine);
  JointLoads empty, loaded;
  std::vector<double> q(machine.joints.size()), allowed;
  constexpr double kProbe =
      100.0;  // [kg] The loads are linear in the payload, so one probe gives the slope.
  for (int posture = 0; posture < 80; ++posture) {
    for (std::size_t k = 0; k < q.size(); ++k)
      q[k] = random.uniform(machine.joints[k].position.lo, machine.joints[k].position.hi);
    bodies.gravity(q.data(), 0.0, empty);
    bodies.gravity(q.data(), kProbe, loaded);
    double most = 4000.0;
    for (int i = 0; i < machine.cylinder_count(); ++i) {
      const Cylinder& c = machine.cylinders[static_cast<std::size_t>(i)];
      const int pump = machine.pump_of_cylinder(i);
      if (!c.hydraulic() || pump < 0) continue;
      const auto j = static_cast<std::size_t>(c.joint);
      const double rate = linkage_rates(machine, i, q[j]).d1;
      const double unloaded = empty.gravity[j] / rate;
      const double per_kg = (loaded.gravity[j] - empty.gravity[j]) / rate / kProbe;
      if (std::abs(per_kg) < 1e-9) continue;
      const double area = per_kg > 0.0 ? c.area_piston() : c.area_rod();
      const double limit = 0.6 * machine.pumps[static_cast<std::size_t>(pump)].max_pressure * area;
      most = std::min(most, std::max(0.0, (std::copysign(limit, per_kg) - unloaded) / per_kg));
    }
    allowed.push_back(most);
  }
  std::sort(allowed.begin(), allowed.end());
  return std::floor(allowed[allowed.size() / 8] / 50.0) * 50.0;
}

}  // namespace sparflow::simulator
