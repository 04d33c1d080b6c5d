#pragma once
/// Brings the channels of a recording, each with time stamps of its own, to one clock: a table with one row for each instant.
/// docs/recordings.md says how the clock is chosen and what is interpolated.
#include <vector>

#include "identification/log/log_table.h"
#include "identification/log/recordings/recording.h"
#include "models/math/door.h"

namespace sparflow {

struct ClockOptions {
  double step = 0.0;  ///< [s] of a uniform clock; 0 = chosen from the channels
  /// Channels, by index, that the clock follows: a fast channel that nobody uses would only add rows. Empty = all.
  std::vector<std::size_t> leading;
  /// Samples of a channel that are further apart than this many of its own median steps have a gap between them, in which
  /// the channel has no value.
  /// @threshold [1] 2..20; chosen: the same as the gap in a log's rows; a few lost frames of a bus are bridged
  double gap_steps = 5.0;
  /// Share of the channels that must stand on the same time stamps for these to become the clock.
  /// @threshold [1] 0.3..1; chosen: half of the channels stay as they were measured
  double dominating = 0.5;
  /// Largest ratio of two median steps that still count as one rate.
  /// @threshold [1] 1.1..1.9; chosen: stamps jitter, rates of one machine differ by factors of two
  double same_rate = 1.5;
  /// Share of the channels, the fastest ones, whose median step becomes that of a uniform clock.
  /// @threshold [1] 0.05..1; chosen: a single fast sensor among many does not decide
  double fastest = 0.25;
  /// Finest step of a uniform clock that is chosen.
  /// @threshold [s] 1e-4..0.01; chosen: that of a log (LogOptions), which thins what is finer
  double finest_step = 1e-3;
  /// Largest number of different values, all whole numbers, of a channel that is held and not interpolated: between gear 1 and
  /// gear 3 no gear 2 was engaged.
  /// @threshold [1] 2..64; chosen: states have few values, readings of sensors have more
  std::size_t most_states = 16;
  DoorLimits limits;
};

/// @return columns t_s and one for each channel that has two instants or more, NaN before its first and behind its last
///   sample, in its gaps, and beside samples that are not valid; the clock in words is part of `dialect`. No row stands
///   where all channels that the clock follows have gaps.
/// @throws InputError when no channel has two instants, and for more rows than a log may have
RawTable on_one_clock(const Recording& recording, const ClockOptions& options = {});

}  // namespace sparflow
