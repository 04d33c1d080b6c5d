#pragma once
/// Confidence limits of a share.
#include <algorithm>
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

/// Difference of two shares of the same runs, with its 95 % limits [-].
struct PairedDifference {
  double value = 0.0, lower = 0.0, upper = 0.0;
};

/// Share of `one` less that of `other` in paired runs. Source: R. G. Newcombe (1998), Stat. Med. 17, 2635-2650, method 10.
/// @param both, only_one, only_other, neither numbers of runs in which both, one of them or none is right
inline PairedDifference paired_difference(int both, int only_one, int only_other, int neither) {
  const int runs = both + only_one + only_other + neither;
  const double a = both, b = only_one, c = only_other, d = neither, n = runs;
  const double p = (a + b) / n, q = (a + c) / n;
  const auto [pl, pu] = share_limits(both + only_one, runs);
  const auto [ql, qu] = share_limits(both + only_other, runs);
  const double margins = (a + b) * (c + d) * (a + c) * (b + d);
  double cross = a * d - b * c;
  if (cross > 0.0) cross = std::max(0.0, cross - 0.5 * n);  // correction for continuity
  const double phi = margins > 0.0 ? cross / std::sqrt(margins) : 0.0;
  const auto side = [phi](double x, double y) {
    return std::sqrt(std::max(0.0, x * x - 2.0 * phi * x * y + y * y));
  };
  return {p - q, p - q - side(p - pl, qu - q), p - q + side(pu - p, q - ql)};
}

}  // namespace sparflow::bench
