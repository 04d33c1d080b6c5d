#pragma once
/// Flow through a valve section: a metering edge whose pressure drop a compensator holds, and a throttle to tank.
///   q = q_full a sqrt(min(dp, dp_c) / dp_c),  dp = p_supply - p_port, never backwards (load-holding check valve)
/// Where the supply falls short, a compensator before the edge loses the section with the highest load first; one behind
/// the edge (flow sharing) sees p_supply - p_highest in every section, and all lose in proportion.
/// Source: Merritt (1967), Hydraulic Control Systems, ch. 3 and 5; Krus (1988), On Load Sensing Fluid Power Systems.
/// The compensator's own dynamics (some 10 ms) are left out.
#include "simulator/plant/components/smooth.h"

namespace sparflow::plant {

inline constexpr double kLaminarDrop = 0.3e5;  ///< [Pa] drop below which an edge is laminar

struct Metering {
  double full_flow = 0.0;    ///< [m^3/s] at full opening under the compensator's drop
  double compensator = 7e5;  ///< [Pa] drop over the edge
};

/// @param opening [0..1] @param drop [Pa] supply less port @param shared_drop [Pa] supply less the highest load where
/// sections share the flow, else equal to `drop`
/// @return [m^3/s] towards the port, never negative
inline double meter_in(double opening, double drop, double shared_drop, const Metering& p) {
  constexpr double kRound = 0.1e5;  // [Pa]
  const double available = positive_part(std::min(drop, shared_drop) - kRound, kRound);
  const double held = smaller(available, p.compensator, kRound);
  return p.full_flow * opening * orifice_root(held, kLaminarDrop) /
         orifice_root(p.compensator, kLaminarDrop);
}

/// Plain throttle. @param full_flow [m^3/s] at `full_drop` [Pa] and full opening @return [m^3/s] with the drop's sign
inline double throttle(double opening, double drop, double full_flow, double full_drop) {
  return full_flow * opening * orifice_root(drop, kLaminarDrop) /
         orifice_root(full_drop, kLaminarDrop);
}

/// Return edge of a section whose load nothing else holds: a compensator limits the flow to that of `full_drop`, so that a
/// load runs no faster than the lever says. @return [m^3/s] with the drop's sign
inline double limited_throttle(double opening, double drop, double full_flow, double full_drop) {
  constexpr double kRound = 0.1e5;  // [Pa]
  return throttle(opening, smaller(drop, full_drop, kRound), full_flow, full_drop);
}

}  // namespace sparflow::plant
