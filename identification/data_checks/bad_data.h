#pragma once
/// Finds faulty measurement channels: stuck, jumping, noisy, missing or clipped. No physical law explains these faults, so
/// they are searched before a residual is attributed to a missing effect. Every check requires two things: the channel
/// departs from its usual behaviour or from its peers (channels of the same quantity), and no other channel changes at
/// that moment. A pressure that steps with a command, or an oscillation that all sensors measure, is a motion of the
/// machine. docs/fit_and_compare.md, "Bad data".
#include <string>
#include <utility>
#include <vector>

#include "identification/signals/signals.h"

namespace sparflow {

enum class BadDataKind {
  kStuck,      ///< constant for longer than its noise or the machine's motion allows
  kJumping,    ///< steps away and back that no other channel explains
  kNoisy,      ///< white noise far above that of its peers or its own elsewhere
  kDropOut,    ///< falls to zero, or is missing
  kSaturated,  ///< repeatedly cut off at one value
  kWild        ///< repeated single samples far off both their neighbours
};

struct BadChannel {
  std::string channel;  ///< signal's name without unit: "pA_boom"
  BadDataKind kind = BadDataKind::kStuck;
  double from_s = 0.0;   ///< [s] first and ...
  double to_s = 0.0;     ///< ... last sample affected, in the log's time
  double share = 0.0;    ///< of the log's samples, 0..1
  std::string evidence;  ///< one sentence with figures
  std::string remedy;    ///< one sentence: what to do

  // For the chart of the channel.
  std::string file = {};        ///< the log's name
  std::string unit = {};        ///< of `values`: bar, mm, degC ...
  Eigen::VectorXd time = {};    ///< [s] [samples]
  Eigen::VectorXd values = {};  ///< [unit] [samples] as logged, NaN = missing
  std::vector<std::pair<double, double>> stretches = {};  ///< [s] affected, in order
};

/// @return "stuck", "jumping", "noisy", "drop_out", "saturated" or "wild", as in JSON
const char* bad_data_word(BadDataKind kind);

struct BadDataOptions {
  double stuck_s = 1.0;  ///< [s] a shorter constant stretch is never called stuck
  /// A constant stretch is a fault when its probability, by how often the channel repeats a value in the same state of
  /// the machine, is below this. Divided by the number of samples.
  double stuck_chance = 1e-9;
  /// Noise of a block of one second over the median of the peers. A block's estimate scatters by a fifth, so 3 is eight
  /// of its standard deviations above equal noise; sensors up to twice as noisy as others are accepted.
  double noise_ratio = 3.0;
  double noise_bursts_s = 2.0;  ///< [s] least total duration of noisy blocks
  double jump_noise = 10.0;     ///< least size of a jump in standard deviations of the noise
  double jump_back_s = 10.0;    ///< [s] within which a jump must return
  double missing_share = 0.2;   ///< of a channel's samples without a value
  // Smaller noise or jumps do not affect the results and are not reported.
  double least_pressure = 5e3;      ///< [Pa] noise; jumps: twenty times
  double least_command = 0.03;      ///< [-] noise; jumps: five times
  double least_speed_share = 0.02;  ///< position noise as filtered speed over the joint's limit
};

/// @param signals of the same log and machine
/// @return the faulty channels, largest share of samples first; at most one entry for each channel
std::vector<BadChannel> find_bad_channels(const Machine& machine, const Log& log,
                                          const MachineSignals& signals,
                                          const BadDataOptions& options = {});

/// @return e.g. "pA_boom is noisy between 12.0 and 38.5 s (22 % of the log): its noise there is 5.1 bar ..."
std::string bad_channel_sentence(const BadChannel& bad);

}  // namespace sparflow
