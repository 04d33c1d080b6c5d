#pragma once
/// Random variations of given machines, so that a diagnosis is not tuned to one crane.
#include <cstdint>

#include "models/machine/machine.h"

namespace sparflow::simulator {

struct MachineVariation {
  double spread = 0.15;  ///< [-] share by which dimensions, masses, bores and valve flows vary
  bool drop_telescope = false;  ///< a prismatic last joint is fixed at half its stroke
  bool add_slewing =
      false;               ///< a slewing joint with rack and pinion is added before the first joint
  bool two_pumps = false;  ///< a second load-sensing pump takes over some cylinders
};

/// Varies the dimensions of a machine. @return a machine that passes check_machine()
Machine vary_machine(const Machine& drawing, const MachineVariation& variation, std::uint64_t seed);

/// Draws one of the machines and a variation of it: unchanged structure, no telescope, slewing, or two pumps.
Machine random_machine(const std::vector<Machine>& drawings, std::uint64_t seed);

}  // namespace sparflow::simulator
