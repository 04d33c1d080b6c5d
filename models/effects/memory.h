#pragma once
/// Filters in time over a log's runs: lags and delays.
#include "models/effects/series.h"

namespace sparflow {

/// Solves tau dy/dt + y = x exactly for x constant over each interval, from y = x at the start of every run. Where x is
/// NaN, y keeps its value.
/// @param tau [s] > 0
Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double tau);

/// The same with a time constant of its own while y falls.
/// @param rising, falling [s] > 0
Eigen::VectorXd first_order_lag(const MachineSeries& log, const Eigen::VectorXd& x, double rising,
                                double falling);

/// A value, the target that it follows, and the time that it has. [s]
struct LagStep {
  double from = 0.0, target = 0.0, dt = 0.0;
};
/// The value after one step of limited_lag.
double limited_step(const LagStep& step, double limit, double tau);

/// Solves tau dy/dt = min(x - y, limit) in the same way: y rises no faster than limit / tau.
/// @param limit in the unit of x, > 0  @param tau [s] > 0
Eigen::VectorXd limited_lag(const MachineSeries& log, const Eigen::VectorXd& x, double limit,
                            double tau);

/// Solves y'' / w^2 + 2 d y' / w + y = x exactly for x constant over each interval, from y = x and y' = 0 at the start of
/// every run. Where x is NaN, y follows its last value.
/// @param frequency undamped natural frequency w [rad/s] > 0  @param damping ratio d, 0 < d < 1
Eigen::VectorXd second_order_lag(const MachineSeries& log, const Eigen::VectorXd& x,
                                 double frequency, double damping);

/// x(t - delay), linear between samples; a run's first and last values continue beyond its ends.
/// @param delay [s], of either sign
Eigen::VectorXd delayed(const MachineSeries& log, const Eigen::VectorXd& x, double delay);

/// Mean over a window centred on each sample, within its run and while `state` is constant (the load-sensing leader: a
/// signal may jump where it changes). The window ends at a NaN, and NaN stays NaN.
/// @param state [samples] or empty  @param width [s]
Eigen::VectorXd moving_average(const MachineSeries& log, const Eigen::VectorXd& x,
                               const Eigen::VectorXi& state, double width);

}  // namespace sparflow
