#pragma once
/// Fit of a valve section to a log: rod speed against command by ordinary least squares. It scales the columns of the
/// flow effects, so that their parameters are dimensionless or times.
#include <functional>

#include "models/effects/series.h"

namespace sparflow {

/// speed = gain max(0, |u| - dead_band) sign(u), for each direction.
struct SectionFit {
  double gain_extend = 0.0, gain_retract = 0.0;            ///< [m/s] per unit of command
  double dead_band_extend = 0.0, dead_band_retract = 0.0;  ///< [-]
  double gain(double command) const { return command > 0.0 ? gain_extend : gain_retract; }
  double dead_band(double command) const {
    return command > 0.0 ? dead_band_extend : dead_band_retract;
  }
};

/// Fits the gains alone: least squares of the measured speed on `command`, for each sign. A direction with too few
/// samples gets the gain of the machine file's full flow, 0 if it has none.
/// @param command [samples, -] the logged command, or the delayed one where the flow follows that
SectionFit fit_gains(const MachineSeries& log, int cylinder, const Eigen::VectorXd& command);

/// What the rod speed changes by when the valve's opening acts late. The gains are those of the late opening; those of the opening
/// itself would be biased towards zero.
/// @param opening [samples, -]  @param late delays or filters a series  @return [samples, m/s]
Eigen::VectorXd late_flow(const MachineSeries& log, int cylinder, const Eigen::VectorXd& opening,
                          const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& late);

/// Fits gains and dead bands: the dead band has the smallest sum of squares, by grid search and golden section.
SectionFit fit_dead_bands(const MachineSeries& log, int cylinder);

}  // namespace sparflow
