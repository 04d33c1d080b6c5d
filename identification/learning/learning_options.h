#pragma once
/// Thresholds of the steps of learning that are not in a public header of their own.
#include <Eigen/Dense>

namespace sparflow {

/// How a pressure model is extrapolated beyond the loads of its samples (learn_loads_beyond.h).
struct LoadsBeyondOptions {
  /// Span of the loads over the supply area from which on the samples determine the law over the
  /// load.
  /// @threshold [Pa] 1e5..5e6; derived: between slope 0 and the static branch a corner in the
  /// middle deviates from a straight line by at most an eighth of the span, which is about the
  /// sensor noise; any more that a kernel would fit is friction
  double similar_loads = 8e5;
  /// Number of samples that count as independent at most in the regression of pressure on load.
  /// @threshold [samples] 5..1000; chosen: friction and dynamics correlate the errors of a motion
  double worth = 20.0;
  /// Least spread of the loads over the supply area, beside what the flow explains, for that
  /// regression.
  /// @threshold [Pa] 1..1e5; chosen: a hundredth of a bar, far below the noise of a pressure
  double no_spread = 1e3;
  /// Least standard deviation of the share by the level of the pressure.
  /// @threshold [1] 0.01..0.5; chosen: an error of the force by a tenth causes it
  double surest_share = 0.1;
  /// Share of the learned range at its border in which the slope identifies the branch.
  /// @threshold [1] 0.02..1; chosen: wide enough for a slope, narrow enough to lie on one branch
  double border_share = 0.1;
  /// Quantile of the pressure above the load that is the level of the static branch.
  /// @threshold [1] 0..0.5; chosen: the static branch is the lower bound of the pressure, and a
  /// tenth allows for noise
  double static_quantile = 0.1;
  /// Quantile of the pressure that is the chamber's lowest pressure.
  /// @threshold [1] 0..0.1; chosen: the lowest sample but for outliers
  double least_quantile = 0.01;
  /// Largest value of a chamber's lowest pressure.
  /// @threshold [Pa] 0..1e6; chosen: anti-cavitation valves keep it near the tank's pressure
  double largest_least = 2e5;
};

/// Where a pressure model gets a corner between two branches (find_branch_corner.h).
struct BranchCornerOptions {
  /// Least number of samples on each branch.
  /// @threshold [samples] 5..400; chosen: five for each of the three coefficients of a plane
  Eigen::Index fewest = 15;
  /// Largest squared error of two planes as a share of that of a smooth law.
  /// @threshold [1] 0.1..1; chosen: a corner explains clearly more than a quadratic law of flow and
  /// load
  double clearly = 0.7;
};

}  // namespace sparflow
