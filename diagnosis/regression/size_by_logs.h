#pragma once
/// Size of an effect in suspect and in reference logs, where it varies from motion to motion as no law is exact.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

/// Estimates of one group of logs. The sizes in the stretches of motion scatter more than the noise model says, for one of two
/// reasons, of which the more likely is taken, in common for both groups: the law has another size in every motion (random
/// effects of DerSimonian and Laird 1986, Control. Clin. Trials 7, 177: a variance is added), or other structure disturbs the
/// estimates (Birge 1932, Phys. Rev. 40, 207: all variances have a common factor).
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
