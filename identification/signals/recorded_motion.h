#pragma once
/// A recorded motion as a trajectory, so that it can be priced and drawn like one that was computed.
#include "identification/signals/signals.h"
#include "models/machine/trajectory.h"

namespace sparflow {

/// The motion of one gap-free stretch: smoothed positions, and speeds that are zero wherever the joint's cylinder does not
/// move (a sensor's noise is no flow). Between rows the acceleration is constant, as everywhere.
/// @param range samples of the stretch, at least two
Trajectory recorded_motion(const Machine& machine, const MachineSignals& signals,
                           const SampleRange& range);

/// The longest gap-free stretch of the signals in which every joint's position is known; empty when there is none.
SampleRange longest_stretch(const MachineSignals& signals);

}  // namespace sparflow
