#pragma once
/// A start's result as bytes, from the child process that solved it to its parent.
#include <string>

#include "optimizer/solve/optimize.h"

namespace sparflow {

std::string pack_start(const StartResult& r);
StartResult unpack_start(const std::string& bytes);

}  // namespace sparflow
