#pragma once
/// What the filters behind speeds and forces do to a signal: a smoothed derivative is the derivative of a smoothed
/// signal, so that a quantity computed from commands or pressures compares with it after the same low-pass.
#include <Eigen/Dense>
#include <utility>
#include <vector>

namespace sparflow {

/// Low-pass whose derivative of that order (0, 1, 2) is the Savitzky-Golay filter's response to an impulse. Centred, of
/// odd length, gain one. Source: A. Savitzky, M. J. E. Golay (1964), Anal. Chem. 36(8), 1627-1639.
/// @param step [s] between samples  @param window [s] full width of the filter
Eigen::VectorXd low_pass_of(double step, double window, int order, int derivative);

/// Convolution inside runs [first, last); NaN where the kernel reaches beyond its run or a NaN.
Eigen::VectorXd convolved(const Eigen::VectorXd& x, const Eigen::VectorXd& kernel,
                          const std::vector<std::pair<Eigen::Index, Eigen::Index>>& runs);

}  // namespace sparflow
