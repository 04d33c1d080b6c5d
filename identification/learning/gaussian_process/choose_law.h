#pragma once
/// Compares a plane with a plane and a Gaussian process on samples that were left out.
#include <vector>

#include "identification/learning/gaussian_process/gp_likelihood.h"
#include "identification/learning/gaussian_process/learn_pressure.h"

namespace sparflow {

struct LawChoice {
  const GpPoints& points;         ///< in scaled units; must outlive the call
  const std::vector<int>& group;  ///< [samples] of each sample; empty: one group
  GpHyper process;                ///< hyperparameters of plane and process
  GpHyper plane;                  ///< hyperparameters of the plane alone: almost no signal
};

/// Leaves each part of the groups out in turn, learns the coefficients of both laws from the others with the
/// hyperparameters of all samples, and predicts what was left out. Whole groups are left out because errors within a
/// motion are correlated: a process that follows them predicts neighbouring samples well and other motions badly. The
/// plane is taken when its mean squared error exceeds that of the process by less than `not_worse` standard errors of
/// the difference between the parts (rule of one standard error).
/// Source: Hastie, Tibshirani & Friedman (2009), The Elements of Statistical Learning, ch. 7.10.1.
/// @param report gets both errors, in the scaled unit of `choice.points.y`
/// @return false with fewer than two groups
bool plane_is_not_worse(const LawChoice& choice, const LearnGpOptions& options, GpReport& report);

}  // namespace sparflow
