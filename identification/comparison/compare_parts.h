#pragma once
/// The errors of a comparison arranged for statistics: the errors of one quantity over all logs with the block of motion
/// to which each belongs. Neighbouring errors are correlated, so confidence statements count blocks, not samples.
#include <functional>
#include <string>
#include <vector>

#include "identification/comparison/compare_regions.h"
#include "identification/log/log.h"

namespace sparflow {

struct CompareResult;
struct Machine;

/// A stretch of one motion, at most about BlockOptions::longest_s of it.
struct CompareBlock {
  std::size_t log = 0;  ///< index into CompareResult::logs
  SampleRange samples;
};

struct BlockOptions {
  /// Longest block; longer motions are cut into equal parts.
  /// @threshold [s] 2..60; chosen: exceeds the correlation time of errors in a motion
  double longest_s = 8.0;
  /// Least number of blocks for an interval by bootstrap.
  /// @threshold [blocks] 3..50; chosen: resampling fewer blocks hardly varies
  int fewest = 5;
  /// Number of bootstrap samples of an interval; a property of the computation, no threshold.
  int resamples = 400;
};

/// @param longest_s longer motions are cut into equal parts
/// @return the motions of all logs in order of time; rests belong to no block
std::vector<CompareBlock> compare_blocks(const CompareResult& result, double longest_s);

/// One compared quantity over all logs, with one entry for each compared sample inside a block.
struct ComparedPart {
  std::string stage, at;
  std::string regime;     ///< "extend", "retract", or "" for stages judged as a whole (force, pump)
  std::string words;      ///< "force of boom", "working pressure of boom extending"
  std::string unit;       ///< of the field
  double scale = 1.0;     ///< SI value of one `unit`
  Eigen::VectorXd error;  ///< predicted - measured, SI
  std::vector<int> block;   ///< index into the blocks
  std::vector<int> sample;  ///< index into its log; int, because logs of millions of rows have many
  /// Those that all logs have; for a force also its direction (+1, -1). Empty where `gather_signals` gives them.
  std::vector<RegimeSignal> signals;
  /// Gives the signals when they are needed, since those of all parts together take several times the memory of the logs.
  std::function<std::vector<RegimeSignal>(const ComparedPart& part)> gather_signals;

  std::vector<RegimeSignal> all_signals() const {
    return gather_signals ? gather_signals(*this) : signals;
  }
};

/// @param machine,result,blocks must outlive the parts
std::vector<ComparedPart> compare_parts(const Machine& machine, const CompareResult& result,
                                        const std::vector<CompareBlock>& blocks);

/// 95 % interval of a ratio of sums over blocks, sum(numerator) / sum(denominator), by the percentile bootstrap of whole
/// blocks (Efron & Tibshirani 1993, ch. 13). NaN with fewer blocks than the options require. Deterministic.
/// @param root true for the root of the ratio, as for an RMSE
Range block_interval(const Eigen::VectorXd& numerator, const Eigen::VectorXd& denominator,
                     bool root, const BlockOptions& options = {});

}  // namespace sparflow
