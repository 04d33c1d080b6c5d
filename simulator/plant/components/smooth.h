#pragma once
/// Corners that a real part rounds and that an integrator needs rounded: each is exact outside a width.
#include <algorithm>
#include <cmath>

namespace sparflow::plant {

/// max(0, x), rounded over |x| < width by a parabola. Continuous slope.
inline double positive_part(double x, double width) {
  if (x >= width) return x;
  if (x <= -width) return 0.0;
  return (x + width) * (x + width) / (4.0 * width);
}

/// min(a, b), rounded where they differ by less than width.
inline double smaller(double a, double b, double width) { return b - positive_part(b - a, width); }

/// Signed square root of a pressure drop, laminar below about `transition`: x / (x^2 + d^2)^(1/4). [Pa^0.5]
/// Source: Merritt (1967), Hydraulic Control Systems, ch. 3 (transition of an orifice at low Reynolds numbers).
inline double orifice_root(double drop, double transition) {
  return drop / std::sqrt(std::hypot(drop, transition));
}

/// 0 below 0, 1 above 1, a cubic between.
inline double ramp(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace sparflow::plant
