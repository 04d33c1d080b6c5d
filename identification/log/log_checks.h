#pragma once
/// Finds values that are implausible for the machine: a wrong unit, a stuck sensor, a joint outside its range.
#include "identification/log/log.h"

namespace sparflow {

/// Adds a sentence to `log->warnings` for each implausible channel, with what to do about it. No value is changed.
void check_plausible(const Machine& machine, Log* log);

}  // namespace sparflow
