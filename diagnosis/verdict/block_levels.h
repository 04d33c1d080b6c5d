#pragma once
/// Levels of a residual by stretch of motion, compared between suspect logs and references at equal work. A law that is not
/// exact leaves more under a larger load and in faster motion, so that levels of logs with other loads differ without any
/// change of the machine. Used by residual_levels.cpp only.
/// Source: R. A. Fisher (1932), Statistical Methods for Research Workers, ch. 8 (analysis of covariance); Carroll, Ruppert
/// (1988), Transformation and Weighting in Regression, ch. 3 (variance as a function of a known quantity).
#include "diagnosis/verdict/diagnose.h"

namespace sparflow {

/// Levels are logarithms of the mean squares of blocks. The slopes by the logarithms of load and speed are common to both
/// groups of logs, by generalised least squares with a variance for each group, so that they say nothing about the difference itself.
struct LevelComparison {
  int suspects = 0, references = 0;  ///< blocks
  double difference = 0.0;           ///< of the mean levels at equal work
  double variance = 0.0;             ///< of that
  double freedom = 1.0;              ///< of that variance (Welch and Satterthwaite)
  double explained = 0.0;  ///< what load and speed explain of the difference of the mean levels
  /// Level of the suspect block that deviates most, over the mean of the references at its work.
  double largest = 0.0;
  double largest_in_references = 0.0;  ///< largest level of theirs
  /// That a further block of as few rows would have at the work of that one.
  double largest_deviation = 1.0;
};

/// @param residual [rows, SI]
/// @return less than two blocks of a group: their numbers only
LevelComparison compare_levels(const Evidence& evidence, std::size_t channel,
                               const Eigen::VectorXd& residual);

}  // namespace sparflow
