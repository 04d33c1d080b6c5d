#pragma once
/// Sums over the centres of a 2-D squared-exponential kernel in scaled inputs,
///   s(x, y) = sum_j w_j exp(-1/2 [(x - x_j)^2 + (y - y_j)^2]),
/// the innermost loop of everything that evaluates a pressure. Hand-vectorised with a polynomial exp
/// (relative error below 1e-15; exactly zero below exp(-690), so that no denormal slows it down),
/// compiled once per instruction set and chosen when first used. Finite inputs give finite results.
///
/// The environment variable SPARFLOW_ISA = baseline | avx2 | avx512 overrides the choice (a set the
/// machine lacks is ignored). Results of different sets differ by rounding only.
#include <cstddef>

namespace sparflow {

enum class KernelIsa { kBaseline, kAvx2, kAvx512 };

/// Arrays must hold a multiple of kKernelPadding values: pad x and y with any finite number and
/// `weight` with zero. No alignment is required. The arrays are not owned.
// no threshold: width of the largest vector
inline constexpr std::size_t kKernelPadding = 8;
struct KernelCentres {
  const double* x = nullptr;
  const double* y = nullptr;
  const double* weight = nullptr;
  std::size_t count = 0;  ///< a multiple of kKernelPadding
};
inline constexpr std::size_t kernel_padded(std::size_t n) {
  return (n + kKernelPadding - 1) / kKernelPadding * kKernelPadding;
}

/// Derivatives are with respect to the scaled inputs: divide by the length-scales for physical ones.
struct KernelSums {
  double value = 0.0;
  double d_x = 0.0, d_y = 0.0;
  double d_xx = 0.0, d_xy = 0.0, d_yy = 0.0;
};

/// sum_j w_j k_j
double kernel_sum(const KernelCentres& centres, double x, double y);
/// Value, gradient and Hessian in one pass.
KernelSums kernel_sum_derivatives(const KernelCentres& centres, double x, double y);
/// out_j = exp(-1/2 [(x - x_j)^2 + (y - y_j)^2]) for all `count` centres; the weights are not read.
void kernel_vector(const KernelCentres& centres, double x, double y, double* out);

/// The instruction set in use, and whether this machine has one (it always has the baseline).
KernelIsa kernel_isa();
bool kernel_isa_available(KernelIsa isa);
const char* kernel_isa_name(KernelIsa isa);
/// Chooses the instruction set, for tests and benchmarks. @return false, without a change, when the machine lacks it
bool set_kernel_isa(KernelIsa isa);

}  // namespace sparflow
