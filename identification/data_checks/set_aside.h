#pragma once
/// Sets aside what the data checks found faulty, so that the rest of a log can be judged.
#include <vector>

#include "identification/data_checks/bad_data.h"

namespace sparflow {

/// The log without the faulty stretches of these channels: their values are NaN and not valid there, the whole channel
/// where no stretch is known. Holes of a few samples are interpolated as in a log that lacks them (fill_holes), because a filter
/// does not reach across a hole. Other channels stay as they are.
Log without_bad_data(Log log, const std::vector<BadChannel>& bad);

/// What is done with jumps of a single channel, which come from its sensor or from physics that a model lacks (a late pump).
enum class Jumps {
  kStay,     ///< where a model is judged, because an effect may explain them
  kSetAside  ///< where static laws are learned, which contain no jumps in either case
};

/// Signals of a log without what the data checks found faulty in it.
struct CheckedSignals {
  MachineSignals signals;
  std::vector<BadChannel> bad;  ///< all that was found, jumps that stay included
};

/// @throws InputError as make_signals
CheckedSignals checked_signals(const Machine& machine, const Log& log, const SignalOptions& signals,
                               const BadDataOptions& bad_data, Jumps jumps);

}  // namespace sparflow
