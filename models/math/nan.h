#pragma once

#include <limits>

namespace sparflow {

/// Stands for a value that was not measured or cannot be computed.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace sparflow
