#pragma once
/// Traits by which Eigen's vectors and matrices can hold Jets; kinematics templated on the scalar need them.
#include <Eigen/Core>

#include "models/math/jet.h"

namespace Eigen {
template <>
struct NumTraits<sparflow::Jet> : NumTraits<double> {
  using Real = sparflow::Jet;
  using NonInteger = sparflow::Jet;
  using Nested = sparflow::Jet;
  enum { RequireInitialization = 1, ReadCost = 50, AddCost = 50, MulCost = 200 };
};
}  // namespace Eigen
