#pragma once
/// Sets aside what the data checks found faulty, so that the rest of a log can be judged.
#include <vector>

#include "identification/data_checks/bad_data.h"

namespace sparflow {

/// The log without the faulty stretches of these channels: their values are NaN and not valid there, the whole channel
/// where no stretch is known. Holes of a few samples are interpolated as in a log that lacks them (fill_holes), because a filter
/// does not reach across a hole. Other channels stay as they are.
Log without_bad_data(Log log, const std::vector<BadChannel>& bad);

/// Faults that stay in the signals.
enum class Staying {
  kAll,      ///< where the caller does not want data checks: nothing is looked for
  kNothing,  ///< where laws are learned
  kJumps,  ///< of a single channel, where effects are sought: a late pump jumps as well as a sensor
  kJumpsAndRipples  ///< where errors are stated: a ripple of millimetres falsifies speeds, and hardly a static force
};

/// Signals of a log without what the data checks found faulty in it.
struct CheckedSignals {
  MachineSignals signals;
  std::vector<BadChannel> bad;  ///< all that was found, also what stays
};

/// Whether a fault stays.
bool stays(const BadChannel& bad, Staying staying);

/// @throws InputError as make_signals
CheckedSignals checked_signals(const Machine& machine, const Log& log, const SignalOptions& signals,
                               const BadDataOptions& bad_data, Staying staying);

}  // namespace sparflow
