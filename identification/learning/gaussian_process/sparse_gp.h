#pragma once
/// Sparse Gaussian process for long logs: m inducing points summarise all n measurements, at a cost of
/// O(n m^2) for learning and O(m) for evaluation.
/// Source: Titsias (2009), eq. 9 (collapsed bound), eq. 6 (prediction); the linear mean is integrated out
/// as in Rasmussen & Williams (2006), ch. 2.7. Inducing points by greedy conditional variance: Burt,
/// Rasmussen & van der Wilk (2020), ch. 4 (a pivoted Cholesky factorisation of the kernel matrix).
#include <Eigen/Dense>
#include <vector>

#include "identification/learning/gaussian_process/gp_likelihood.h"
#include "models/math/linear_algebra.h"

namespace sparflow {

struct InducingChoice {
  std::vector<Eigen::Index> rows;  ///< chosen points, in order of choice
  double mean_variance = 0.0;      ///< mean conditional variance of the points, for s^2 = 1
  double max_variance = 0.0;       ///< largest conditional variance
};

/// Repeatedly chooses the point with the largest conditional variance given those already chosen, until `count` are chosen
/// or the mean conditional variance is below `tolerance` (fraction of the signal's).
/// @param hyper only the length-scales are used
InducingChoice choose_inducing(const Eigen::ArrayXd& x1, const Eigen::ArrayXd& x2,
                               const GpHyper& hyper, Eigen::Index count, double tolerance);

/// The collapsed bound at fixed inducing points; keeps its arrays between evaluations.
class SparseGp {
 public:
  /// @param points is kept by reference and must outlive the object
  SparseGp(const GpPoints& points, const std::vector<Eigen::Index>& inducing);

  /// @param gradient with respect to `hyper`, or nullptr
  /// @return lower bound on the log marginal likelihood; -infinity where it cannot be computed
  double bound(const GpHyper& hyper, GpHyper* gradient);

  GpPosterior posterior(const GpHyper& hyper);

 private:
  bool factorise(const GpHyper& hyper);

  const GpPoints& points_;
  Eigen::ArrayXd z1_, z2_;              // inducing inputs
  Eigen::MatrixXd kuu_, kuf_;           // [m x m], [m x n], with the signal variance
  Eigen::MatrixXd v_;                   // L^-1 Kuf
  Eigen::MatrixXd vh_;                  // V H, [m x b]
  Eigen::VectorXd vy_;                  // V y
  Cholesky chol_uu_, chol_b_, chol_a_;  // Kuu, B = I + V V^T / noise, A
  Eigen::MatrixXd b_inverse_;
  Eigen::VectorXd beta_;
  double trace_v_ = 0.0;  // tr V V^T
};

}  // namespace sparflow
