#pragma once
/// Structure of residuals over time: oscillations, spectral lines, isolated events. Used by residual_model.cpp and by the
/// comparison with references.
#include "diagnosis/residual/residual_model.h"

namespace sparflow {

/// Row indices of a channel that belong to suspect logs.
std::vector<Eigen::Index> suspect_rows(const Evidence& evidence, const EvidenceChannel& channel);

/// An oscillation of varying frequency, which has no line in the periodogram: the lowest minimum of the autocorrelation
/// between a shortest and a longest lag, of the part that is faster than a second. White noise has no such minimum, and a
/// step decays without one.
struct Oscillation {
  double dip = 0.0;        ///< [-] autocorrelation at the minimum, of what exceeds white noise
  double frequency = 0.0;  ///< [Hz] the minimum is at half a period
  double rms = 0.0, noise = 0.0;  ///< [SI] of the oscillation, of white noise
};
Oscillation strongest_oscillation(const Evidence& evidence, const EvidenceChannel& channel,
                                  const ResidualModelOptions& options);

struct Line {
  double frequency = 0.0;  ///< [Hz]
  double share = 0.0;      ///< 0..1 of the residual's sum of squares
};

/// Strongest line in the periodogram of the residual over time; share = 0 when none is significant.
/// @param residual [rows, SI]
Line strongest_line(const Evidence& evidence, const EvidenceChannel& channel,
                    const Eigen::VectorXd& residual, const ResidualModelOptions& options);

/// A residual that is much larger at one place in time than everywhere else. Other motions do not show it, so no law
/// learned from them can explain it.
struct Event {
  double times =
      0.0;  ///< [-] its largest RMS in one second / larger of the median second's RMS and the noise floor
  double rms = 0.0;   ///< [SI] root of its sum of squares divided by all rows of the channel
  double rest = 0.0;  ///< [SI] the same for all other rows
  double from = 0.0, to = 0.0;  ///< [s] in its log
  std::size_t log = 0;          ///< index into Evidence::series
};

/// The stretch of a motion (its largest second and large neighbours) in which the residual is largest. All is zero when
/// that is a single second (an end stop) or when there are too few seconds of motion for a median.
/// @param residual [rows, SI]
Event strongest_event(const Evidence& evidence, const EvidenceChannel& channel,
                      const Eigen::VectorXd& residual, const ResidualModelOptions& options);

}  // namespace sparflow
