#pragma once
/// Ranges of the numbers that a task is given. The command line checks them as it reads; tasks check them again, because Python gives
/// them unread.
#include <fmt/format.h>

#include <string>

#include "models/math/error.h"

namespace sparflow {

/// @param option verb and option, "audit: --moves"  @throws UsageError for a number outside the range, or NaN
inline void require_range(const char* option, double value, double lo, double hi) {
  if (value >= lo && value <= hi) return;
  throw UsageError(fmt::format("{} got {}; expected {} to {}", option, value, lo, hi));
}

/// The same of an option that may be absent. @param absent its value then
inline void require_range_or(const char* option, double value, double absent, double lo,
                             double hi) {
  if (value != absent) require_range(option, value, lo, hi);
}

}  // namespace sparflow
