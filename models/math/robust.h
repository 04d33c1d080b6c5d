#pragma once
/// Small robust statistics shared by the learners. Source: Huber & Ronchetti (2009), ch. 1, 4, 7.
#include <Eigen/Dense>
#include <vector>

namespace sparflow {

/// Median; 0 when there are no values.
double median(Eigen::VectorXd values);

/// Value below which the fraction `at` (0..1) of the values lies; 0 when there are none.
double quantile(Eigen::VectorXd values, double at);

/// 1.4826 times the median absolute value: the standard deviation of normal residuals, robust against outliers.
double robust_std(const Eigen::Ref<const Eigen::VectorXd>& residuals);

/// x_i - 3 x_(i-1) + 3 x_(i-2) - x_(i-3), the finite ones of rows first ... last - 1. Smooth motion hardly shows in them;
/// white noise does with kThirdDifferenceNoise times its standard deviation.
std::vector<double> third_differences(const Eigen::Ref<const Eigen::VectorXd>& x,
                                      Eigen::Index first, Eigen::Index last);
// no threshold: mathematics
inline constexpr double kThirdDifferenceNoise = 4.47213595499958;  ///< sqrt(1 + 9 + 9 + 1)

/// Residuals count fully up to this many standard deviations: 95 % efficiency on normal data.
/// @threshold [1] 0.5..5; cited: Huber 1964
inline constexpr double kHuberStds = 1.345;

/// Huber's loss, r^2/2 up to `limit`, linear beyond.
inline double huber_loss(double r, double limit) {
  const double a = r < 0.0 ? -r : r;
  return a <= limit ? 0.5 * a * a : limit * (a - 0.5 * limit);
}

/// Its weight in iteratively reweighted least squares.
inline double huber_weight(double r, double limit) {
  const double a = r < 0.0 ? -r : r;
  return a <= limit ? 1.0 : limit / a;
}

}  // namespace sparflow
