#pragma once
/// Sets aside what the data checks found faulty, so that the rest of a log can be judged.
#include <vector>

#include "identification/data_checks/bad_data.h"

namespace sparflow {

/// The log without the faulty stretches of these channels: their values are NaN and not valid there, the whole channel
/// where no stretch is known. Holes of a few samples are interpolated as in a log that lacks them (fill_holes), because a filter
/// does not reach across a hole. Other channels stay as they are.
Log without_bad_data(Log log, const std::vector<BadChannel>& bad);

}  // namespace sparflow
