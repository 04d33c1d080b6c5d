#pragma once
/// Nonlinear least squares of a few parameters with residuals that are correlated within blocks.
#include <Eigen/Dense>
#include <functional>
#include <vector>

namespace sparflow::from_log {

/// 97.5 % quantile of Student's t. Source: Hill (1970), Comm. ACM 13(10), its first terms; within 1 % from 4 degrees on.
double t_quantile(double degrees);

/// 95 % intervals of a least-squares estimate, from the larger of two variances: that of independent residuals, and that of
/// the estimates which leave out one cluster of rows each (the jackknife, to first order). The latter holds when residuals of
/// one cluster are correlated and clusters say unequally much. Source: MacKinnon, Nielsen, Webb (2023), J. Econometrics
/// 232(2), sec. 2.3 and 5 (CR3).
struct Intervals {
  Eigen::VectorXd half;  ///< half widths, infinite where the rows tell nothing
  std::vector<Eigen::MatrixXd>
      squared;  ///< of half widths of sums w: the largest w' S w, where the rows determine them
  double half_of(const Eigen::VectorXd& weights) const;
};

/// Rows of an estimate, divided by their standard deviation, were they independent.
struct WeightedRows {
  const Eigen::MatrixXd& jacobian;
  const Eigen::VectorXd& residual;
  const Eigen::VectorXi&
      block;  ///< of each row; negative: a prior value, whose variance is known and is no cluster
  double prior_weight = 1.0;  ///< by which such rows were multiplied, squared
};

/// @param longer blocks in a row that form a cluster, each by itself; the largest interval is returned
Intervals intervals_of(const WeightedRows& rows, const std::vector<int>& longer);

/// Residuals, divided by their standard deviation, at parameters; false where the model is not defined there.
using Residuals = std::function<bool(const Eigen::VectorXd& theta, Eigen::VectorXd& residual)>;

struct CurveFit {
  Eigen::VectorXd theta;
  Eigen::MatrixXd jacobian;  ///< of the residuals
  Eigen::VectorXd residual;
  double cost = 0.0;  ///< half the sum of squares
  bool defined = false;
};

/// Levenberg-Marquardt with numeric derivatives. @param scale typical size of each parameter
CurveFit fit_curve(const Residuals& residuals, const Eigen::VectorXd& start,
                   const Eigen::VectorXd& scale, int iterations);

}  // namespace sparflow::from_log
