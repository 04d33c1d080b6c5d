/// Values that follow from the machine file by the sizing rules that parameter_table.cpp cites.
#include <algorithm>
#include <cmath>

#include "models/machine/linkage.h"
#include "models/math/error.h"
#include "models/math/units.h"
#include "simulator/plant/parameters/plant_parameters.h"

namespace sparflow::plant {
namespace {

constexpr double kRodSpeed = 0.1;           // [m/s] assumed where neither valve nor joint tells one
constexpr double kHoseVelocity = 5.0;       // [m/s] of the oil in a pressure line at full flow
constexpr double kFrictionPressure = 2e5;   // [Pa] on the piston area
constexpr double kViscousPressure = 0.2e5;  // [Pa] on the piston area at full speed
constexpr double kPistonLeak = 0.02;        // [l/min] at 100 bar
constexpr double kSetOverPump = 1.0;  // [-] counterbalance setting over the pump's largest pressure
constexpr double kReliefOverPump = 1.2;  // [-] port relief valves over the pump's largest pressure
constexpr double kPumpLeakShare = 0.08;  // [-] of the largest flow at the largest pressure
constexpr double kCornerPower = 0.75;    // [-] of largest pressure times largest flow
constexpr double kDriveLag = 0.05;       // [s] of a drive without hydraulics

/// Way of a hose from the base to the cylinder. [m]
double hose_length(const Machine& machine, int joint) {
  double length = 1.0;
  for (int k = 0; k < joint; ++k)
    length += machine.joints[static_cast<std::size_t>(k) + 1].origin.translation().norm();
  return length;
}

double stroke_of(const Machine& machine, int c) {
  const Joint& joint =
      machine
          .joints[static_cast<std::size_t>(machine.cylinders[static_cast<std::size_t>(c)].joint)];
  return std::abs(cylinder_length(machine, c, joint.position.hi) -
                  cylinder_length(machine, c, joint.position.lo));
}

void size_hydraulics(const Machine& machine, int c, CylinderParameters& p) {
  const Cylinder& drive = machine.cylinders[static_cast<std::size_t>(c)];
  const int fed = machine.pump_of_cylinder(c);
  if (fed < 0)
    throw InputError({"", 0, 0}, "cylinders[" + drive.name + "]",
                     "no pump feeds it; the dynamic plant needs one (pumps[...].feeds)");
  const Pump& pump = machine.pumps[static_cast<std::size_t>(fed)];
  const double area = drive.area_piston(), annulus = drive.area_rod();
  if (const Valve* valve = machine.valve_of_cylinder(c)) {
    p.max_flow_extend = valve->max_flow_extend;
    p.max_flow_retract = valve->max_flow_retract;
  } else {
    const Joint& joint = machine.joints[static_cast<std::size_t>(drive.joint)];
    const double middle = 0.5 * (joint.position.lo + joint.position.hi);
    double speed = std::max(joint.velocity.hi, -joint.velocity.lo) *
                   std::abs(linkage_rates(machine, c, middle).d1);
    if (!(speed > 0.0)) speed = kRodSpeed;
    p.max_flow_extend = speed * area;
    p.max_flow_retract = speed * annulus;
  }
  const double speed = p.max_flow_extend / area;
  p.friction.coulomb = kFrictionPressure * area;
  p.friction.viscous = kViscousPressure * area / speed;
  p.leakage = kPistonLeak * units::kLitrePerMinute / 100e5;
  p.dead_volume = 0.05 * area * stroke_of(machine, c);
  p.hose_volume = p.max_flow_extend / kHoseVelocity * hose_length(machine, drive.joint);
  p.counterbalance.set_pressure = kSetOverPump * pump.max_pressure;
  p.port_relief = kReliefOverPump * pump.max_pressure;
}

}  // namespace

PlantParameters default_parameters(const Machine& machine) {
  PlantParameters r;
  r.pendulum.rope_length = 1.5;
  r.flex_angle = 0.01;
  r.pressure_offset.assign(machine.cylinders.size(), 2e5);
  r.sensors.delay = 0.04;
  r.sensors.drop_out = 0.02;
  RigidBodies bodies(machine, {}, 0.0);
  Eigen::VectorXd middle(machine.joint_count());
  for (int k = 0; k < machine.joint_count(); ++k) {
    const Range range = machine.joints[static_cast<std::size_t>(k)].position;
    middle[k] = 0.5 * (range.lo + range.hi);
  }
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(machine.joint_count());
  bodies.update(middle.data(), still.data());
  for (int c = 0; c < machine.cylinder_count(); ++c) {
    const Cylinder& drive = machine.cylinders[static_cast<std::size_t>(c)];
    CylinderParameters p;
    p.end.cushion_length = std::min(0.03, 0.05 * stroke_of(machine, c));
    if (drive.hydraulic()) {
      size_hydraulics(machine, c, p);
    } else {
      const double rate = linkage_rates(machine, c, middle[drive.joint]).d1;
      const double mass = bodies.mass()(drive.joint, drive.joint) / (rate * rate);
      p.drive_gain = mass / kDriveLag;
      p.friction.coulomb = 0.02 * mass * 9.81;
      p.friction.viscous = 2.0 * mass;
      p.end.cushion_length = 0.0;
    }
    r.cylinders.push_back(p);
  }
  for (const Pump& pump : machine.pumps) {
    PumpParameters p;
    p.max_flow = pump.max_flow;
    p.flow_sharing = 1.0;
    p.cut_off = pump.max_pressure;
    p.standby = pump.standby > 0.0 ? pump.standby : p.standby;
    p.leakage = kPumpLeakShare * pump.max_flow / pump.max_pressure;
    p.power = kCornerPower * pump.max_flow * pump.max_pressure;
    p.line_volume = std::max(1e-3, pump.max_flow / kHoseVelocity * 4.0);
    r.pumps.push_back(p);
  }
  return r;
}

}  // namespace sparflow::plant
