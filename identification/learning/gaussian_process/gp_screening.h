#pragma once
/// Finds the outliers of a pressure regression before the hyperparameters are learned, because a few gross outliers
/// increase the noise and shorten the length-scales at the likelihood's maximum.
#include <Eigen/Dense>
#include <vector>

#include "identification/learning/gaussian_process/gp_likelihood.h"

namespace sparflow {

/// Selects at most cells x cells points that represent all: the range of the inputs is divided into cells x cells boxes,
/// and in each occupied box the point of median residual from a quadratic fit is taken. Up to half of the points of a box
/// may be outliers without a large effect on its representative.
std::vector<Eigen::Index> representative_points(const GpPoints& points, int cells);

struct Screening {
  std::vector<Eigen::Index> kept;  ///< rows that are not outliers, in order
  double robust_std = 0.0;         ///< 1.4826 times the median absolute residual
  bool too_many = false;           ///< more than the given fraction were outliers; all are kept
};

/// Compares every point with a Gaussian process fitted to the representatives (a representative with its leave-one-out
/// prediction) and removes those beyond `threshold` robust standard deviations.
Screening screen_outliers(const GpPoints& points, const std::vector<Eigen::Index>& representatives,
                          const GpHyper& hyper, double threshold, double max_fraction);

}  // namespace sparflow
