#pragma once
/// Thresholds of the experiment design, and what is assumed of the motions it synthesises.
#include "models/math/units.h"

namespace sparflow {

struct PowerOptions {
  /// Noise draws over which an expected gain is averaged. Each is used with both signs of the
  /// signature, so that the term linear in the signature cancels.
  /// @threshold [1] 1..; chosen: the time grows with every draw, and the sign cancels the largest
  /// part of the variation.
  int draws = 2;
};

struct MotionOptions {
  /// Lower end of a motion, as share of a joint's range.
  /// @threshold [1] 0..0.5; chosen: clear of the ends of the range.
  double low = 0.2;
  /// Upper end of a motion, as share of a joint's range.
  /// @threshold [1] 0.5..1; chosen: clear of the ends of the range.
  double high = 0.8;
  /// Share of pump and valve flow that the fastest motion uses.
  /// @threshold [1] 0..1; chosen: neither pump nor valve saturates.
  double flow_share = 0.9;
  /// Flow of a valve at full command whose flow neither the model nor the machine file says.
  /// @threshold [m^3/s] 0..; chosen: 60 l/min, of the order of a crane's valve; it scales the speed of all motions that are
  /// compared alike.
  double unknown_valve_flow = 1e-3;
  /// Time in which the speed of a sudden command rises and falls.
  /// @threshold [s] 0..; chosen: a sudden command that a machine can still follow.
  double ramp = 0.3;
  /// Shortest such ramp, as share of a leg.
  /// @threshold [1] 0..0.5; numerical: keeps the acceleration of a long leg finite, relative to the
  /// leg's time.
  double shortest_ramp = 0.02;
  /// Longest such ramp, as share of a leg.
  /// @threshold [1] 0..0.5; numerical: leaves a fifth of a short leg at constant speed.
  double longest_ramp = 0.4;
  /// Return pressure at rest.
  /// @threshold [Pa] 0..; chosen: of the order of cranes; its value has little influence on the
  /// comparison.
  double return_pressure = 4.0 * units::kBar;
  /// Rise of the return pressure with the square of the return flow.
  /// @threshold [Pa/(m^3/s)^2] 0..; chosen: 3 bar at 60 l/min in lines and filter; twice of it changes a working
  /// pressure by some bar.
  double return_loss = 3.0 * units::kBar / (1e-3 * 1e-3);
  /// Supply pressure with an overrunning load, which a valve then holds.
  /// @threshold [Pa] 0..; chosen: 15 bar stand for the pressure that opens a counterbalance valve.
  double least_supply = 15.0 * units::kBar;
  /// Oil temperature of all motions but the one that warms up.
  /// @threshold [degC] 0..; chosen: between the temperatures at which the warming motion begins and ends, nearer to its
  /// end, where a machine works most of the time.
  double oil = 45.0;
  /// Oil temperature at the start of the motion that warms up.
  /// @threshold [degC] 0..; chosen: oil at the temperature of the air.
  double cold_oil = 20.0;
  /// Oil temperature at the end of the motion that warms up.
  /// @threshold [degC] 0..; chosen: oil of a machine that has worked for long.
  double hot_oil = 60.0;
};

struct ExperimentOptions {
  /// Gain of an effect over a rival in a minute, from which a motion is worth advising.
  /// @threshold [nat/min] 0..; chosen: with less, effects stay indistinguishable for a quarter of
  /// an hour.
  double least_nats_per_minute = 0.3;
  /// Ratio of that gain to the one of the recorded motions, from which a motion is worth advising.
  /// @threshold [1] 1..; chosen: a motion that is half as good again as more of the same.
  double better_than_here = 1.5;
  /// Payload below which the logs count as carrying none.
  /// @threshold [kg] 0..; chosen: a tenth of the load that is advised instead.
  double lightest_load = 50.0;
  /// Load that is advised when the logs carry none.
  /// @threshold [kg] 0..; chosen: half a tonne shows clearly beside no load.
  double fallback_load = 500.0;
  MotionOptions motion;
  PowerOptions power;
};

}  // namespace sparflow
