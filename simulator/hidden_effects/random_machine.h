#pragma once
/// Machines that no file describes: variations of a template, so that a diagnosis is not tuned to one crane.
#include <cstdint>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct MachineVariation {
  double spread = 0.15;         ///< dimensions, masses, bores and valve flows vary by this share
  bool drop_telescope = false;  ///< a prismatic last joint becomes fixed, half out
  bool add_slewing = false;     ///< a rack-and-pinion slewing joint before the first one
  bool two_pumps = false;       ///< a second load-sensing pump takes over some cylinders
};

/// @return a machine that passes check_machine
Machine vary_machine(const Machine& drawing, const MachineVariation& variation, std::uint64_t seed);

/// Draws a template and a variation of it: as drawn, without telescope, with slewing, with two pumps.
Machine random_machine(const std::vector<Machine>& drawings, std::uint64_t seed);

}  // namespace sparflow::simulator
