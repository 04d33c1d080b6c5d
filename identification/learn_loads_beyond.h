#pragma once
/// What a learned pressure says beyond the loads it has seen (models/loads_beyond.h), from the same samples.
#include "identification/learn_pressure.h"
#include "models/machine.h"

namespace sparflow {

/// @param parameters of the process learned from `samples`, with their range
/// @param side +1 extends, -1 retracts
LoadsBeyond learn_loads_beyond(const GpParameters& parameters, const GpDataset& samples,
                               const Cylinder& cylinder, int side);

}  // namespace sparflow
