#pragma once
/// Learns how a pressure model is extrapolated beyond the loads of its samples (models/hydraulics/loads_beyond.h).
#include <optional>

#include "identification/learning/gaussian_process/learn_pressure.h"
#include "identification/learning/learning_options.h"
#include "models/machine/machine.h"

namespace sparflow {

/// Slope over the load for samples whose loads vary too little to determine it (a slewing cylinder on level ground has no
/// load at all). The share of an additional load that raises the supply pressure is estimated from the pressure's level:
/// near the load it is the static branch, which takes all of it; far above it a valve holds the pressure. This estimate is
/// averaged with the samples' own slope. The share lies between 0 and 1; a steeper slope is friction that is correlated
/// with the load.
struct SimilarLoads {
  double force = 0.0;            ///< [N] median
  double slope = 0.0;            ///< [Pa/N] of the supply over the force
  double slope_deviation = 0.0;  ///< [Pa/N] standard deviation, as the branch is not certain
};

/// @param samples of one pressure model  @param side +1 extends, -1 retracts
/// @return nothing where the loads vary enough to learn a slope, or without samples
std::optional<SimilarLoads> similar_loads(const GpDataset& samples, const Cylinder& cylinder,
                                          int side, const LoadsBeyondOptions& options = {});

/// Corrects the samples to the median load, so that a pressure model of the flow alone can be learned from them.
GpDataset at_one_load(GpDataset samples, const SimilarLoads& loads);

/// Extends a pressure model that was learned at one load to any load.
/// @param samples before they were corrected to one load; their range becomes the model's
GpParameters for_any_load(GpParameters learned, const SimilarLoads& loads,
                          const GpDataset& samples);

/// Learns the static level and the slopes for loads heavier and lighter than the samples'.
/// @param parameters of the pressure model learned from `samples`, with their range
/// @param side +1 extends, -1 retracts
LoadsBeyond learn_loads_beyond(const GpParameters& parameters, const GpDataset& samples,
                               const Cylinder& cylinder, int side,
                               const LoadsBeyondOptions& options = {});

}  // namespace sparflow
