#pragma once
/// How much of a hidden effect a log can show at all, told without any diagnosis: the crane is driven once more
/// beside itself without that effect, in the same postures with the same levers, and what the sensors would read
/// differs.
#include <string>
#include <vector>

#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::simulator {

struct Visibility {
  /// Largest over the channels: change where the effect acts (root of the sum of fourth over that of second powers)
  /// in standard deviations of the channel's own noise, both as means over 0.3 s.
  double size = 0.0;
  double energy =
      0.0;  ///< sum over the log of (change / deviation)^2 in that channel, means over 0.3 s
  double seconds = 0.0;  ///< how long it acts at that size: energy / size^2
  std::string channel;   ///< "force of boom"
  /// Share of the energy of pressures and pumps, in the channel where most is left, that a smooth law of the
  /// cylinder's own flow and force (a margin for each leading cylinder, a gain for each direction) can follow:
  /// learned from the same log (and a reference), it contains that much.
  double swallowed = 0.0;
  bool twin = false;  ///< another effect of the catalogue is the same law at this place
};

/// One entry for each of the request's effects, all others being there.
/// Channels: force of each cylinder while it moves, its speed at the command, the pressure of the chamber that the
/// return line or the counterbalance valve rules, pump pressure beyond what the commanded chambers ask. Sensors'
/// errors count in what they feed. Delays of channels and noise (sensor_delay, sensor_fault) act on the recording and
/// are not judged: size infinity.
/// @param learned what laws learned from this log can follow is taken off first
/// @param reference of learned laws: the same crane without the effects; they follow that log, too, where nothing
/// changes. What the reference never did pins nothing.
std::vector<Visibility> visibility(const LogRequest& request, bool learned,
                                   const LogRequest* reference = nullptr);

/// The rule of the blind test: at least as large as the noise where it acts, with the energy of ten seconds of that,
/// acting for three seconds or more (an incident proves no law), no more than nine tenths swallowed, and without a twin:
/// of a pump with one cylinder, margin and line grow with the same flow.
bool visible(const Visibility& v);

}  // namespace sparflow::simulator
