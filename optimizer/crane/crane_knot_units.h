#pragma once
/// Units to which rows and costs of CraneKnotModel are scaled, shared by its files.
#include <limits>

#include "models/math/jet.h"

namespace sparflow::knot_units {

// no threshold: units
constexpr double kPowerUnit = 1e3;     // kW
constexpr double kFlowUnit = 1e-3;     // l/s
constexpr double kPressureUnit = 1e7;  // 100 bar
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Adds factor times the derivatives of a jet over all of z. @param gradient, hessian null = not wanted; full symmetric
inline void add_jet(const Jet& jet, double factor, double* gradient, double* hessian) {
  const int n = jet.variables();  // 0 for a constant
  for (int i = 0; i < n; ++i) {
    if (gradient != nullptr) gradient[i] += factor * jet.gradient(i);
    for (int j = 0; j < n && hessian != nullptr; ++j)
      hessian[i * n + j] += factor * jet.hessian(i, j);
  }
}

}  // namespace sparflow::knot_units
