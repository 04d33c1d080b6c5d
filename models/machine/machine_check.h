#pragma once
/// Checks a machine as a whole, for errors that no single line of its file shows.
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/error.h"

namespace sparflow {

/// Places of the machine's parts in its file, in the order of the machine's lists. Empty lists: not known.
struct MachinePlaces {
  std::string file;
  std::vector<FilePlace> joints, links, cylinders, pumps, valves;
};

/// Errors: names that occur twice; a cylinder fed by two pumps; a joint with two cylinders; a valve or pump for
/// a drive without hydraulics; over the joint's range a dead centre (dx/dq changes sign or falls below
/// 1 % of its largest value), a four-bar that cannot close, or more than a turn for a pinned cylinder (degrees
/// written for radians). The message names cylinder and joint position.
/// @return warnings, one sentence each: what is unusual but possible (no pump, no valve, stroke exceeded,
///   no gravity, angles that look like degrees, ...)
/// @throws InputError at the first error
std::vector<std::string> check_machine(const Machine& machine, const MachinePlaces& places = {});

}  // namespace sparflow
