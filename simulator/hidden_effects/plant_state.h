#pragma once
/// The plant at one instant. SI; vectors are by joint or by cylinder in the machine's order.
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct CylinderState {
  // From the operator to the rod:
  double command = 0.0;  ///< [-] lever, positive extends
  double opening = 0.0;  ///< [-] of the spool, signed as the command
  int side = 0;          ///< sign of the opening: +1 A is the supply chamber, -1 B, 0 closed
  int asked =
      0;  ///< side whose working pressure the pump senses; equals `side` unless an effect changes it
  double flow = 0.0;          ///< [m^3/s] from the valve into the supply chamber, never negative
  double drift = 0.0;         ///< [m/s] rod speed added to that of the flow: leakage, compression
  double speed = 0.0;         ///< [m/s] of the rod, positive extending
  double acceleration = 0.0;  ///< [m/s^2]
  double length = 0.0;        ///< [m] pin to pin
  double rate = 1.0;          ///< dx/dq
  // From the load to the chambers:
  double weight = 0.0;  ///< [N] static force, positive pushes the rod in
  double force = 0.0;   ///< [N] load that the chambers carry, effects included; signed as `weight`
  double return_flow = 0.0;      ///< [m^3/s] never negative
  double return_pressure = 0.0;  ///< [Pa] caused by the return line
  double pilot_pressure =
      0.0;  ///< [Pa] supply pressure that opens the counterbalance valve, 0 = none
  double pressure_a = 0.0, pressure_b = 0.0;  ///< [Pa] at the cylinder
  double working = 0.0;                       ///< [Pa] working pressure, 0 when the valve is closed
  double line_drop = 0.0;                     ///< [Pa] between pump and cylinder, beyond the margin
  double margin = 0.0;                        ///< [Pa]
};

struct PumpState {
  double flow = 0.0;      ///< [m^3/s]
  double demand = 0.0;    ///< [Pa]
  double pressure = 0.0;  ///< [Pa]
  int leader = -1;        ///< cylinder that is the load-sensing leader, -1 = none
};

struct PlantState {
  double t = 0.0, h = 0.0;  ///< [s] time, step
  double payload = 0.0;     ///< [kg]
  double oil = 40.0;        ///< [degC]
  std::vector<double> q, qd, qdd;
  std::vector<double> q_load;  ///< posture of the bodies; equals q unless the structure deflects
  std::vector<double> gravity, inertia;  ///< joint loads
  std::vector<CylinderState> cylinders;
  std::vector<PumpState> pumps;  ///< of the step before until the step computes the pumps
};

/// Sensor readings of the same instant, before noise. Pressures [Pa], positions [rad] or [m].
struct SensorState {
  std::vector<double> q;
  std::vector<double> pressure_a, pressure_b, pump;
};

}  // namespace sparflow::simulator
