#pragma once
/// Packs the result of a start for the pipe from its child process to the parent.
#include <string>

#include "optimizer/solve/optimize.h"

namespace sparflow {

std::string pack_start(const StartResult& r);
StartResult unpack_start(const std::string& bytes);

}  // namespace sparflow
