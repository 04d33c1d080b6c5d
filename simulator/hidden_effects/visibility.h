#pragma once
/// How much of a hidden effect a log can show at all, determined without any diagnosis: a second crane without that
/// effect is driven through the same postures with the same levers, and the sensor readings of the two are compared.
#include <string>
#include <vector>

#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::simulator {

struct Visibility {
  /// [-] Largest change over the channels where the effect acts (root of the sum of fourth powers over that of second
  /// powers), in standard deviations of the channel's noise; change and noise are means over 0.3 s.
  double size = 0.0;
  /// [-] Sum over the log of (change / standard deviation)^2 in that channel, of means over 0.3 s.
  double energy = 0.0;
  double seconds = 0.0;  ///< [s] for which it acts at that size: 0.3 s * energy / size^2
  std::string channel;   ///< channel of the largest change, e.g. "force of boom"
  /// [-] Absorbed share, for an effect that shows most in pressures or pumps: part of the energy that a smooth law of the
  /// cylinder's flow and force (a margin for each leader, a gain for each direction) takes over when it is learned from
  /// the same log (and a reference).
  double absorbed = 0.0;
  bool equivalent = false;  ///< another effect of the catalogue has the same law at this place
};

/// Determines the visibility of each effect of the request, with all other effects present.
/// Channels: force of each cylinder while it moves, its speed at the command, the pressure of the chamber that the
/// return line or the counterbalance valve determines, pump pressure beyond the demand of the commanded cylinders.
/// A sensor's error counts in the channels computed from it. Delays and noise (sensor_delay, sensor_fault) act on the
/// recording and are not judged; their size is infinite.
/// @param learned first removes the part of the change that laws learned from this log can follow
/// @param reference log of the same crane without the effects from which the laws are learned, too; it limits them only
/// in the states that it visits. May be null
std::vector<Visibility> visibility(const LogRequest& request, bool learned,
                                   const LogRequest* reference = nullptr);

/// The rule of the blind test for effects that a diagnosis must name: at least as large as the noise where it acts, with
/// the energy of ten seconds of that, acting for three seconds or more (no law can be tested on an isolated event), with
/// an absorbed share of at most nine tenths, and not equivalent to another effect (with one cylinder on a pump, margin
/// and line loss depend on the same flow).
bool visible(const Visibility& v);

}  // namespace sparflow::simulator
