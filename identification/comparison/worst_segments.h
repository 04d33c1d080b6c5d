#pragma once
/// Finds the motions with the largest errors, and the errors by regime with confidence intervals.
#include <string>
#include <vector>

#include "identification/comparison/compare_parts.h"

namespace sparflow {

/// One motion (or a part of a long one) and its contribution to a quantity's error.
struct WorstSegment {
  std::string stage, at, regime;
  std::string file;
  double from_s = 0.0, to_s = 0.0;  ///< [s] in the log's time
  std::string moved;                ///< "boom extending, jib retracting"
  double rmse = 0.0;                ///< in `unit`
  double bias = 0.0;                ///< in `unit`
  std::string unit;
  double share_of_error = 0.0;    ///< of the quantity's squared error, 0..1
  double share_of_samples = 0.0;  ///< 0..1
  std::string sentence;
};

/// @param most segments in all
/// @return for every quantity the segment with the largest excess of error share over sample share, largest first
std::vector<WorstSegment> worst_segments(const Machine& machine, const CompareResult& result,
                                         const std::vector<ComparedPart>& parts,
                                         const std::vector<CompareBlock>& blocks, int most = 6);

/// The error of one quantity while a factor has one of its levels.
struct RegimeError {
  std::string stage, at, regime;
  std::string
      factor;  ///< "direction", "speed", "load", "payload_kg", "oil_C", "functions", "leader"
  std::string level;  ///< "extend", "slow", "high", "500", "several", "boom"
  double rmse = 0.0;  ///< in `unit`
  Range rmse_ci95;    ///< bootstrap of blocks; NaN with fewer than 5
  double bias = 0.0;  ///< in `unit`
  Range bias_ci95;
  std::string unit;
  long samples = 0;
  int blocks = 0;
};

/// Errors by direction, speed (slow, medium, fast: terciles), load (terciles), payload and oil temperature (each value,
/// terciles where there are more than five), one or several cylinders moving, and load-sensing leader.
std::vector<RegimeError> errors_by_regime(const CompareResult& result,
                                          const std::vector<ComparedPart>& parts,
                                          const std::vector<CompareBlock>& blocks);

}  // namespace sparflow
