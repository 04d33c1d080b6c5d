#pragma once
/// Numeric derivatives, and the random numbers of property tests.
#include <Eigen/Dense>
#include <random>

namespace sparflow::test_support {

/// f'(x) by central differences at h, h/2, h/4 and two Richardson extrapolations: truncation O(h^6).
/// f may return a number or an Eigen vector or matrix. With h = 1e-2 and functions that vary over a length of
/// about one, truncation is near 1e-13 and rounding near 1e-13 of |f|: a relative tolerance of 1e-9 leaves
/// a factor of 1e3 for functions that vary faster.
template <class F>
auto numeric_derivative(const F& f, double x, double h = 1e-2) {
  const auto central = [&](double step) {
    return decltype(f(x))((f(x + step) - f(x - step)) / (2.0 * step));
  };
  using Value = decltype(f(x));
  const Value d1 = central(h), d2 = central(h / 2), d3 = central(h / 4);
  const Value e1 = (4.0 * d2 - d1) / 3.0, e2 = (4.0 * d3 - d2) / 3.0;
  return Value((16.0 * e2 - e1) / 15.0);
}

/// The same along one coordinate of a vector.
template <class F>
auto numeric_partial(const F& f, const Eigen::VectorXd& x, Eigen::Index k, double h = 1e-2) {
  return numeric_derivative(
      [&](double value) {
        Eigen::VectorXd moved = x;
        moved[k] = value;
        return f(moved);
      },
      x[k], h);
}

inline constexpr double kDerivativeTolerance = 1e-9;  ///< relative, see numeric_derivative

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(engine_);
  }
  int integer(int lo, int hi) { return std::uniform_int_distribution<int>(lo, hi)(engine_); }
  Eigen::Vector3d vector(double half_width) {
    return {uniform(-half_width, half_width), uniform(-half_width, half_width),
            uniform(-half_width, half_width)};
  }
  Eigen::Vector3d direction() {
    Eigen::Vector3d v;
    do {
      v = vector(1.0);
    } while (v.norm() < 0.1 || v.norm() > 1.0);
    return v.normalized();
  }

 private:
  std::mt19937 engine_;
};

}  // namespace sparflow::test_support
