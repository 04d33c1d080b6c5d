#pragma once
/// What makes one crane differ from another of the same drawing: return lines, counterbalance valves, load-sensing
/// margins, valve gains. Drawn once a crane. SI throughout.
#include <array>
#include <vector>

#include "models/machine/machine.h"
#include "simulator/hidden_effects/random.h"

namespace sparflow::simulator {

inline constexpr double kBar = 1e5;            ///< [Pa]
inline constexpr double kLpm = 1.0 / 60000.0;  ///< [m^3/s]

/// One direction of one cylinder; index 0 = extending, 1 = retracting.
struct DirectionLaws {
  double valve_gain = 0.0;      ///< [m^3/s] flow at full command
  double return_offset = 0.0;   ///< [Pa] return chamber at vanishing flow
  double return_laminar = 0.0;  ///< [Pa/(m^3/s)]
  double return_orifice = 0.0;  ///< [Pa/(m^3/s)^2]
  bool counterbalance = true;
  double pilot_pressure = 0.0;  ///< [Pa] supply pressure that opens the valve without load
  double pilot_slope = 0.0;  ///< [-] fall of that pressure with load pressure in the return chamber
  double pilot_flow = 0.0;   ///< [Pa/(m^3/s)] rise with supply flow
};

struct CylinderLaws {
  std::array<DirectionLaws, 2> direction;
  double margin = 0.0;     ///< [Pa] pump above working pressure
  double rest_tank = 0.0;  ///< [Pa] unloaded chamber at rest
};

struct CraneLaws {
  std::vector<CylinderLaws> cylinders;
  std::vector<double> standby;  ///< [Pa] by pump; of a constant-pressure supply its pressure
  double oil_start = 28.0, oil_end = 55.0, oil_time = 90.0;  ///< [degC], [degC], [s]
  double operator_deadband_share = 0.8;  ///< of a dead band the operator's lever has learned
};

CraneLaws draw_crane_laws(const Machine& machine, std::uint64_t crane_seed);

/// The largest payload [kg], rounded to 50, with which seven of eight postures stay below 60 % of the pumps'
/// largest pressure; at most 4 t.
double usual_payload(const Machine& machine, std::uint64_t crane_seed);

}  // namespace sparflow::simulator
