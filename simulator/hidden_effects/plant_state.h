#pragma once
/// The plant at one instant. SI; by joint or by cylinder in the machine's order.
#include <vector>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct CylinderState {
  // from the operator to the rod
  double command = 0.0;  ///< [-] lever, positive extends
  double opening = 0.0;  ///< [-] of the spool, signed as the command
  int side = 0;          ///< sign of the opening: +1 A is fed, -1 B is fed, 0 closed
  int asked =
      0;  ///< side whose load the pump is asked to carry; follows `side` unless an effect says other
  double flow = 0.0;          ///< [m^3/s] from the valve into the fed chamber, never negative
  double drift = 0.0;         ///< [m/s] rod speed beside that of the flow: leakage, compression
  double speed = 0.0;         ///< [m/s] of the rod, positive extending
  double acceleration = 0.0;  ///< [m/s^2]
  double length = 0.0;        ///< [m] pin to pin
  double rate = 1.0;          ///< dx/dq
  // from the load to the chambers
  double weight = 0.0;           ///< [N] static force, positive pushes the rod in
  double force = 0.0;            ///< [N] with effects; what the chambers carry
  double return_flow = 0.0;      ///< [m^3/s] never negative
  double return_pressure = 0.0;  ///< [Pa] the return line asks for
  double pilot_pressure = 0.0;   ///< [Pa] the counterbalance valve asks of the supply, 0 = none
  double pressure_a = 0.0, pressure_b = 0.0;  ///< [Pa] at the cylinder
  double working = 0.0;                       ///< [Pa] of the fed chamber, 0 when closed
  double line_drop = 0.0;                     ///< [Pa] between pump and cylinder, beyond the margin
  double margin = 0.0;                        ///< [Pa]
};

struct PumpState {
  double flow = 0.0;      ///< [m^3/s]
  double demand = 0.0;    ///< [Pa]
  double pressure = 0.0;  ///< [Pa]
  int leader = -1;
};

struct PlantState {
  double t = 0.0, h = 0.0;  ///< [s] time, step
  double payload = 0.0;     ///< [kg]
  double oil = 40.0;        ///< [degC]
  std::vector<double> q, qd, qdd;
  std::vector<double> q_load;  ///< posture of the bodies; q unless the structure gives way
  std::vector<double> gravity, inertia;  ///< joint loads
  std::vector<CylinderState> cylinders;
  std::vector<PumpState> pumps;  ///< until the pump is reached: of the step before
};

/// The same instant as the sensors report it, before noise. Pressures [Pa].
struct SensorState {
  std::vector<double> q;
  std::vector<double> pressure_a, pressure_b, pump;
};

}  // namespace sparflow::simulator
