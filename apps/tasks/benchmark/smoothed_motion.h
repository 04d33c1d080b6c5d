#pragma once
/// A motion whose speeds change gradually, as valves and a hanging load can follow it.
#include "models/machine/trajectory.h"

namespace sparflow {

/// The moving average of a motion over `width` seconds, which begins and ends with it at rest and takes that much longer.
/// Positions, speeds and accelerations stay within every limit that is a range, as averages of such values. @param width [s]
/// 0: the motion itself
Trajectory smoothed(const Trajectory& motion, double width);

}  // namespace sparflow
