#pragma once
/// Second-order dual number whose number of variables is chosen at run time. Effects are differentiated with it, because
/// the number of joints is known only from the machine file. Value, gradient and packed Hessian are in a fixed
/// buffer, so that nothing is allocated; operations use only the variables present. Constants have no variables and can
/// be combined with any number. Fike & Alonso (2011), hyper-dual numbers, in packed form.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "models/math/scalar.h"

namespace sparflow {

class Jet {
 public:
  /// Largest number of variables: q, qd and qdd of seven joints.
  // no threshold: size of an array
  static constexpr int kMax = 21;

  double value = 0.0;

  Jet() = default;
  Jet(double v) : value(v) {}  // NOLINT: constants mix freely with jets
  Jet(const Jet& b) : value(b.value), n_(b.n_) { copy(b); }
  Jet& operator=(const Jet& b) {
    value = b.value;
    n_ = b.n_;
    copy(b);
    return *this;
  }
  /// Variable `index` of `count`. @throws nothing; the caller keeps count <= kMax
  static Jet variable(double v, int index, int count) {
    Jet j(v);
    j.n_ = count;
    std::fill_n(j.data_.begin(), count + packed(count), 0.0);
    j.data_[static_cast<std::size_t>(index)] = 1.0;
    return j;
  }

  /// From known derivatives. @param gradient called as gradient(i)  @param hessian called as
  /// hessian(i, j), for j <= i only
  template <class Gradient, class Hessian>
  static Jet of(double v, int count, const Gradient& gradient, const Hessian& hessian) {
    Jet r(v);
    r.n_ = count;
    double* rg = r.data_.data();
    double* rh = rg + count;
    for (int i = 0, p = 0; i < count; ++i) {
      rg[i] = gradient(i);
      for (int j = 0; j <= i; ++j, ++p) rh[p] = hessian(i, j);
    }
    return r;
  }

  int variables() const { return n_; }
  double gradient(int i) const { return i < n_ ? data_[static_cast<std::size_t>(i)] : 0.0; }
  double hessian(int i, int j) const {
    if (i < j) std::swap(i, j);
    return i < n_ ? data_[static_cast<std::size_t>(n_ + i * (i + 1) / 2 + j)] : 0.0;
  }

  /// f(this) for a scalar function with value f0 and derivatives f1, f2.
  Jet chain(double f0, double f1, double f2) const {
    Jet r(f0);
    r.n_ = n_;
    const double* g = data_.data();
    const double* h = g + n_;
    double* rg = r.data_.data();
    double* rh = rg + n_;
    for (int i = 0, p = 0; i < n_; ++i) {
      rg[i] = f1 * g[i];
      const double w = f2 * g[i];
      for (int j = 0; j <= i; ++j, ++p) rh[p] = f1 * h[p] + w * g[j];
    }
    return r;
  }

  /// Value and partial derivatives of a function of two variables a and b.
  struct Partials {
    double f0, fa, fb, faa, fab, fbb;
  };
  /// f(a, b).
  static Jet chain(const Jet& a, const Jet& b, const Partials& f) {
    const auto [f0, fa, fb, faa, fab, fbb] = f;
    if (b.n_ == 0) return a.chain(f0, fa, faa);
    if (a.n_ == 0) return b.chain(f0, fb, fbb);
    Jet r(f0);
    r.n_ = a.n_;
    const double *ag = a.data_.data(), *bg = b.data_.data();
    const double *ah = ag + a.n_, *bh = bg + a.n_;
    double* rg = r.data_.data();
    double* rh = rg + a.n_;
    for (int i = 0, p = 0; i < a.n_; ++i) {
      rg[i] = fa * ag[i] + fb * bg[i];
      const double wa = faa * ag[i] + fab * bg[i], wb = fab * ag[i] + fbb * bg[i];
      for (int j = 0; j <= i; ++j, ++p) {
        rh[p] = fa * ah[p] + fb * bh[p] + wa * ag[j] + wb * bg[j];
      }
    }
    return r;
  }

  friend Jet operator+(const Jet& a, const Jet& b) { return linear(a, 1.0, b, 1.0); }
  friend Jet operator-(const Jet& a, const Jet& b) { return linear(a, 1.0, b, -1.0); }
  friend Jet operator-(const Jet& a) { return a.chain(-a.value, -1.0, 0.0); }
  friend Jet operator*(const Jet& a, const Jet& b) {
    if (a.n_ == 0) return b.chain(a.value * b.value, a.value, 0.0);
    if (b.n_ == 0) return a.chain(a.value * b.value, b.value, 0.0);
    Jet r(a.value * b.value);
    r.n_ = a.n_;
    const double *ag = a.data_.data(), *bg = b.data_.data();
    const double *ah = ag + a.n_, *bh = bg + a.n_;
    double* rg = r.data_.data();
    double* rh = rg + a.n_;
    for (int i = 0, p = 0; i < a.n_; ++i) {
      rg[i] = ag[i] * b.value + a.value * bg[i];
      for (int j = 0; j <= i; ++j, ++p) {
        rh[p] = ah[p] * b.value + a.value * bh[p] + ag[i] * bg[j] + ag[j] * bg[i];
      }
    }
    return r;
  }
  friend Jet operator/(const Jet& a, const Jet& b) {
    const double i = 1.0 / b.value;
    return a * b.chain(i, -i * i, 2.0 * i * i * i);
  }
  Jet& operator+=(const Jet& b) { return *this = *this + b; }
  Jet& operator-=(const Jet& b) { return *this = *this - b; }
  Jet& operator*=(const Jet& b) { return *this = *this * b; }
  Jet& operator/=(const Jet& b) { return *this = *this / b; }
  friend bool operator<(const Jet& a, const Jet& b) { return a.value < b.value; }
  friend bool operator>(const Jet& a, const Jet& b) { return a.value > b.value; }
  friend bool operator<=(const Jet& a, const Jet& b) { return a.value <= b.value; }
  friend bool operator>=(const Jet& a, const Jet& b) { return a.value >= b.value; }
  friend bool operator==(const Jet& a, const Jet& b) { return a.value == b.value; }

 private:
  static constexpr int packed(int n) { return n * (n + 1) / 2; }
  void copy(const Jet& b) { std::copy_n(b.data_.begin(), n_ + packed(n_), data_.begin()); }
  static Jet linear(const Jet& a, double fa, const Jet& b, double fb) {
    if (b.n_ == 0) return a.chain(fa * a.value + fb * b.value, fa, 0.0);
    if (a.n_ == 0) return b.chain(fa * a.value + fb * b.value, fb, 0.0);
    Jet r(fa * a.value + fb * b.value);
    r.n_ = a.n_;
    for (int i = 0; i < a.n_ + packed(a.n_); ++i) {
      const auto s = static_cast<std::size_t>(i);
      r.data_[s] = fa * a.data_[s] + fb * b.data_[s];
    }
    return r;
  }

  int n_ = 0;
  std::array<double, kMax + kMax*(kMax + 1) / 2> data_;  // left unset beyond the variables in use
};

inline double plain(const Jet& x) { return x.value; }
inline Jet sin(const Jet& a) {
  const double s = std::sin(a.value);
  return a.chain(s, std::cos(a.value), -s);
}
inline Jet cos(const Jet& a) {
  const double c = std::cos(a.value);
  return a.chain(c, -std::sin(a.value), -c);
}
inline Jet sqrt(const Jet& a) {
  const double s = std::sqrt(a.value);
  return a.chain(s, 0.5 / s, -0.25 / (s * a.value));
}
inline Jet exp(const Jet& a) {
  const double e = std::exp(a.value);
  return a.chain(e, e, e);
}
inline Jet log(const Jet& a) {
  const double i = 1.0 / a.value;
  return a.chain(std::log(a.value), i, -i * i);
}
inline Jet tanh(const Jet& a) {
  const double t = std::tanh(a.value), t1 = 1.0 - t * t;
  return a.chain(t, t1, -2.0 * t * t1);
}
inline Jet abs(const Jet& a) { return a.value < 0.0 ? -a : a; }

}  // namespace sparflow

/// Traits by which vectors and matrices can hold Jets; kinematics templated on the scalar need them.
namespace Eigen {
template <>
struct NumTraits<sparflow::Jet> : NumTraits<double> {
  using Real = sparflow::Jet;
  using NonInteger = sparflow::Jet;
  using Nested = sparflow::Jet;
  enum { RequireInitialization = 1, ReadCost = 50, AddCost = 50, MulCost = 200 };
};
}  // namespace Eigen
