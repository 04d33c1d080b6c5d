#pragma once
/// The further low-pass of forces. A force is compared with accelerations, and the noise of a position that is differentiated twice is
/// far above that of the pressures: it falls with the power 2.5 of the filter's width, that of a pressure with 0.5 only.
#include <Eigen/Dense>
#include <span>

#include "diagnosis/evidence/evidence_options.h"
#include "identification/signals/signals.h"

namespace sparflow {

/// Noise of one cylinder's force in a log.
class ForceNoise {
 public:
  /// @param log its accelerations by its own filter (with_accelerations_of_filter)
  ForceNoise(const Machine& machine, const MachineSignals& log, int cylinder,
             const EvidenceOptions& options);
  bool known() const { return known_; }
  /// Behind the filter of the log and a low-pass of this width [s]. [N]
  double of_pressures(double width) const;
  double of_accelerations(double width) const;
  /// Largest magnitude of the measured force. [N]
  double largest_force() const { return largest_; }

 private:
  bool known_ = false;
  double step_ = 0.0;           // [s]
  Eigen::VectorXd force_pass_;  // kernel of the log's filter
  double largest_ = 0.0;
  double pressures_ = 0.0;  // [N] of one sample
  double accelerations_ =
      0.0;  // [N s^2] per standard deviation of a second derivative of white noise
};

/// Kernel of unit gain that falls to zero as a cosine, of odd length.
/// Source: F. J. Harris (1978), Proc. IEEE 66, 51, the Hann window.
/// @param width full width [s]; below two steps: no low-pass  @param step [s] between samples
Eigen::VectorXd raised_cosine(double width, double step);

/// The narrowest width of EvidenceOptions::force_widths with which the accelerations make no more noise than thrice the pressures, or than
/// matters (EvidenceOptions::force_noise_share), in any log; the widest where none is enough. [s]
double low_pass_width(const Machine& machine, std::span<const MachineSignals* const> logs,
                      int cylinder, const EvidenceOptions& options);

}  // namespace sparflow
