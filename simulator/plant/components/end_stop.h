#pragma once
/// What happens at the ends of a stroke: a cushion that throttles the last part, then a stop that yields a little.
/// Cushion: dp = peak s^2 (v / v_ref)^2 on the piston, s = 1 - gap / length, towards the stop only; the oil trapped in it is
/// taken as incompressible. Source: Jelali, Kroll (2003), ch. 4 (end-position cushioning as a throttle).
/// Stop: F = k d (1 + c dd/dt), never pulling. Source: Hunt, Crossley (1975), J. Applied Mechanics 42, with exponent 1.
#include <algorithm>

namespace sparflow::plant {

struct EndStopParameters {
  double cushion_length = 0.03;  ///< [m], 0: no cushion
  /// Drop at the reference speed and the very end, if the piston got there, on the larger area. [Pa]
  double cushion_pressure = 1000e5;
  double stop_travel = 0.002;  ///< [m] by which the stop yields under the cylinder's largest force
  double stop_damping = 5.0;   ///< [s/m] c
};

struct EndStop {
  double force = 0.0;   ///< [N] added to the rod, positive extends
  double loss = 0.0;    ///< [W]
  double stored = 0.0;  ///< [J]
};

struct EndStopState {
  double gap = 0.0;              ///< [m] way left to the stop, negative when it yields
  double speed = 0.0;            ///< [m/s] towards the stop
  double area = 0.0;             ///< [m^2] of the piston
  double reference_speed = 1.0;  ///< [m/s] at which the cushion's pressure is told
  double stiffness = 0.0;        ///< [N/m] of the stop
};

/// @return force with the sign of a push away from the stop
inline EndStop end_stop(const EndStopState& s, const EndStopParameters& p) {
  EndStop r;
  if (p.cushion_length > 0.0 && s.gap < p.cushion_length && s.speed > 0.0) {
    const double in = std::clamp(1.0 - s.gap / p.cushion_length, 0.0, 1.0);
    const double relative = s.speed / s.reference_speed;
    r.force = s.area * p.cushion_pressure * in * in * relative * relative;
    r.loss = r.force * s.speed;
  }
  if (s.gap < 0.0) {
    const double elastic = -s.stiffness * s.gap;
    const double stop = std::max(0.0, elastic * (1.0 + p.stop_damping * s.speed));
    r.force += stop;
    r.loss += (stop - elastic) * s.speed;
    r.stored = 0.5 * s.stiffness * s.gap * s.gap;
  }
  return r;
}

}  // namespace sparflow::plant
