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

struct WorstSegmentOptions {
  /// Largest number of segments in all.
  /// @threshold [segments] 1..100; chosen: as many as a screen shows and a reader compares
  int most = 6;
  /// Least share of the squared error over the share of the samples.
  /// @threshold [1] 1..5; chosen: above what coloured noise shows
  double contrast = 1.5;
  /// Least share of a segment's samples in which a cylinder moves to be named.
  /// @threshold [1] 0..0.5; chosen: a shorter motion hardly explains the segment's error
  double moved_share = 0.1;
  /// Largest number of values of a payload or oil temperature that are levels of their own; with
  /// more there are terciles.
  /// @threshold [values] 2..20; chosen: a test plan has a few payloads, a drifting temperature many
  /// values
  std::size_t most_values = 5;
  BlockOptions blocks;
};

/// @return for every quantity the segment with the largest excess of error share over sample share, largest first
std::vector<WorstSegment> worst_segments(const Machine& machine, const CompareResult& result,
                                         const std::vector<ComparedPart>& parts,
                                         const std::vector<CompareBlock>& blocks,
                                         const WorstSegmentOptions& options = {});

/// The error of one quantity while a factor has one of its levels.
struct RegimeError {
  std::string stage, at, regime;
  std::string
      factor;  ///< "direction", "speed", "load", "payload_kg", "oil_C", "functions", "leader"
  std::string level;  ///< "extend", "slow", "high", "500", "several", "boom"
  double rmse = 0.0;  ///< in `unit`
  Range rmse_ci95;    ///< bootstrap of blocks; NaN with fewer than BlockOptions::fewest
  double bias = 0.0;  ///< in `unit`
  Range bias_ci95;
  std::string unit;
  long samples = 0;
  int blocks = 0;
};

/// Errors by direction, speed (slow, medium, fast: terciles), load (terciles), payload and oil temperature (each value,
/// terciles where there are more than `most_values`), one or several cylinders moving, and load-sensing leader.
std::vector<RegimeError> errors_by_regime(const CompareResult& result,
                                          const std::vector<ComparedPart>& parts,
                                          const std::vector<CompareBlock>& blocks,
                                          const WorstSegmentOptions& options = {});

}  // namespace sparflow
