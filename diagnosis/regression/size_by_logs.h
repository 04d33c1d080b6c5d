#pragma once
/// Size of an effect in suspect and in reference logs, where it varies from motion to motion as no law is exact.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

/// Estimates of one group of logs; how the sizes in its stretches of motion scatter is common to both groups (scatter_of_sizes.h).
struct SizeInLogs {
  double size = 0.0;  ///< [1] relative to the direction given
  double standard_error = 0.0;
  int blocks = 0;  ///< in which the effect acts
};

struct SizeByLogs {
  SizeInLogs suspects, references;
  double covariance = 0.0;  ///< [1] of both sizes, by what the baseline follows of either
  double freedom = 0.0;  ///< degrees of freedom of the scatter; 0: how the size varies is not known
  double variation =
      0.0;  ///< [1] standard deviation of the size that was added between stretches of motion

  /// Difference over its standard error; 0 where a group has no estimate.
  double difference() const;
  /// Mean of both groups over its standard error; 0 without any estimate.
  double mean() const;
};

/// What is compared.
struct ComparedEffect {
  const EffectDesign& suspect;
  const EffectDesign&
      reference;  ///< signatures of one effect in the suspect and in the reference logs
  Eigen::VectorXd
      common;  ///< [SI] linear parameters that act in both groups and are subtracted first
  Eigen::VectorXd direction;                       ///< [SI] linear parameters that have size one
  const std::vector<const EffectDesign*>& others;  ///< estimated beside it, once for both groups
};

/// @param fit its noise models weight the rows
SizeByLogs size_by_logs(const Evidence& evidence, const ComparedEffect& effect,
                        const EffectFit& fit);

}  // namespace sparflow
