#pragma once
/// Data that is bad rather than unexplained: channels that are stuck, jump, are noisy, lost or clipped. No
/// physics explains them, so they are looked for before anything is called a missing effect.
/// Every check asks for two things at once: that the channel departs from its own habits or from its twins'
/// (channels of the same kind), and that nothing else in the machine did at that moment. A pressure that steps with
/// a command, or an oscillation that all sensors see, is the machine's own. docs/fit_and_compare.md, "Bad data".
#include <string>
#include <utility>
#include <vector>

#include "identification/signals/signals.h"

namespace sparflow {

enum class BadDataKind {
  kStuck,      ///< one value, for longer than its own noise or the machine's motion allows
  kJumping,    ///< steps away and back that no machine makes and no other channel sees
  kNoisy,      ///< white noise far above its twins' or its own elsewhere
  kDropOut,    ///< falls to zero, or is missing
  kSaturated,  ///< cut off at one value, again and again
  kWild        ///< single samples far off both their neighbours, again and again
};

struct BadChannel {
  std::string channel;  ///< signal's name without unit: "pA_boom"
  BadDataKind kind = BadDataKind::kStuck;
  double from_s = 0.0;   ///< [s] first and ...
  double to_s = 0.0;     ///< ... last sample affected, in the log's time
  double share = 0.0;    ///< of the log's samples, 0..1
  std::string evidence;  ///< one sentence with figures
  std::string remedy;    ///< one sentence: what to do

  // For its picture.
  std::string file = {};        ///< the log's name
  std::string unit = {};        ///< of `values`: bar, mm, degC ...
  Eigen::VectorXd time = {};    ///< [s] [samples]
  Eigen::VectorXd values = {};  ///< [unit] [samples] as logged, NaN = missing
  std::vector<std::pair<double, double>> stretches = {};  ///< [s] affected, in order
};

/// "stuck", "jumping", "noisy", "drop_out", "saturated", as in JSON.
const char* bad_data_word(BadDataKind kind);

struct BadDataOptions {
  double stuck_s = 1.0;  ///< [s] a shorter constant stretch is never called stuck
  /// Chance, from how often the channel repeats a value in the same state of the machine, below which a
  /// constant stretch is no accident. Corrected for the number of samples.
  double stuck_chance = 1e-9;
  /// Noise of a block of a second against its twins' median. A block's estimate scatters by a fifth: 3 is eight
  /// of its standard deviations above equal noise, so that sensors up to twice as noisy as others pass.
  double noise_ratio = 3.0;
  double noise_bursts_s = 2.0;  ///< [s] of noisy blocks, together, that it takes
  double jump_noise = 10.0;     ///< a jump is at least this many standard deviations of the noise
  double jump_back_s = 10.0;    ///< [s] within which it comes back
  double missing_share = 0.2;   ///< of a channel's samples without a value
  /// Noise or jumps below these do no harm, whatever their twins do.
  double least_pressure = 5e3;      ///< [Pa] noise; jumps: twenty times
  double least_command = 0.03;      ///< [-] noise; jumps: five times
  double least_speed_share = 0.02;  ///< position noise, as filtered speed over the joint's limit
};

/// Every measured channel of the log that is bad, worst (largest share) first; at most one entry a channel.
/// @param signals of the same log and machine
std::vector<BadChannel> find_bad_channels(const Machine& machine, const Log& log,
                                          const MachineSignals& signals,
                                          const BadDataOptions& options = {});

/// "pA_boom is noisy from 12.0 to 38.5 s (22 % of the log): its noise is 5.1 bar, ..."
std::string bad_channel_sentence(const BadChannel& bad);

}  // namespace sparflow
