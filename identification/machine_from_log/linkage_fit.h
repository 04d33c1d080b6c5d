#pragma once
/// Finds what is open in a cylinder's linkage from strokes and joint positions.
///
/// A cylinder between two pins at the distances a and b from a revolute joint has (s + L0)^2 = a^2 + b^2 - 2 a b cos(q + phi)
/// with the stroke s and the length L0 at zero stroke, which is linear in L0, a^2 + b^2, a b cos(phi) and a b sin(phi): the
/// linear solution starts a least-squares fit of the stroke, in which each row weighs by the noise of the stroke and of the
/// joint position seen through dx/dq. Source: Fuller (1987), Measurement Error Models, sec. 3.2.
#include <vector>

#include "identification/machine_from_log/sketch_samples.h"

namespace sparflow::from_log {

struct LinkageFit {
  bool determined = false;
  std::vector<FoundValue> values;
  std::vector<MachineQuestion> questions;
  std::vector<std::string> notes;
  std::vector<std::string> warnings;
};

/// @param machine of the sketch; its cylinder gets the linkage that was found
LinkageFit fit_linkage(const MachineSketch& sketch, int cylinder, const SketchRows& rows,
                       const MachineFromLogOptions& options, Machine& machine);

}  // namespace sparflow::from_log
