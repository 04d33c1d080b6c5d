#pragma once
/// Proofs of one effect beside its likelihood: how large it is where it acts, how much of it learned laws
/// imitate, what it gains on motions left out, and the slopes that give nonlinear parameters an interval.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct EffectAction {
  /// Largest over channels: sqrt(sum c^4 / sum c^2) of its action c (baseline taken out) / noise. The weighting
  /// measures it where it acts: a lag shows for a second after a step and nowhere else.
  double size = 0.0;
  double absorbed = 0.0;             ///< 0..1, over all channels, each in units of its noise
  double absorbed_where_seen = 1.0;  ///< the same in the channel in which most of it is left
  /// Where it acts, its size over what the other effects' laws are known to be wrong by there (their form_error
  /// times their action): a small one beside a large one mends that one's form and is no effect of its own.
  double over_form = 1e9;
};

/// @param index which of the designs
EffectAction effect_action(const Evidence& evidence,
                           const std::vector<const EffectDesign*>& designs, std::size_t index,
                           const EffectFit& fit);

/// Share of an effect by which its law may differ from the machine's, sample by sample, even when fitted.
double form_share(const Effect& effect);

/// What changes when the law grows with another power, to first order: action times the logarithm of its size, one
/// column in each channel, bounded by what published exponents differ by (friction with v^0.85 for v, pipes with
/// Q^1.75 for Q^2). Without columns for effects whose law has no such freedom: weights, inertia.
/// @param theta of the design
EffectDesign other_power(const EffectDesign& design, const Eigen::VectorXd& theta);

/// Whether one of the design's linear parameters lies on the edge of what is plausible; zero is no edge: no effect.
bool rests_on_bound(const EffectDesign& design, const Eigen::Ref<const Eigen::VectorXd>& theta);

struct HeldOutGain {
  double gain = 0.0, error = 0.0;  ///< [nats], sum over folds and its standard error
  double improved = 0.0;           ///< share of the folds it improved
};

/// Blocks of motion in turn left out of the estimate; noise as in `fit`.
HeldOutGain held_out_gain(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                          std::size_t index, const EffectFit& fit, int folds);

/// By nonlinear parameter: whether it only chooses among variants of a law.
std::vector<bool> shape_choices(const Effect& effect);

/// The design with one more column for each nonlinear parameter: d(action)/d(parameter) at `theta`.
EffectDesign with_shape_slopes(const Evidence& evidence, const EffectDesign& design,
                               const Eigen::VectorXd& theta);

}  // namespace sparflow
