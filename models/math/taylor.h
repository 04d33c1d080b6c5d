#pragma once
/// Truncated Taylor series of one variable, to any order, by the classical recurrences (Griewank & Walther 2008,
/// Evaluating Derivatives, sec. 13.2). Linkages depend on one joint each: statics need three derivatives of a length,
/// because the Hessian of the static force contains d^3 x / dq^3, and dynamics need a fourth.
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "models/math/scalar.h"

namespace sparflow {

/// Calls f(integral_constant 0), f(1) ... f(count - 1). With -O2 a loop over so few coefficients is not unrolled, and these
/// numbers are in the inner loop of an optimisation; for the same reason the calls are always inlined.
template <class F, std::size_t... i>
[[gnu::always_inline]] inline void unrolled(const F& f, std::index_sequence<i...>) {
  (f(std::integral_constant<std::size_t, i>()), ...);
}
template <std::size_t count, class F>
[[gnu::always_inline]] inline void unrolled(const F& f) {
  unrolled(f, std::make_index_sequence<count>());
}

template <int N>
struct TaylorSeries {
  static constexpr std::size_t kCount = N + 1;
  /// coefficient[k] = f^(k) / k!
  std::array<double, kCount> coefficient{};

  TaylorSeries() = default;
  TaylorSeries(double v) { coefficient[0] = v; }  // NOLINT: constants mix freely
  static TaylorSeries variable(double v) {
    TaylorSeries t(v);
    t.coefficient[1] = 1.0;
    return t;
  }
  static TaylorSeries from_derivatives(const std::array<double, kCount>& derivatives) {
    TaylorSeries t;
    unrolled<kCount>([&](auto k) { t.coefficient[k] = derivatives[k] * (1.0 / kFactorial[k]); });
    return t;
  }
  double value() const { return coefficient[0]; }
  double derivative(int k) const {
    const auto i = static_cast<std::size_t>(k);
    return kFactorial[i] * coefficient[i];
  }

  TaylorSeries& operator+=(const TaylorSeries& b) { return *this = *this + b; }
  TaylorSeries& operator-=(const TaylorSeries& b) { return *this = *this - b; }
  TaylorSeries& operator*=(const TaylorSeries& b) { return *this = *this * b; }
  TaylorSeries& operator/=(const TaylorSeries& b) { return *this = *this / b; }

  friend TaylorSeries operator+(const TaylorSeries& a, const TaylorSeries& b) {
    TaylorSeries r;
    unrolled<kCount>([&](auto k) { r.coefficient[k] = a.coefficient[k] + b.coefficient[k]; });
    return r;
  }
  friend TaylorSeries operator-(const TaylorSeries& a, const TaylorSeries& b) {
    TaylorSeries r;
    unrolled<kCount>([&](auto k) { r.coefficient[k] = a.coefficient[k] - b.coefficient[k]; });
    return r;
  }
  friend TaylorSeries operator-(const TaylorSeries& a) { return -1.0 * a; }
  friend TaylorSeries operator*(double a, const TaylorSeries& b) {
    TaylorSeries r;
    unrolled<kCount>([&](auto k) { r.coefficient[k] = a * b.coefficient[k]; });
    return r;
  }
  friend TaylorSeries operator*(const TaylorSeries& a, const TaylorSeries& b) {
    TaylorSeries r;
    unrolled<kCount>([&](auto k) { r.coefficient[k] = convolved<0, k>(a, b, k); });
    return r;
  }
  friend TaylorSeries operator/(const TaylorSeries& a, const TaylorSeries& b) {
    const double inverse = 1.0 / b.coefficient[0];
    TaylorSeries r;
    unrolled<kCount>([&](auto k) {
      double rest = a.coefficient[k];
      if constexpr (k > 0) rest -= convolved<0, k - 1>(r, b, k);
      r.coefficient[k] = rest * inverse;
    });
    return r;
  }
  friend bool operator<(const TaylorSeries& a, const TaylorSeries& b) {
    return a.coefficient[0] < b.coefficient[0];
  }
  friend bool operator>(const TaylorSeries& a, const TaylorSeries& b) { return b < a; }
  friend bool operator==(const TaylorSeries& a, const TaylorSeries& b) {
    return a.coefficient[0] == b.coefficient[0];
  }

  friend TaylorSeries sqrt(const TaylorSeries& a) {
    TaylorSeries r(std::sqrt(a.coefficient[0]));
    const double half = 0.5 / r.coefficient[0];
    unrolled<N>([&](auto below) {
      constexpr std::size_t k = below + 1;
      double rest = a.coefficient[k];
      if constexpr (k > 1) rest -= convolved<1, k - 1>(r, r, k);
      r.coefficient[k] = rest * half;
    });
    return r;
  }
  /// Both at once: each recurrence needs the other.
  static void sin_cos(const TaylorSeries& a, TaylorSeries& s, TaylorSeries& c) {
    s = TaylorSeries(std::sin(a.coefficient[0]));
    c = TaylorSeries(std::cos(a.coefficient[0]));
    TaylorSeries d;  // the derivative of a
    unrolled<N>([&](auto k) {
      d.coefficient[k] = static_cast<double>(k + 1) * a.coefficient[k + 1];
      constexpr double share = 1.0 / static_cast<double>(k + 1);
      s.coefficient[k + 1] = share * convolved<0, k>(d, c, k);
      c.coefficient[k + 1] = -share * convolved<0, k>(d, s, k);
    });
  }
  friend TaylorSeries sin(const TaylorSeries& a) {
    TaylorSeries s, c;
    sin_cos(a, s, c);
    return s;
  }
  friend TaylorSeries cos(const TaylorSeries& a) {
    TaylorSeries s, c;
    sin_cos(a, s, c);
    return c;
  }

 private:
  static constexpr std::array<double, kCount> kFactorial = [] {
    std::array<double, kCount> f{};
    f[0] = 1.0;
    for (std::size_t k = 1; k < kCount; ++k) f[k] = f[k - 1] * static_cast<double>(k);
    return f;
  }();
  /// sum over j = from .. to of a_j b_(k-j)
  template <std::size_t from, std::size_t to>
  [[gnu::always_inline]] static double convolved(const TaylorSeries& a, const TaylorSeries& b,
                                                 std::size_t k) {
    double sum = 0.0;
    unrolled<to - from + 1>(
        [&](auto j) { sum += a.coefficient[from + j] * b.coefficient[k - from - j]; });
    return sum;
  }
};

template <int N>
double plain(const TaylorSeries<N>& x) {
  return x.coefficient[0];
}

/// Value and first three derivatives of a function of one variable at a point, the result of a TaylorSeries<3> as plain
/// numbers; nothing is differentiated with it.
struct Taylor3 {
  double value = 0.0, d1 = 0.0, d2 = 0.0, d3 = 0.0;

  Taylor3() = default;
  Taylor3(const TaylorSeries<3>& s)  // NOLINT: the same content
      : value(s.value()), d1(s.derivative(1)), d2(s.derivative(2)), d3(s.derivative(3)) {}
};

}  // namespace sparflow

namespace Eigen {
template <int N>
struct NumTraits<sparflow::TaylorSeries<N>> : NumTraits<double> {
  using Real = sparflow::TaylorSeries<N>;
  using NonInteger = sparflow::TaylorSeries<N>;
  using Nested = sparflow::TaylorSeries<N>;
  enum { RequireInitialization = 1, ReadCost = N, AddCost = N, MulCost = N * N };
};
}  // namespace Eigen
