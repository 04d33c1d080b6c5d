#include "models/math/robust.h"

#include <algorithm>
#include <cmath>

namespace sparflow {

using Eigen::Index;

double median(Eigen::VectorXd values) {
  const Index n = values.size();
  if (n == 0) return 0.0;
  double* begin = values.data();
  std::nth_element(begin, begin + n / 2, begin + n);
  const double upper = begin[n / 2];
  if (n % 2 == 1) return upper;
  return 0.5 * (upper + *std::max_element(begin, begin + n / 2));
}

double quantile(Eigen::VectorXd values, double at) {
  const Index n = values.size();
  if (n == 0) return 0.0;
  const Index i = std::clamp<Index>(std::lround(at * static_cast<double>(n - 1)), 0, n - 1);
  double* begin = values.data();
  std::nth_element(begin, begin + i, begin + n);
  return begin[i];
}

std::vector<double> third_differences(const Eigen::Ref<const Eigen::VectorXd>& x, Index first,
                                      Index last) {
  std::vector<double> differences;
  differences.reserve(static_cast<std::size_t>(std::max<Index>(last - first, 0)));
  for (Index i = first + 3; i < last; ++i) {
    const double d = x[i] - 3.0 * x[i - 1] + 3.0 * x[i - 2] - x[i - 3];
    if (std::isfinite(d)) differences.push_back(d);
  }
  return differences;
}

double robust_std(const Eigen::Ref<const Eigen::VectorXd>& residuals) {
  return 1.4826 * median(residuals.cwiseAbs());
}

}  // namespace sparflow
