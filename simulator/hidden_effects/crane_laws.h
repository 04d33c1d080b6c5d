#pragma once
/// Hydraulic properties in which cranes of the same drawing differ: return lines, counterbalance valves, load-sensing
/// margins, valve gains. They are drawn once for each crane. SI throughout.
#include <array>
#include <vector>

#include "models/machine/machine.h"
#include "simulator/random/random.h"

namespace sparflow::simulator {

inline constexpr double kBar = 1e5;            ///< [Pa]
inline constexpr double kLpm = 1.0 / 60000.0;  ///< [m^3/s]

/// One direction of one cylinder; index 0 = extending, 1 = retracting.
struct DirectionLaws {
  double valve_gain = 0.0;      ///< [m^3/s] flow at full command
  double return_offset = 0.0;   ///< [Pa] return pressure at vanishing flow
  double return_laminar = 0.0;  ///< [Pa/(m^3/s)]
  double return_orifice = 0.0;  ///< [Pa/(m^3/s)^2]
  bool counterbalance = true;
  double pilot_pressure = 0.0;  ///< [Pa] supply pressure that opens the valve without load
  double pilot_slope =
      0.0;  ///< [-] decrease of that pressure with load pressure in the return chamber
  double pilot_flow = 0.0;  ///< [Pa/(m^3/s)] its increase with supply flow
};

struct CylinderLaws {
  std::array<DirectionLaws, 2> direction;
  double margin = 0.0;     ///< [Pa] load-sensing margin
  double rest_tank = 0.0;  ///< [Pa] pressure of the unloaded chamber at rest
};

struct CraneLaws {
  std::vector<CylinderLaws> cylinders;
  std::vector<double> standby;  ///< [Pa] by pump; of a constant-pressure pump its pressure
  double oil_start = 28.0, oil_end = 55.0, oil_time = 90.0;  ///< [degC], [degC], time constant [s]
  double operator_deadband_share =
      0.8;  ///< [-] of a valve's dead band that the operator's lever skips
};

/// Draws the laws of one crane; the same seed gives the same crane.
CraneLaws draw_crane_laws(const Machine& machine, std::uint64_t crane_seed);

/// Returns the largest payload [kg], rounded to 50, with which seven of eight postures need less than 60 % of the pumps'
/// largest pressure; at most 4 t.
double usual_payload(const Machine& machine, std::uint64_t crane_seed);

}  // namespace sparflow::simulator
