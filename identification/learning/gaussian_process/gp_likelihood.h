#pragma once
/// Marginal likelihood of a Gaussian process with a linear mean whose coefficients are integrated out, its exact gradient,
/// and the posterior. This is the exact form (all points); sparse_gp.h has the sparse one. Inputs are dimensionless here;
/// learn_pressure.cpp scales them.
/// Source: Rasmussen & Williams (2006), ch. 2.7 (mean), eqs. 2.42, 2.45, 5.9.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Logarithms of length-scale 1, length-scale 2, signal variance and noise variance.
using GpHyper = Eigen::Vector4d;

/// Points of a regression in scaled units.
struct GpPoints {
  Eigen::ArrayXd x1, x2;  ///< [n] scaled inputs
  Eigen::VectorXd y;      ///< [n] scaled output
  Eigen::MatrixXd basis;  ///< [n x b] of the mean: 1 or (1, x2)
  /// [b] prior precision of the mean's coefficients around zero; 0 = flat prior.
  Eigen::VectorXd basis_precision;

  Eigen::Index size() const { return y.size(); }
  /// @return normalisation of the log-likelihood, which does not depend on the hyperparameters
  double log_constant() const;
  GpPoints select(const std::vector<Eigen::Index>& rows) const;
};

/// mean(x) = basis(x) * beta + k(x)^T weight; variance(x) = s^2 - [k; basis]^T core [k; basis].
struct GpPosterior {
  Eigen::ArrayXd x1, x2;   ///< [m] centres
  Eigen::VectorXd weight;  ///< [m]
  Eigen::VectorXd beta;    ///< [b]
  Eigen::MatrixXd core;    ///< [(m+b) x (m+b)]
};

/// Kernel matrix s^2 exp(-1/2 |scaled difference|^2), [size(a) x size(b)].
Eigen::MatrixXd kernel_matrix(const Eigen::ArrayXd& a1, const Eigen::ArrayXd& a2,
                              const Eigen::ArrayXd& b1, const Eigen::ArrayXd& b2,
                              const GpHyper& hyper);

/// Restricted log-likelihood where the prior of the mean is flat. O(n^3).
/// @param gradient with respect to `hyper`, or nullptr
/// @return log p(y | hyper) with the mean integrated out; -infinity where the matrix is not positive definite in working
///   precision
double exact_log_likelihood(const GpPoints& points, const GpHyper& hyper, GpHyper* gradient);

GpPosterior exact_posterior(const GpPoints& points, const GpHyper& hyper);

/// Source: Rasmussen & Williams (2006), eq. 5.12, with the mean's projection in place of K^-1.
/// @return [n] prediction of each point from all others, minus the measured value
Eigen::VectorXd leave_one_out_residuals(const GpPoints& points, const GpHyper& hyper);

}  // namespace sparflow
