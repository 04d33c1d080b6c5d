#pragma once
/// The low-pass filter that is implied by a smoothed derivative: a smoothed derivative equals the derivative of a smoothed
/// signal, so a quantity computed from commands or pressures is comparable with it after the same low-pass.
#include <Eigen/Dense>
#include <utility>
#include <vector>

namespace sparflow {

/// Kernel whose derivative of the given order is the impulse response of the Savitzky-Golay filter.
/// Source: A. Savitzky, M. J. E. Golay (1964), Anal. Chem. 36(8), 1627-1639.
/// @param step [s] between samples  @param window [s] full width of the filter  @param derivative 0, 1 or 2
/// @return centred kernel of odd length with unit gain
Eigen::VectorXd low_pass_of(double step, double window, int order, int derivative);

/// Convolution within runs [first, last).
/// @return [samples], NaN where the kernel reaches beyond its run or covers a NaN
Eigen::VectorXd convolved(const Eigen::VectorXd& x, const Eigen::VectorXd& kernel,
                          const std::vector<std::pair<Eigen::Index, Eigen::Index>>& runs);

}  // namespace sparflow
