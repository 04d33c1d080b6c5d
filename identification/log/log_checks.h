#pragma once
/// Values that are numbers but cannot be right: a unit mistaken, a sensor stuck, a joint outside its range.
#include "identification/log/log.h"

namespace sparflow {

/// Adds one plain sentence to `log->warnings` for each suspicion, with what to do about it.
void check_plausible(const Machine& machine, Log* log);

}  // namespace sparflow
