#pragma once
/// The kernel loops, written once over g++ vector types and compiled in one file per instruction set
/// (gp_kernel_{baseline,avx2,avx512}.cpp). Everything here has internal linkage: two files compiled for
/// different machines must never share a function, or the linker may keep the one the CPU lacks.
/// For the same reason nothing but freestanding headers is included.
#include <cstddef>

#include "models/hydraulics/gp_kernel_table.h"

namespace sparflow {
namespace {

/// Vec is a vector of doubles, Int one of as many 64-bit integers.
template <class Vec, class Int>
struct KernelLoops {
  static constexpr std::size_t kWidth = sizeof(Vec) / sizeof(double);

  static inline Vec load(const double* p) {
    Vec v;
    __builtin_memcpy(&v, p, sizeof(Vec));
    return v;
  }

  static inline double lane_sum(const Vec& v) {
    double lane[kWidth];
    __builtin_memcpy(lane, &v, sizeof(Vec));
    if constexpr (kWidth == 8) {  // Unrolled, because a loop takes as long as 50 centres.
      return ((lane[0] + lane[4]) + (lane[2] + lane[6])) +
             ((lane[1] + lane[5]) + (lane[3] + lane[7]));
    } else if constexpr (kWidth == 4) {
      return (lane[0] + lane[2]) + (lane[1] + lane[3]);
    } else {
      return lane[0] + lane[1];
    }
  }

  /// exp(a) for a <= 0: a = n ln2 + f, |f| <= ln2/2; 1 + f + f^2 q(f) with q through the Chebyshev
  /// nodes (degree 9, truncation 1.6e-17 relative); 2^n by adding n to the exponent bits.
  static inline Vec exp_negative(const Vec& a) {
    // no threshold: exponent of the smallest result and mathematics
    constexpr double kLog2e = 1.4426950408889634;
    constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
    constexpr double kLn2Hi = 0.6931471787393093;  // 24 trailing zero bits: n * kLn2Hi is exact
    constexpr double kLn2Lo = 1.8206359985041462e-09;
    constexpr double kUnderflow = -690.0;
    const Vec shifted = a * kLog2e + kShift;
    const Vec n = shifted - kShift;
    const Vec f = (a - n * kLn2Hi) - n * kLn2Lo;
    Vec q = f * 2.5100424157005067e-08 + 2.7620138719733994e-07;
    q = q * f + 2.7557268378684192e-06;
    q = q * f + 2.480152119021773e-05;
    q = q * f + 0.00019841269863105968;
    q = q * f + 0.0013888888917281794;
    q = q * f + 0.008333333333330051;
    q = q * f + 0.04166666666662399;
    q = q * f + 0.16666666666666669;
    q = q * f + 0.5000000000000001;
    const Vec p = (q * (f * f) + f) + 1.0;
    // The low bits of `shifted` hold n; shifted to the exponent field they add to that of p.
    const Vec e =
        reinterpret_cast<Vec>(reinterpret_cast<Int>(p) + (reinterpret_cast<Int>(shifted) << 52));
    return a < kUnderflow ? Vec{} : e;
  }

  static double sum(const KernelCentres& c, double x, double y) {
    Vec total{};
    for (std::size_t j = 0; j < c.count; j += kWidth) {
      const Vec u = x - load(c.x + j);
      const Vec v = y - load(c.y + j);
      total += load(c.weight + j) * exp_negative(-0.5 * (u * u + v * v));
    }
    return lane_sum(total);
  }

  static KernelSums sum_derivatives(const KernelCentres& c, double x, double y) {
    Vec s{}, su{}, sv{}, suu{}, suv{}, svv{};
    for (std::size_t j = 0; j < c.count; j += kWidth) {
      const Vec u = x - load(c.x + j);
      const Vec v = y - load(c.y + j);
      const Vec e = load(c.weight + j) * exp_negative(-0.5 * (u * u + v * v));
      const Vec eu = e * u;
      const Vec ev = e * v;
      s += e;
      su += eu;
      sv += ev;
      suu += eu * u;
      suv += eu * v;
      svv += ev * v;
    }
    KernelSums out;
    out.value = lane_sum(s);
    out.d_x = -lane_sum(su);
    out.d_y = -lane_sum(sv);
    out.d_xx = lane_sum(suu) - out.value;
    out.d_xy = lane_sum(suv);
    out.d_yy = lane_sum(svv) - out.value;
    return out;
  }

  static void vector(const KernelCentres& c, double x, double y, double* out) {
    for (std::size_t j = 0; j < c.count; j += kWidth) {
      const Vec u = x - load(c.x + j);
      const Vec v = y - load(c.y + j);
      const Vec e = exp_negative(-0.5 * (u * u + v * v));
      __builtin_memcpy(out + j, &e, sizeof(Vec));
    }
  }

  static constexpr KernelTable table() { return {&sum, &sum_derivatives, &vector}; }
};

}  // namespace
}  // namespace sparflow
