#pragma once
/// Counterbalance valve at a cylinder's port: free flow in by a check valve, flow out only as far as load and pilot pressure
/// open it against a spring. The pilot pressure arrives through a damping orifice.
///   y = (p_load + R p_c - p_set - (1 + R) p_back) / p_range in 0..1,   T dp_c/dt = p_pilot - p_c
/// p_back is the pressure behind it (spring chamber not vented). The poppet itself is taken as fast.
/// Source: Nordhammer, Bak, Hansen (2012), "A method for reliable motion control of pressure compensated hydraulic actuation
/// with counterbalance valves", Proc. 12th Int. Conf. Control, Automation and Systems (also why the pilot is damped).
#include <cmath>

#include "simulator/plant/components/metering.h"

namespace sparflow::plant {

struct CounterbalanceParameters {
  double sides = 1.0;  ///< [-] 0: none, 1: both ports of the cylinder, 2: bore side, 3: rod side
  double set_pressure = 350e5;  ///< [Pa] load pressure that opens it without pilot
  double pilot_ratio = 3.0;     ///< [-] R
  double range = 150e5;         ///< [Pa] from closed to open
  double lag = 0.4;             ///< [s] T
  double open_drop = 30e5;      ///< [Pa] when open, at the cylinder's full flow
};

/// Whether the bore side's port has one, and the rod side's.
inline bool holds_bore(const CounterbalanceParameters& p) {
  return std::lround(p.sides) == 1 || std::lround(p.sides) == 2;
}
inline bool holds_rod(const CounterbalanceParameters& p) {
  return std::lround(p.sides) == 1 || std::lround(p.sides) == 3;
}

/// Opening under these pressures. @param load, pilot, back [Pa] @return [0..1]
inline double counterbalance_opening(double load, double pilot, double back,
                                     const CounterbalanceParameters& p) {
  constexpr double kCorner = 0.02;  // rounds the beginning and the end of the way
  const double x =
      (load + p.pilot_ratio * pilot - p.set_pressure - (1.0 + p.pilot_ratio) * back) / p.range;
  return smaller(positive_part(x - kCorner, kCorner), 1.0, kCorner);
}

/// A cylinder's port with hose and, where it is fitted, the valve.
struct Port {
  bool fitted = true;
  double opening = 1.0;    ///< [0..1] of the valve
  double full_flow = 0.0;  ///< [m^3/s]
  double line_drop = 0.0;  ///< [Pa] over hose and check valve at full flow
};

/// Flow into the chamber [m^3/s]. @param drop [Pa] hose less chamber
inline double port_flow(double drop, const Port& port, const CounterbalanceParameters& p) {
  if (!port.fitted || drop >= 0.0) return throttle(1.0, drop, port.full_flow, port.line_drop);
  return throttle(port.opening, drop, port.full_flow, p.open_drop);
}

}  // namespace sparflow::plant
