#pragma once

#include <limits>

namespace sparflow {

/// A value that was not measured or cannot be said.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace sparflow
