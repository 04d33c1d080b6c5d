#pragma once
/// Continuation of a pressure model to loads heavier or lighter than all loads from which it was learned.
///
/// The supply pressure is the largest of the static branch S = (load + A_return p_return)/A_supply, the pressure that a
/// counterbalance valve requires, and that of the tank, from which an anti-cavitation valve admits oil
/// (models/hydraulics/return_rise.h). Samples of one branch contain nothing about another, and a straight line through
/// two belongs to neither. The static branch, however, follows from the balance of forces: a load heavier by e adds
/// e/A_supply to it, and no supply pressure is below it. With a process g of the learned loads, at whose border the
/// active branch rises by the share s of the static one, the law is
///   heavier by e:  p = g(border) + max(s e/A_supply, e/A_supply - gap),  gap = g(border) - S(border)
///   lighter by e:  p = max(g(border) - s e/A_supply, least)
/// Corners are rounded, values and both derivatives are continuous, and inside the learned loads nothing changes.
#include <cmath>

#include "models/math/jet.h"

namespace sparflow {

/// Parameters of the continuation for one cylinder and direction.
struct LoadsBeyond {
  int side = 0;  ///< +1 extends, -1 retracts: side * force resists the motion; 0 = not known
  double static_slope = 0.0;  ///< [Pa/N] 1/A_supply
  double static_level = 0.0;  ///< [Pa] static branch without load: A_return p_return/A_supply
  double slope_heavier = 0.0, slope_lighter = 0.0;  ///< [Pa/N] of the branch at either border
  double least = 0.0;  ///< [Pa] lower limit at light loads: the tank's pressure
};

namespace loads_beyond {

/// Static pressure over which the law passes from the learned loads to the continuation.
/// @threshold [Pa] 1e5..1e7; chosen: ten bar, less than loads of a log differ
inline constexpr double kCornerWidth = 10e5;
/// Static pressure over which corners are rounded.
/// @threshold [Pa] 1e3..1e6; chosen: two bar, small beside the pressures on either side
inline constexpr double kRounded = 2e5;

/// Range of force over which the law passes to the continuation. [N]
inline double bend(const LoadsBeyond& b) { return kCornerWidth / b.static_slope; }

/// max(0, x) with a smooth start: its slope rises from 0 to 1 over `bend` [N], with a parabola as second derivative.
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

/// @param process callable, pressure [Pa] at a force [N]; its flow is fixed inside
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
