#pragma once
/// Second-order forward-mode dual numbers of fixed size: value, gradient and Hessian carried through any
/// formula templated on its scalar, exact to rounding. They are the second code path that checks the hand-derived
/// derivatives of the inner loops (Fike & Alonso 2011, hyper-dual numbers, in packed form).
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace sparflow {

template <int N>
struct Dual2 {
  static constexpr int kPacked = N * (N + 1) / 2;
  double value = 0.0;
  std::array<double, N> gradient{};
  std::array<double, kPacked> hessian{};  // lower triangle, row by row

  Dual2() = default;
  Dual2(double v) : value(v) {}  // NOLINT: constants mix freely with duals
  static Dual2 variable(double v, int index) {
    Dual2 d(v);
    d.gradient[static_cast<std::size_t>(index)] = 1.0;
    return d;
  }
  double hess(int i, int j) const {
    return hessian[static_cast<std::size_t>(i >= j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i)];
  }

  /// f(this) for a scalar function with value f0 and derivatives f1, f2.
  Dual2 chain(double f0, double f1, double f2) const {
    Dual2 r(f0);
    for (std::size_t i = 0, p = 0; i < N; ++i) {
      r.gradient[i] = f1 * gradient[i];
      for (std::size_t j = 0; j <= i; ++j, ++p) {
        r.hessian[p] = f1 * hessian[p] + f2 * gradient[i] * gradient[j];
      }
    }
    return r;
  }
  Dual2& operator+=(const Dual2& b) { return *this = *this + b; }
  Dual2& operator-=(const Dual2& b) { return *this = *this - b; }
  Dual2& operator*=(const Dual2& b) { return *this = *this * b; }
  Dual2& operator/=(const Dual2& b) { return *this = *this / b; }

  friend Dual2 operator+(const Dual2& a, const Dual2& b) {
    Dual2 r(a.value + b.value);
    for (std::size_t i = 0; i < N; ++i) r.gradient[i] = a.gradient[i] + b.gradient[i];
    for (std::size_t p = 0; p < kPacked; ++p) r.hessian[p] = a.hessian[p] + b.hessian[p];
    return r;
  }
  friend Dual2 operator-(const Dual2& a) { return a.chain(-a.value, -1.0, 0.0); }
  friend Dual2 operator-(const Dual2& a, const Dual2& b) { return a + (-b); }
  friend Dual2 operator*(const Dual2& a, const Dual2& b) {
    Dual2 r(a.value * b.value);
    for (std::size_t i = 0, p = 0; i < N; ++i) {
      r.gradient[i] = a.gradient[i] * b.value + a.value * b.gradient[i];
      for (std::size_t j = 0; j <= i; ++j, ++p) {
        r.hessian[p] = a.hessian[p] * b.value + a.value * b.hessian[p] +
                       a.gradient[i] * b.gradient[j] + a.gradient[j] * b.gradient[i];
      }
    }
    return r;
  }
  friend Dual2 operator/(const Dual2& a, const Dual2& b) {
    const double inverse = 1.0 / b.value;
    return a * b.chain(inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse);
  }
  friend bool operator<(const Dual2& a, const Dual2& b) { return a.value < b.value; }
  friend bool operator>(const Dual2& a, const Dual2& b) { return a.value > b.value; }
  friend bool operator==(const Dual2& a, const Dual2& b) { return a.value == b.value; }

  friend Dual2 sin(const Dual2& a) {
    return a.chain(std::sin(a.value), std::cos(a.value), -std::sin(a.value));
  }
  friend Dual2 cos(const Dual2& a) {
    return a.chain(std::cos(a.value), -std::sin(a.value), -std::cos(a.value));
  }
  friend Dual2 sqrt(const Dual2& a) {
    const double s = std::sqrt(a.value);
    return a.chain(s, 0.5 / s, -0.25 / (s * a.value));
  }
  friend Dual2 exp(const Dual2& a) {
    const double e = std::exp(a.value);
    return a.chain(e, e, e);
  }
  friend Dual2 log(const Dual2& a) {
    return a.chain(std::log(a.value), 1.0 / a.value, -1.0 / (a.value * a.value));
  }
  friend Dual2 tanh(const Dual2& a) {
    const double t = std::tanh(a.value);
    const double t1 = 1.0 - t * t;
    return a.chain(t, t1, -2.0 * t * t1);
  }
  friend Dual2 abs(const Dual2& a) { return a.value < 0.0 ? -a : a; }
};

/// Third-order Taylor number of one variable: value and three derivatives. Linkages need the third,
/// because the Hessian of the static force contains d^3 x / dq^3.
struct Taylor3 {
  double value = 0.0, d1 = 0.0, d2 = 0.0, d3 = 0.0;

  Taylor3() = default;
  Taylor3(double v) : value(v) {}  // NOLINT: constants mix freely
  static Taylor3 variable(double v) {
    Taylor3 t(v);
    t.d1 = 1.0;
    return t;
  }
  /// f(this) by Faa di Bruno, with derivatives f1, f2, f3 of f.
  Taylor3 chain(double f0, double f1, double f2, double f3) const {
    Taylor3 r(f0);
    r.d1 = f1 * d1;
    r.d2 = f1 * d2 + f2 * d1 * d1;
    r.d3 = f1 * d3 + 3.0 * f2 * d1 * d2 + f3 * d1 * d1 * d1;
    return r;
  }
  Taylor3& operator+=(const Taylor3& b) { return *this = *this + b; }
  Taylor3& operator-=(const Taylor3& b) { return *this = *this - b; }
  Taylor3& operator*=(const Taylor3& b) { return *this = *this * b; }
  Taylor3& operator/=(const Taylor3& b) { return *this = *this / b; }

  friend Taylor3 operator+(const Taylor3& a, const Taylor3& b) {
    Taylor3 r(a.value + b.value);
    r.d1 = a.d1 + b.d1;
    r.d2 = a.d2 + b.d2;
    r.d3 = a.d3 + b.d3;
    return r;
  }
  friend Taylor3 operator-(const Taylor3& a) { return a.chain(-a.value, -1.0, 0.0, 0.0); }
  friend Taylor3 operator-(const Taylor3& a, const Taylor3& b) { return a + (-b); }
  friend Taylor3 operator*(const Taylor3& a, const Taylor3& b) {
    Taylor3 r(a.value * b.value);
    r.d1 = a.d1 * b.value + a.value * b.d1;
    r.d2 = a.d2 * b.value + 2.0 * a.d1 * b.d1 + a.value * b.d2;
    r.d3 = a.d3 * b.value + 3.0 * (a.d2 * b.d1 + a.d1 * b.d2) + a.value * b.d3;
    return r;
  }
  friend Taylor3 operator/(const Taylor3& a, const Taylor3& b) {
    const double i = 1.0 / b.value;
    return a * b.chain(i, -i * i, 2.0 * i * i * i, -6.0 * i * i * i * i);
  }
  friend bool operator<(const Taylor3& a, const Taylor3& b) { return a.value < b.value; }
  friend bool operator>(const Taylor3& a, const Taylor3& b) { return a.value > b.value; }
  friend bool operator==(const Taylor3& a, const Taylor3& b) { return a.value == b.value; }

  friend Taylor3 sin(const Taylor3& a) {
    const double s = std::sin(a.value), c = std::cos(a.value);
    return a.chain(s, c, -s, -c);
  }
  friend Taylor3 cos(const Taylor3& a) {
    const double s = std::sin(a.value), c = std::cos(a.value);
    return a.chain(c, -s, -c, s);
  }
  friend Taylor3 sqrt(const Taylor3& a) {
    const double s = std::sqrt(a.value);
    return a.chain(s, 0.5 / s, -0.25 / (s * a.value), 0.375 / (s * a.value * a.value));
  }
};

/// The plain number inside a scalar, for branches that must not depend on derivatives.
inline double plain(double x) { return x; }
template <int N>
double plain(const Dual2<N>& x) {
  return x.value;
}
inline double plain(const Taylor3& x) { return x.value; }

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

}  // namespace sparflow

namespace Eigen {
template <int N>
struct NumTraits<sparflow::Dual2<N>> : NumTraits<double> {
  using Real = sparflow::Dual2<N>;
  using NonInteger = sparflow::Dual2<N>;
  using Nested = sparflow::Dual2<N>;
  enum { RequireInitialization = 1, ReadCost = N * N, AddCost = N * N, MulCost = 4 * N * N };
};
template <>
struct NumTraits<sparflow::Taylor3> : NumTraits<double> {
  using Real = sparflow::Taylor3;
  using NonInteger = sparflow::Taylor3;
  using Nested = sparflow::Taylor3;
  enum { RequireInitialization = 1, ReadCost = 4, AddCost = 4, MulCost = 12 };
};
}  // namespace Eigen
