#pragma once
/// Learns a valve section's flow gain, Q = gain |u|, for one cylinder in one direction: robust least squares
/// through zero. The model has no dead band; an additional affine fit shows whether the data suggest one.
#include <Eigen/Dense>
#include <string>
#include <vector>

namespace sparflow {

struct LearnValveOptions {
  /// Least number of samples with a command and a flow.
  /// @threshold [samples] 2..1000; chosen: the robust standard deviation of fewer is no estimate
  int fewest_samples = 10;
  /// Least standard deviation of |u| over the largest |u| for the affine fit.
  /// @threshold [1] 0..0.5; chosen: with nearly one command only, slope and offset are not
  /// determined
  double least_spread = 0.02;
  /// Least dead band of which a warning tells.
  /// @threshold [1] 0..0.2; chosen: a hundredth of full command, which hardly affects a flow
  double least_dead_band = 0.01;
  /// Least dead band over its standard error.
  /// @threshold [1] 2..20; chosen: neighbouring samples are correlated and the standard error is
  /// too small, so a dead band must be large against it
  double dead_band_errors = 6.0;
  /// Largest unexplained share of the affine fit over that of the gain alone.
  /// @threshold [1] 0..1; chosen: the dead band must reduce the residual
  double residual_ratio = 0.8;
};

struct LearnedValve {
  double gain = 0.0;                 ///< [m^3/s] flow at full command
  double gain_standard_error = 0.0;  ///< [m^3/s]
  double r2 = 0.0;                   ///< [-] of Q about its mean
  double rmse = 0.0;                 ///< [m^3/s]
  int given = 0, used = 0;           ///< samples; used are finite ones with a command
  double command_max = 0.0;          ///< [-] largest |u| used; the gain extrapolates beyond

  // Diagnostics only: Q = affine_gain (|u| - dead_band).
  bool affine = false;  ///< whether |u| varies enough for the affine fit
  double affine_gain = 0.0, dead_band = 0.0, dead_band_standard_error = 0.0, affine_r2 = 0.0;
  std::vector<std::string> warnings;
};

/// @param command [-] of either sign; only |u| is used  @param flow [m^3/s] of the same samples, not negative
/// @throws InputError when fewer than `fewest_samples` can be used
LearnedValve learn_valve(const Eigen::Ref<const Eigen::VectorXd>& command,
                         const Eigen::Ref<const Eigen::VectorXd>& flow,
                         const LearnValveOptions& options = {});

}  // namespace sparflow
