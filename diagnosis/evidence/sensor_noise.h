#pragma once
/// Noise of sensors, from the third differences of what they measure.
#include <Eigen/Dense>

#include "diagnosis/evidence/evidence_options.h"

namespace sparflow {

/// Standard deviation of a raw channel's white noise from third differences (robust, so that motion does not count); NaN where there
/// are fewer of them. [unit of x]
double raw_noise(const Eigen::VectorXd& x, int fewest_differences);

/// Noise floor of a channel over several logs: the mean of those in which it is measured.
class MeanNoise {
 public:
  explicit MeanNoise(const EvidenceOptions& options) : fewest_(options.fewest_differences) {}

  /// @param gain of the channel's filter on white noise
  void add(const Eigen::VectorXd& raw, double gain);
  /// NaN where no log measures it.
  double value() const;

 private:
  int fewest_;  // differences
  double sum_ = 0.0;
  int logs_ = 0;
};

}  // namespace sparflow
