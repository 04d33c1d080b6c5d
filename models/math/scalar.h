#pragma once
/// What formulas templated on their scalar need beside the scalar itself.
#include <Eigen/Core>

namespace sparflow {

/// The plain number inside a scalar, for branches that must not depend on derivatives. Each number type has its own.
inline double plain(double x) { return x; }

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

}  // namespace sparflow
