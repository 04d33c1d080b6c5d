#pragma once
/// Learns a valve section's flow gain, Q = gain |u|, for one cylinder in one direction: robust least squares
/// through zero. The model has no dead band; an additional affine fit shows whether the data suggest one.
#include <Eigen/Dense>
#include <string>
#include <vector>

namespace sparflow {

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
/// @throws InputError when fewer than ten samples can be used
LearnedValve learn_valve(const Eigen::Ref<const Eigen::VectorXd>& command,
                         const Eigen::Ref<const Eigen::VectorXd>& flow);

}  // namespace sparflow
