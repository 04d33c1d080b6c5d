#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "models/files/machine_file.h"
#include "simulator/hidden_effects/hidden_effect.h"

namespace sparflow::simulator {

inline Machine machine_named(const std::string& name) {
  return load_machine(SPARFLOW_SOURCE_DIR "/problems/machines/" + name + ".yaml");
}

inline LogRequest quiet_request(const Machine& machine, double seconds = 60.0) {
  LogRequest request;
  request.machine = machine;
  request.seconds = seconds;
  request.crane_seed = 5;
  request.motion_seed = 9;
  request.noise_factor = 0.0;
  return request;
}

/// Largest absolute difference of two columns.
inline double difference(const GeneratedLog& a, const GeneratedLog& b, const std::string& column) {
  const auto *x = a.find(column), *y = b.find(column);
  if (!x || !y || x->size() != y->size()) return INFINITY;
  double most = 0.0;
  for (std::size_t i = 0; i < x->size(); ++i) most = std::max(most, std::abs((*x)[i] - (*y)[i]));
  return most;
}

}  // namespace sparflow::simulator
