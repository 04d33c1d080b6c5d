#pragma once
/// Nonlinear least squares of a few parameters with residuals that are correlated within blocks.
#include <Eigen/Dense>
#include <functional>

namespace sparflow::from_log {

/// 97.5 % quantile of Student's t. Source: Hill (1970), Comm. ACM 13(10), its first terms; within 1 % from 4 degrees on.
double t_quantile(double degrees);

/// Covariance of a least-squares estimate: the larger, by parameter, of that for independent residuals and of the one that
/// holds when residuals within a block are correlated. Source: Liang, Zeger (1986), Biometrika 73(1).
/// @param jacobian, residual of unit variance if the model holds  @param block of each row
/// @return half widths of 95 % intervals, infinite where the rows tell nothing
Eigen::VectorXd half_widths(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                            const Eigen::VectorXi& block, Eigen::MatrixXd* covariance = nullptr);

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
