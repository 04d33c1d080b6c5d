#include "identification/signals/low_pass.h"

#include <cmath>
#include <numeric>

#include "identification/signals/smoothing.h"
#include "models/math/nan.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Impulse response of the filter's derivative inside an evenly sampled run.
VectorXd impulse_response(double step, double window, int order, int derivative) {
  const auto half = static_cast<Index>(std::ceil(window / step)) + order + 2;
  const VectorXd time =
      VectorXd::LinSpaced(2 * half + 1, 0.0, 2.0 * static_cast<double>(half) * step);
  VectorXd impulse = VectorXd::Zero(2 * half + 1);
  impulse[half] = 1.0;
  const SavitzkyGolay filter(time, {{0, 2 * half + 1}}, window, order);
  VectorXd h = filter.apply(impulse, derivative);
  // The one-sided windows at the ends do not belong to the response.
  const Index reach = static_cast<Index>(std::floor(0.5 * window / step + 1e-9)) + 1;
  for (Index i = 0; i < h.size(); ++i) {
    if (std::abs(i - half) > reach) h[i] = 0.0;
  }
  return h.segment(half - reach, 2 * reach + 1);
}

/// Sums the kernel `times` times, which inverts differences, and scales the result to unit gain.
VectorXd summed(VectorXd h, int times) {
  for (int pass = 0; pass < times; ++pass) {
    std::partial_sum(h.begin(), h.end(), h.begin());
  }
  // A sum shifts the kernel by half a sample: two sums are centred again by a shift of one sample.
  VectorXd g = VectorXd::Zero(h.size());
  if (times == 2) {
    g.tail(h.size() - 1) = h.head(h.size() - 1);
  } else if (times == 1) {  // centred between samples, so the mean of both neighbours is taken
    for (Index i = 0; i < h.size(); ++i) g[i] = 0.5 * (h[i] + (i > 0 ? h[i - 1] : 0.0));
  } else {
    g = h;
  }
  return g / g.sum();
}

}  // namespace

VectorXd low_pass_of(double step, double window, int order, int derivative) {
  return summed(impulse_response(step, window, order, derivative), derivative);
}

VectorXd convolved(const VectorXd& x, const VectorXd& kernel,
                   const std::vector<std::pair<Index, Index>>& runs) {
  const Index half = kernel.size() / 2;
  VectorXd y = VectorXd::Constant(x.size(), kNaN);
  for (const auto& [first, last] : runs) {
    for (Index i = first + half; i + half < last; ++i) {
      y[i] = kernel.dot(x.segment(i - half, kernel.size()));
    }
  }
  return y;
}

}  // namespace sparflow
