#pragma once
/// Slips in how sensors are connected or named, each by its physical signature: a command whose sign is reversed, chambers A
/// and B exchanged, pressures or a payload in another unit than their column says. Such a log is no broken sensor: every
/// channel behaves, but not as its name promises. Angles in degrees are found where the log is read (log_checks.h).
#include <string>
#include <vector>

#include "identification/signals/signals.h"
#include "models/machine/machine.h"

namespace sparflow {

struct SensorSlip {
  std::string kind;                   ///< "sign", "swapped", "unit" or "swapped_and_unit"
  std::vector<std::string> channels;  ///< without unit: "pA_boom", "pB_boom"
  std::string sentence;               ///< what is seen, with figures, and what to do
};

struct SlipOptions {
  /// Command above which its direction is sure.
  /// @threshold [1] 0.02..0.5; chosen: beyond any dead band
  double firm_command = 0.15;
  /// Rod speed above which its direction is sure.
  /// @threshold [m/s] 1e-3..0.1; chosen: five times what position noise looks like
  double firm_speed = 0.01;
  /// Least number of samples for a verdict.
  /// @threshold [samples] 20..10000; chosen: a second of motion at 100 Hz
  Eigen::Index fewest = 100;
  /// Share of the samples with the expected direction below which the sign is reversed.
  /// @threshold [1] 0..0.4; chosen: lags and reversals leave a tenth of a right log's samples in doubt, and as many of a
  /// reversed one's
  double least_agreement = 0.2;
  /// Largest squared error of the right reading over that of the file's.
  /// @threshold [1] 0.05..0.6; chosen: half the error; friction and masses that are missing stay in both
  double error_share = 0.25;
  /// Largest squared error of the right reading over the squared static force.
  /// @threshold [1] 0.05..1; chosen: a reading that explains less than half of the force explains nothing
  double explained_share = 0.5;
  /// Ratio of a pump's pressure to the largest working pressure above which its unit is right.
  /// @threshold [1] 0.02..0.9; chosen: a pump below a third of what its cylinders work with cannot feed them
  double least_pump_ratio = 0.3;
  /// The same ratio, below which its unit is right.
  /// @threshold [1] 3..10; chosen: a demand of another function may be several times that of the only one measured
  double largest_pump_ratio = 8.0;
  /// Largest number of samples looked at; longer logs are thinned evenly.
  /// @threshold [samples] 200..1e6; chosen: enough for a ratio to a percent
  Eigen::Index most = 4000;
};

/// @param signals of one log, without effects
std::vector<SensorSlip> find_sensor_slips(const Machine& machine, const MachineSignals& signals,
                                          const SlipOptions& options = {});

}  // namespace sparflow
