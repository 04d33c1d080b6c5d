#pragma once
/// What a learned pressure says beyond the loads it has seen (models/hydraulics/loads_beyond.h), from the same samples.
#include <optional>

#include "identification/learning/gaussian_process/learn_pressure.h"
#include "models/machine/machine.h"

namespace sparflow {

/// Loads so alike that samples show little of a slope over them (a slewing cylinder on level ground carries none at all).
/// Which share of a larger one the supply takes follows from where it stands, near the load on the static branch, which
/// takes all of it, or far above, where a valve holds it; and from the samples as far as they show one. It lies between 0 and
/// 1: what is steeper is friction that moves along with the load.
struct AlikeLoads {
  double force = 0.0;            ///< [N] median
  double slope = 0.0;            ///< [Pa/N] of the supply over the force
  double slope_deviation = 0.0;  ///< [Pa/N] which of the branches it is is not known for sure
};

/// @param samples of one process  @param side +1 extends, -1 retracts
/// @return nothing where the loads vary enough for a slope, or without samples
std::optional<AlikeLoads> alike_loads(const GpDataset& samples, const Cylinder& cylinder, int side);

/// The samples as they would be under the median load: what a process of the flow alone is learned from.
GpDataset at_one_load(GpDataset samples, const AlikeLoads& loads);

/// The process learned from those, for any load.
/// @param samples before they were taken to one load: their range is the process'
GpParameters for_any_load(GpParameters learned, const AlikeLoads& loads, const GpDataset& samples);

/// @param parameters of the process learned from `samples`, with their range
/// @param side +1 extends, -1 retracts
LoadsBeyond learn_loads_beyond(const GpParameters& parameters, const GpDataset& samples,
                               const Cylinder& cylinder, int side);

}  // namespace sparflow
