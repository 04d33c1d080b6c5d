#pragma once
/// Outliers of a pressure regression, found before the hyperparameters are learned (a few gross ones move
/// the likelihood's optimum: longer noise, shorter lengths).
#include <Eigen/Dense>
#include <vector>

#include "identification/learning/gaussian_process/gp_likelihood.h"

namespace sparflow {

/// At most about `cells` squared points that represent all: inputs are cut into cells x cells boxes, and in
/// each occupied box the point of median residual from a quadratic fit is taken. Up to half of a
/// box may be wrong without moving its representative far.
std::vector<Eigen::Index> representative_points(const GpPoints& points, int cells);

struct Screening {
  std::vector<Eigen::Index> kept;  ///< rows that stay, in order
  double robust_std = 0.0;         ///< 1.4826 times the median absolute residual
  bool too_many = false;           ///< more than the given fraction stood out: all are kept
};

/// Compares every point with a process fitted to the representatives (which are compared with what the
/// others say of them) and drops those beyond `threshold` robust standard deviations.
Screening screen_outliers(const GpPoints& points, const std::vector<Eigen::Index>& representatives,
                          const GpHyper& hyper, double threshold, double max_fraction);

}  // namespace sparflow
