#pragma once
/// Channels of a recording at common instants, coarse enough that noise and jitter of the clocks hardly count: what the
/// physics of the proposal is judged on.
#include <Eigen/Dense>
#include <vector>

#include "identification/log/log.h"
#include "identification/log/recordings/recording.h"

namespace sparflow {

struct SampleOptions {
  /// Interval of the common instants; each takes the mean of a channel's samples around it.
  /// @threshold [s] 0.02..0.5; chosen: rod speeds follow from two of them with an error of a few mm/s, valves are faster
  double step = 0.1;
  /// Largest number of instants; longer recordings are judged on stretches of this many in all.
  /// @threshold [1] 200..20000; chosen: five minutes hold all motions of a work cycle, and the search takes a second
  int most_instants = 3000;
  /// Stretches that a longer recording is judged on.
  /// @threshold [1] 1..100; chosen: they meet several postures and payloads
  int stretches = 20;
  /// Share of the instants at which a channel must have a value.
  /// @threshold [1] 0.05..1; chosen: below it the rest is filled in and not measured
  double least_filled = 0.3;
};

/// Range, roughness and shares of rest and zero of one channel, in the file's unit.
struct ChannelShape {
  bool usable = false;  ///< enough values, all finite
  bool constant = false;
  double low = 0.0, high = 0.0;  ///< 0.5 and 99.5 % quantiles
  double roughness =
      0.0;  ///< standard deviation of the step to the next instant over that of the values
  double resting =
      0.0;  ///< share of steps to the next instant that are zero but for a thousandth of the range
  double zero = 0.0;  ///< share of values that are zero but for a hundredth of the largest
};

struct ProposalSamples {
  Eigen::VectorXd time;           ///< [s]
  std::vector<SampleRange> runs;  ///< stretches without gap
  double step = 0.0;              ///< [s]
  Eigen::MatrixXd values;         ///< [instants x channels], holes filled by the value before
  std::vector<ChannelShape> shapes;

  Eigen::Index instants() const { return time.size(); }
};

ProposalSamples proposal_samples(const Recording& recording, const SampleOptions& options = {});

/// @return [instants] central difference, one-sided at the ends of runs
Eigen::VectorXd rate_of_change(const ProposalSamples& samples,
                               const Eigen::Ref<const Eigen::VectorXd>& values);

}  // namespace sparflow
