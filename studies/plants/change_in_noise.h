#pragma once
/// How far a change of a plant shows in the sensors of a log, whatever is made of that log.
#include <cstdint>
#include <span>
#include <string>

#include "models/machine/machine.h"
#include "simulator/plant/parameters/plant_parameters.h"
#include "simulator/plant/run/plant_run.h"

namespace sparflow::bench {

struct ChangeInNoise {
  std::string channel;  ///< in which the change shows most, by the name of the log's column
  /// Change (RMS over a stretch of some seconds, the largest of all stretches and channels) over the noise of that channel's sensor. [-]
  double ratio = 0.0;
};

/// What was changed between the reference and the suspect log.
struct PlantChange {
  const plant::PlantParameters &as_built, &changed;
  double told =
      1.0;  ///< factor of the payload that the log tells; the plant as built carries the told one
};

/// Runs the plant as built and as changed side by side: from rest at the postures of `records`, every few seconds, with the commands
/// that follow there. What differs is the change alone, while an operator who closes the loop would hide or amplify it.
/// @param records of the changed plant, at equal steps of time
ChangeInNoise change_in_noise(const Machine& machine, const PlantChange& change,
                              std::span<const plant::Record> records, std::uint64_t seed);

}  // namespace sparflow::bench
