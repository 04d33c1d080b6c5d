#pragma once
/// All numbers of a dynamic plant that the machine file does not tell: defaults come from the machine (default_parameters),
/// an own file changes them (plant_file.h), and `--effects` switches groups of them (plant_effects.h). Every number stands
/// with unit, typical value and source in parameter_table.h.
#include <vector>

#include "models/machine/machine.h"
#include "simulator/plant/bodies/rigid_bodies.h"
#include "simulator/plant/components/counterbalance.h"
#include "simulator/plant/components/end_stop.h"
#include "simulator/plant/components/friction.h"
#include "simulator/plant/components/metering.h"
#include "simulator/plant/components/oil.h"
#include "simulator/plant/components/pump.h"
#include "simulator/plant/components/spool.h"

namespace sparflow::plant {

struct CylinderParameters {
  FrictionParameters friction;
  SpoolParameters spool;
  CounterbalanceParameters counterbalance;
  EndStopParameters end;
  double max_flow_extend = 0.0;   ///< [m^3/s] into the bore side at full command
  double max_flow_retract = 0.0;  ///< [m^3/s] into the rod side
  double compensator = 7e5;       ///< [Pa]
  double return_drop = 20e5;      ///< [Pa] over the spool's return edge at full flow
  double port_relief = 1e9;       ///< [Pa] opens the relief valve at a chamber's port
  double line_drop = 5e5;         ///< [Pa] between valve and cylinder at full flow
  double leakage = 0.0;           ///< [m^3/s/Pa] across the piston, oil at 40 degC
  double dead_volume = 0.0;       ///< [m^3] of each chamber at its end of the stroke
  double hose_volume = 0.0;       ///< [m^3] of each hose between valve and cylinder
  double hose_modulus = 0.8e9;    ///< [Pa] pressure by its relative growth of volume
  double rest_pressure = 2e5;     ///< [Pa] at the start, in the chamber that carries no load
  double drive_gain = 0.0;        ///< [N s/m] of a drive without hydraulics
};

struct TankParameters {
  double drop = 4e5;             ///< [Pa] of filter and line at the flow of all pumps
  double volume = 3e-3;          ///< [m^3] of the return line
  double temperature = 45.0;     ///< [degC] oil at the start
  double ambient = 20.0;         ///< [degC]
  double heat_capacity = 2.5e5;  ///< [J/K] of the oil in the tank
  double cooling = 300.0;        ///< [W/K] to the surroundings
};

/// Errors of the sensors, as a log has them. One value for all channels of a kind.
struct SensorParameters {
  double position_noise = 2e-4;   ///< [rad] or [m] standard deviation
  double pressure_noise = 0.4e5;  ///< [Pa]
  double force_noise = 0.01;      ///< [-] of a drive's largest force
  double position_step = 5e-5;    ///< [rad] or [m] quantisation
  double pressure_step = 0.1e5;   ///< [Pa]
  double delay = 0.0;             ///< [s] of pressures behind positions
  double drop_out = 0.0;          ///< [1/s] rate of gaps in a channel
};

/// Cylinders and pumps in the machine's order.
struct PlantParameters {
  OilParameters oil;
  TankParameters tank;
  PendulumParameters pendulum;
  double flex_angle =
      0.0;  ///< [rad] by which each boom bends under its largest static torque; 0: rigid
  double flex_damping = 0.03;  ///< [-] damping ratio of that bending
  SensorParameters sensors;
  std::vector<double> pressure_offset;  ///< [Pa] by cylinder, on the bore side's sensor
  std::vector<CylinderParameters> cylinders;
  std::vector<PumpParameters> pumps;
};

/// Nominal values of every effect, derived from the machine file; see parameter_table.h. Those effects are on, too, that
/// are off unless named: apply_effects (plant_effects.h) without items switches them off.
/// @throws InputError when a hydraulic cylinder is fed by no pump
PlantParameters default_parameters(const Machine& machine);

}  // namespace sparflow::plant
