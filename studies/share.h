#pragma once
/// Confidence limits of a share.
#include <cmath>
#include <utility>

namespace sparflow::bench {

/// 95 % limits [-] of a share of `hits` in `runs`. Source: E. B. Wilson (1927), J. Am. Stat. Assoc. 22, 209-212.
inline std::pair<double, double> share_limits(int hits, int runs) {
  const double z = 1.959964, n = runs, p = hits / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  return {std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

}  // namespace sparflow::bench
