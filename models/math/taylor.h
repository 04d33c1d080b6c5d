#pragma once
/// Truncated Taylor series of one variable, to any order, by the classical recurrences (Griewank & Walther 2008,
/// Evaluating Derivatives, sec. 13.2). Dynamics need one derivative more than statics do.
#include <Eigen/Core>
#include <array>
#include <cmath>

namespace sparflow {

template <int N>
struct TaylorSeries {
  /// coefficient[k] = f^(k) / k!
  std::array<double, N + 1> coefficient{};

  TaylorSeries() = default;
  TaylorSeries(double v) { coefficient[0] = v; }  // NOLINT: constants mix freely
  static TaylorSeries variable(double v) {
    TaylorSeries t(v);
    t.coefficient[1] = 1.0;
    return t;
  }
  double derivative(int k) const {
    double factorial = 1.0;
    for (int i = 2; i <= k; ++i) factorial *= i;
    return factorial * coefficient[static_cast<std::size_t>(k)];
  }

  TaylorSeries& operator+=(const TaylorSeries& b) { return *this = *this + b; }
  TaylorSeries& operator-=(const TaylorSeries& b) { return *this = *this - b; }
  TaylorSeries& operator*=(const TaylorSeries& b) { return *this = *this * b; }
  TaylorSeries& operator/=(const TaylorSeries& b) { return *this = *this / b; }

  friend TaylorSeries operator+(TaylorSeries a, const TaylorSeries& b) {
    for (std::size_t k = 0; k <= N; ++k) a.coefficient[k] += b.coefficient[k];
    return a;
  }
  friend TaylorSeries operator-(TaylorSeries a, const TaylorSeries& b) {
    for (std::size_t k = 0; k <= N; ++k) a.coefficient[k] -= b.coefficient[k];
    return a;
  }
  friend TaylorSeries operator-(const TaylorSeries& a) { return TaylorSeries() - a; }
  friend TaylorSeries operator*(const TaylorSeries& a, const TaylorSeries& b) {
    TaylorSeries r;
    for (std::size_t k = 0; k <= N; ++k) {
      for (std::size_t j = 0; j <= k; ++j)
        r.coefficient[k] += a.coefficient[j] * b.coefficient[k - j];
    }
    return r;
  }
  friend TaylorSeries operator/(const TaylorSeries& a, const TaylorSeries& b) {
    TaylorSeries r;
    for (std::size_t k = 0; k <= N; ++k) {
      double rest = a.coefficient[k];
      for (std::size_t j = 0; j < k; ++j) rest -= r.coefficient[j] * b.coefficient[k - j];
      r.coefficient[k] = rest / b.coefficient[0];
    }
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
    for (std::size_t k = 1; k <= N; ++k) {
      double rest = a.coefficient[k];
      for (std::size_t j = 1; j < k; ++j) rest -= r.coefficient[j] * r.coefficient[k - j];
      r.coefficient[k] = rest / (2.0 * r.coefficient[0]);
    }
    return r;
  }
  /// Both at once: each recurrence needs the other.
  static void sin_cos(const TaylorSeries& a, TaylorSeries& s, TaylorSeries& c) {
    s = TaylorSeries(std::sin(a.coefficient[0]));
    c = TaylorSeries(std::cos(a.coefficient[0]));
    for (std::size_t k = 1; k <= N; ++k) {
      for (std::size_t j = 1; j <= k; ++j) {
        const double w = static_cast<double>(j) / static_cast<double>(k) * a.coefficient[j];
        s.coefficient[k] += w * c.coefficient[k - j];
        c.coefficient[k] -= w * s.coefficient[k - j];
      }
    }
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
};

template <int N>
double plain(const TaylorSeries<N>& x) {
  return x.coefficient[0];
}

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
