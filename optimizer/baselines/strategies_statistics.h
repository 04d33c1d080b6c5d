#pragma once
/// Statistics of paired numbers: quantiles and a test whether one strategy is cheaper.
#include <vector>

namespace sparflow {

/// Quantile at `level` (0 to 1), linear between the sorted values (Hyndman and Fan 1996, type 7). NaN without values.
double quantile(std::vector<double> values, double level);

/// Wilcoxon's signed-rank test of paired differences (Wilcoxon 1945): are they symmetric about zero?
struct SignedRank {
  int n = 0;             ///< differences that are not zero
  double w_plus = 0.0;   ///< sum of the ranks of the positive ones
  double w_minus = 0.0;  ///< sum of the ranks of the negative ones
  double p_value =
      1.0;  ///< two-sided; exact for n <= 60 with ties too, else normal with tie correction
  bool exact = true;
};

/// Zeros are left out, as by Wilcoxon; equal magnitudes get their mean rank.
SignedRank signed_rank_test(const std::vector<double>& differences);

}  // namespace sparflow
