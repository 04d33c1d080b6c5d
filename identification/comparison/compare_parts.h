#pragma once
/// What a comparison left over, laid out for statistics: the errors of one quantity over all logs with the
/// block of motion each belongs to. Neighbouring errors are alike, so everything that claims confidence counts blocks,
/// not samples.
#include <string>
#include <vector>

#include "identification/comparison/compare_regions.h"
#include "identification/log/log.h"

namespace sparflow {

struct CompareResult;
struct Machine;

/// A stretch of one motion, at most about `longest` seconds of it.
struct CompareBlock {
  std::size_t log = 0;  ///< index into CompareResult::logs
  SampleRange samples;
};

/// Motions of all logs in order of time; long ones are cut into equal parts. Rests belong to none.
/// @param longest [s]; longer than errors of one motion stay alike
std::vector<CompareBlock> compare_blocks(const CompareResult& result, double longest = 8.0);

/// One compared quantity, one value a compared sample inside a block, over all logs.
struct ComparedPart {
  std::string stage, at;
  std::string regime;     ///< "extend", "retract", or "" for stages judged as a whole (force, pump)
  std::string words;      ///< "force of boom", "working pressure of boom extending"
  std::string unit;       ///< of the field
  double scale = 1.0;     ///< SI value of one `unit`
  Eigen::VectorXd error;  ///< predicted - measured, SI
  Eigen::VectorXd measured;          ///< SI
  std::vector<int> block;            ///< index into the blocks
  std::vector<Eigen::Index> sample;  ///< in its log
  std::vector<RegimeSignal>
      signals;  ///< those that all logs have; a force's direction (+1, -1) too
};

std::vector<ComparedPart> compare_parts(const Machine& machine, const CompareResult& result,
                                        const std::vector<CompareBlock>& blocks);

/// 95 % interval of a ratio of sums over blocks, sum(numerator) / sum(denominator), by the percentile bootstrap of whole
/// blocks (Efron & Tibshirani 1993, ch. 13). NaN with fewer than 5 blocks. Deterministic.
/// @param root the root of the ratio instead, as for an RMSE
Range block_interval(const Eigen::VectorXd& numerator, const Eigen::VectorXd& denominator,
                     bool root);

}  // namespace sparflow
