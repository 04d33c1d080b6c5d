#include "optimizer/baselines/strategies_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {

double quantile(std::vector<double> values, double level) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double at = level * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  if (below + 1 >= values.size()) return values.back();
  const double share = at - static_cast<double>(below);
  return (1.0 - share) * values[below] + share * values[below + 1];
}

SignedRank signed_rank_test(const std::vector<double>& differences) {
  SignedRank test;
  std::vector<double> d;
  for (const double x : differences) {
    if (x != 0.0 && std::isfinite(x)) d.push_back(x);
  }
  const std::size_t n = d.size();
  test.n = static_cast<int>(n);
  if (n == 0) return test;
  std::sort(d.begin(), d.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  // Twice the rank is used, so that mean ranks are whole numbers.
  std::vector<int> rank(n);
  double ties = 0.0;
  for (std::size_t i = 0; i < n;) {
    std::size_t last = i;
    while (last + 1 < n && std::abs(d[last + 1]) == std::abs(d[i])) ++last;
    for (std::size_t k = i; k <= last; ++k) rank[k] = static_cast<int>(i + last + 2);
    const double group = static_cast<double>(last - i + 1);
    ties += group * group * group - group;
    i = last + 1;
  }
  int plus = 0, total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    total += rank[i];
    if (d[i] > 0.0) plus += rank[i];
  }
  test.w_plus = 0.5 * plus;
  test.w_minus = 0.5 * (total - plus);
  /// Number of pairs up to which the distribution is computed exactly.
  /// @threshold [pairs] 20..1000; chosen: the normal approximation is usual from some twenty pairs on
  constexpr std::size_t kExactUpTo = 60;
  if (n <= kExactUpTo) {
    // Probability of each sum when both signs are equally likely.
    std::vector<double> chance(static_cast<std::size_t>(total) + 1, 0.0);
    chance[0] = 1.0;
    for (const int r : rank) {
      for (std::size_t s = chance.size(); s-- > 0;) {
        chance[s] *= 0.5;
        if (s >= static_cast<std::size_t>(r))
          chance[s] += 0.5 * chance[s - static_cast<std::size_t>(r)];
      }
    }
    const auto least = static_cast<std::size_t>(std::min(plus, total - plus));
    double tail = 0.0;
    for (std::size_t s = 0; s <= least; ++s) tail += chance[s];
    test.p_value = std::min(1.0, 2.0 * tail);
    return test;
  }
  test.exact = false;
  const double count = static_cast<double>(n);
  const double mean = 0.25 * count * (count + 1.0);
  const double variance = count * (count + 1.0) * (2.0 * count + 1.0) / 24.0 - ties / 48.0;
  const double z = std::max(0.0, std::abs(test.w_plus - mean) - 0.5) / std::sqrt(variance);
  test.p_value = std::min(1.0, std::erfc(z / std::sqrt(2.0)));
  return test;
}

}  // namespace sparflow
