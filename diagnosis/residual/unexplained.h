#pragma once
/// What is left in a channel after model, baseline and effects that still depends on something measured: the
/// catalogue then does not hold the cause. Looks at the residual, judged on motions left out:
///   flexible  a ridge regression on hat functions of every signal and on random Fourier features of all of
///             them together (A. Rahimi, B. Recht (2007), NIPS 20), cross-validated by whole blocks of motion
///   driven    in forces the sign of the speed, in speeds the command, times hat functions of every signal: what acts
///             against the motion or in proportion to the opening by an amount that depends on something
///   event     one place in time where a force or a speed is far off and nowhere else
///   periodic  a line in its periodogram far above its surroundings (N. R. Lomb (1976), Astrophys. Space Sci. 39)
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct Leftover {
  std::size_t channel = 0;
  double explained =
      0.0;  ///< share of the residual's variance that the look explains on motions left out
  double rms = 0.0;                     ///< [SI] of that part
  double noise = 0.0;                   ///< [SI] standard deviation of the rest
  std::vector<std::string> depends_on;  ///< signals, strongest first
  double frequency = 0.0;               ///< [Hz] of a periodic one, else 0
  bool event = false;                   ///< in one place in time alone
};

struct LeftoverOptions {
  double least_share = 0.10;  ///< of the residual's variance, on motions left out
  /// The same of what acts with the motion or the opening: a valve's or a seal's own small irregularities do that too.
  double least_share_driven = 0.3;
  double least_size = 0.35;   ///< RMS of the explained part / noise of the rest
  double least_event = 4.0;   ///< times the usual second, in one place alone
  double deepest_dip = -0.3;  ///< of the autocorrelation of what is fast, below which it swings
  int folds = 5;
};

/// Channels in which something is left, the largest (relative to noise) first. @param fit with residuals
std::vector<Leftover> find_leftovers(const Evidence& evidence, const EffectFit& fit,
                                     const LeftoverOptions& options = {});

/// Names and values [rows] of the signals a channel's residual may depend on.
struct SignalColumn {
  std::string name;
  Eigen::VectorXd values;
};
std::vector<SignalColumn> channel_signals(const Evidence& evidence, const EvidenceChannel& channel);

}  // namespace sparflow
