#pragma once
/// Residual models: they find unmodelled structure in the residual, that is a dependence on measured signals that
/// remains after model, baseline and effects, so that its cause is not in the catalogue. Four models are tried, the
/// first two judged on motions left out:
///   flexible  a ridge regression on hat functions of every signal and on random Fourier features of all of
///             them together (A. Rahimi, B. Recht (2007), NIPS 20), cross-validated by whole blocks of motion
///   driven    hat functions of every signal times the sign of the speed (forces) or the command (speeds): what acts
///             against the motion or in proportion to the opening, with an amplitude that depends on a signal
///   event     a force or a speed that deviates at one place in time only
///   periodic  a line in the periodogram far above its surroundings (N. R. Lomb (1976), Astrophys. Space Sci. 39)
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/residual/residual_options.h"

namespace sparflow {

struct ResidualStructure {
  std::size_t channel = 0;
  double explained =
      0.0;  ///< 0..1 share of the residual's variance that the model explains on motions left out
  double rms = 0.0;                     ///< [SI] RMS of the explained part
  double noise = 0.0;                   ///< [SI] standard deviation of the rest
  std::vector<std::string> depends_on;  ///< names of signals, strongest first
  double frequency = 0.0;               ///< [Hz] of a periodic structure, else 0
  bool event = false;                   ///< whether it is an isolated event
  bool oscillation = false;             ///< whether it oscillates without a fixed frequency
};

/// Channels with unmodelled structure in the residual, the largest relative to noise first. @param fit with residuals
std::vector<ResidualStructure> find_residual_structure(const Evidence& evidence,
                                                       const EffectFit& fit,
                                                       const ResidualModelOptions& options = {});

/// What the residual of the reference logs says about that of the suspect logs in the channel of a structure: a ridge regression
/// on the flexible and the driven model's functions of the signals on which the structure depends, all where it names none, is
/// fitted to the references and predicts the suspect logs. The ridge is chosen by this prediction and the reverse one.
/// @param fit with residuals
/// @return [blocks of suspect logs] residual times prediction over the mean block's sum of squares; positive where both groups lack
///   the same law, negative where a law that is learned from both lies between two different ones; empty without references
std::vector<double> agreement_with_references(const Evidence& evidence, const EffectFit& fit,
                                              const ResidualStructure& structure,
                                              const ResidualModelOptions& options = {});

/// A signal on which a channel's residual may depend.
struct SignalColumn {
  std::string name;
  Eigen::VectorXd values;  ///< [rows]
};
std::vector<SignalColumn> channel_signals(const Evidence& evidence, const EvidenceChannel& channel,
                                          const ResidualModelOptions& options = {});

}  // namespace sparflow
