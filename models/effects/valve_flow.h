#pragma once
/// What a log itself says about a valve section: rod speed against command, by plain least squares. The scale
/// of the flow effects' columns; their parameters are then dimensionless or times.
#include "models/effects/series.h"

namespace sparflow {

/// speed = gain max(0, |u| - dead_band) sign(u), by direction.
struct SectionFit {
  double gain_extend = 0.0, gain_retract = 0.0;  ///< [m/s] per unit of command
  double dead_band_extend = 0.0, dead_band_retract = 0.0;
  double gain(double command) const { return command > 0.0 ? gain_extend : gain_retract; }
  double dead_band(double command) const {
    return command > 0.0 ? dead_band_extend : dead_band_retract;
  }
};

/// Gains alone: least squares of the measured speed on `command` split by sign. A direction without samples
/// gets the machine file's full flow, 0 if it has none.
/// @param command [samples] what the flow follows: the logged command, or that lagged
SectionFit fit_gains(const MachineSeries& log, int cylinder, const Eigen::VectorXd& command);

/// Gains and dead bands: the dead band with the smallest sum of squares, by bracketing and golden section.
SectionFit fit_dead_bands(const MachineSeries& log, int cylinder);

}  // namespace sparflow
