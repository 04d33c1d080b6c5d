#pragma once
/// What a learned pressure says of loads heavier or lighter than all it was learned from.
///
/// The supply holds whichever asks for more, the static branch S = (load + A_return p_return)/A_supply, what a
/// counterbalance valve asks for, or the tank, from which an anti-cavitation valve lets oil in (models/hydraulics/return_rise.h). Samples
/// of one branch say nothing of the other, and a straight line through both belongs to neither. But the static branch is the
/// balance of forces: a load that is heavier by e adds e/A_supply to it, and no supply can be lower than it. So with a process
/// g of loads up to its border, where the branch that rules there rises by the share s of the static one,
///   heavier by e:  p = g(border) + max(s e/A_supply, e/A_supply - gap),  gap = g(border) - S(border)
///   lighter by e:  p = max(g(border) - s e/A_supply, least)
/// Corners are rounded, values and both derivatives continuous; inside the learned loads nothing changes.
#include <cmath>

#include "models/math/jet.h"

namespace sparflow {

/// Of one cylinder moving to one side.
struct LoadsBeyond {
  int side = 0;               ///< +1 extends, -1 retracts: side * force opposes it. 0 = not known
  double static_slope = 0.0;  ///< [Pa/N] 1/A_supply
  double static_level = 0.0;  ///< [Pa] static branch without load: A_return p_return/A_supply
  double slope_heavier = 0.0, slope_lighter = 0.0;  ///< [Pa/N] of the branch at either border
  double least = 0.0;                               ///< [Pa] lightest loads: the tank's pressure
};

namespace loads_beyond {

/// What leaves the learned loads is bent over this many static pressures, corners are rounded over the other. [Pa]
inline constexpr double kBend = 10e5, kRounded = 2e5;

/// [N] over which the law bends.
inline double bend(const LoadsBeyond& b) { return kBend / b.static_slope; }

/// x beyond zero, 0 before it: a parabola's integral over `bend` [N], then a straight line.
template <class T>
T excess(const T& x, double bend) {
  if (x <= T(0.0)) return T(0.0);
  if (x >= T(bend)) return x - T(0.5 * bend);
  const T u = x / T(bend);
  return T(bend) * u * u * u * (T(1.0) - T(0.5) * u);
}

/// max(0, x - gap) with its corner rounded, 0 at x = 0.
template <class T>
T above(const T& x, const T& gap) {
  using std::sqrt;
  const auto positive = [](const T& v) {
    return T(0.5) * (v + sqrt(v * v + T(kRounded * kRounded)));
  };
  return positive(x - gap) - positive(T(0.0) - gap);
}

}  // namespace loads_beyond

/// @param process callable: pressure [Pa] at a force [N], any derivative in flow inside
/// @param force [N]  @param lowest, highest learned forces [N]
template <class T, class Process>
T pressure_beyond(const LoadsBeyond& b, const T& force, double lowest, double highest,
                  const Process& process) {
  using loads_beyond::above;
  const double side = b.side;
  const T load = T(side) * force;
  const double heaviest = b.side > 0 ? highest : -lowest, lightest = b.side > 0 ? lowest : -highest;
  if (load > T(heaviest)) {
    const T e = loads_beyond::excess<T>(load - T(heaviest), loads_beyond::bend(b));
    const T border = load - e;
    const T g = process(T(T(side) * border));
    const T gap = g - T(b.static_level) - T(b.static_slope) * border;
    return g + T(b.slope_heavier) * e + above<T>(T(b.static_slope - b.slope_heavier) * e, gap);
  }
  const T e = loads_beyond::excess<T>(T(lightest) - load, loads_beyond::bend(b));
  const T g = process(T(T(side) * (load + e)));
  const T fall = T(b.slope_lighter) * e;
  const T room = g - T(b.least);
  return g - fall + above<T>(fall, room);
}

}  // namespace sparflow
