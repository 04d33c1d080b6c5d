#pragma once
/// What the files of CraneKnotModel share: the units its rows and costs are scaled to.
#include <limits>

#include "models/math/jet.h"

namespace sparflow::knot_units {

constexpr double kPowerUnit = 1e3;     // kW
constexpr double kFlowUnit = 1e-3;     // l/s
constexpr double kPressureUnit = 1e7;  // 100 bar
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Adds factor times the derivatives of a jet over all of z; null: not asked for. @param hessian symmetric
inline void add_jet(const Jet& jet, double factor, double* gradient, double* hessian) {
  const int n = jet.variables();  // 0 for a constant
  for (int i = 0; i < n; ++i) {
    if (gradient != nullptr) gradient[i] += factor * jet.gradient(i);
    for (int j = 0; j < n && hessian != nullptr; ++j)
      hessian[i * n + j] += factor * jet.hessian(i, j);
  }
}

}  // namespace sparflow::knot_units
