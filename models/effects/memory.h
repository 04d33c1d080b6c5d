#pragma once
/// Filters in time over a log's runs: lags and delays.
#include "models/effects/series.h"

namespace sparflow {

/// tau dy/dt + y = x, exact for x constant over each interval, started at rest (y = x) in every run. A NaN holds y.
/// @param tau [s] > 0
Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double tau);

/// x(t - delay), linear between samples, the first value before a run's start. @param delay [s], of either sign
Eigen::VectorXd delayed(const MachineSeries& log, const Eigen::VectorXd& x, double delay);

/// Mean over a window centred on each sample, within its run and within a stretch of one `state` (the leader:
/// a signal may jump where it changes), without NaN; NaN stays NaN.
/// @param state [samples] or empty  @param width [s]
Eigen::VectorXd moving_average(const MachineSeries& log, const Eigen::VectorXd& x,
                               const Eigen::VectorXi& state, double width);

}  // namespace sparflow
