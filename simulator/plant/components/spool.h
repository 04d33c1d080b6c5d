#pragma once
/// Spool of a proportional section: hysteresis of its drive, position of second order, dead band by overlap.
///   play:     dw/dt follows the command u only beyond a half width h     (Krasnosel'skii, Pokrovskii 1989)
///   position: xdd = w0^2 (w - x) - 2 D w0 xd                             (Jelali, Kroll 2003, ch. 4)
/// Both are signed as the command, -1..1.
#include <numbers>

#include "simulator/plant/components/smooth.h"

namespace sparflow::plant {

struct SpoolParameters {
  double frequency = 6.0;           ///< [Hz] natural frequency
  double damping = 0.8;             ///< [-]
  double dead_band_extend = 0.05;   ///< [-] command at which flow to the bore side begins
  double dead_band_retract = 0.05;  ///< [-] to the rod side
  double hysteresis = 0.01;         ///< [-] half width
};

struct SpoolRates {
  double play = 0.0, position = 0.0, velocity = 0.0;
};

/// @param command [-1..1] @param play w [-] @param position x [-] @param velocity [1/s]
inline SpoolRates spool_rates(double command, double play, double position, double velocity,
                              const SpoolParameters& p) {
  constexpr double kFollow =
      0.004;  // [s] lag of the play outside its width, far below the spool's own
  constexpr double kCentring =
      0.05;  // [-] commands below which the centring springs outdo the hysteresis
  SpoolRates r;
  const double h = p.hysteresis * ramp(std::abs(command) / kCentring);
  const double gap = command - play, width = 1e-4;
  r.play = (positive_part(gap - h, width) - positive_part(-gap - h, width)) / kFollow;
  const double w0 = 2.0 * std::numbers::pi * p.frequency;
  r.position = velocity;
  r.velocity = w0 * w0 * (play - position) - 2.0 * p.damping * w0 * velocity;
  return r;
}

/// Share of the full metering area beyond a dead band, 0 at or below it.
inline double spool_opening(double travel, double dead_band) {
  constexpr double kNotch = 0.004;  // [-] travel over which the notches begin to open
  const double x = positive_part(travel - dead_band - kNotch, kNotch) / (1.0 - dead_band - kNotch);
  return std::min(x, 1.0);
}

}  // namespace sparflow::plant
