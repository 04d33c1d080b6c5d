#pragma once
/// Statistics of the acceptance tests of one effect beside its gain: size where it acts, absorbed share, gain on
/// motions left out; and the derivatives from which nonlinear parameters get an interval.
#include <span>
#include <vector>

#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/regression/regression_options.h"

namespace sparflow {

/// Distance from a bound within which a parameter lies on it, as a share of its range: that of rounding.
inline constexpr double kOnBound = 1e-6;

struct EffectAction {
  /// [-] largest over channels of sqrt(sum c^4 / sum c^2) / noise, c = action of the effect less its projection on the
  /// baseline. The fourth powers measure the size where the effect acts: a lag shows only for a second after a step.
  double size = 0.0;
  double absorbed =
      0.0;  ///< 0..1 absorbed share over all channels, each in units of its noise; of a change, of what the same law in
            ///< all logs leaves
  double absorbed_where_seen =
      1.0;  ///< 0..1 absorbed share in the channel in which most of the effect remains
  /// [-] size of the effect over the size that it would have from the model-form error of the others. That is their form_error times
  /// their action times an unknown factor of the stretch of motion: a part that all stretches have alike in which the effect acts to the
  /// same side, and one of each by itself, of either sign, which may follow the effect in that stretch. With s_b the products of both
  /// actions in stretch b over the squares of the effect's,
  ///   1 / over_form^2 = (sum of s_b, forward)^2 + (sum of s_b, backward)^2 + sum of (the same of their magnitudes, by row)^2,
  /// so that what shows alike in many stretches is not taken for such an error. An effect that is small by this measure compensates it.
  double over_form = 1e9;
};

/// @param index the effect's index in `designs`  @param fit of all designs
EffectAction effect_action(const Evidence& evidence,
                           const std::vector<const EffectDesign*>& designs, std::size_t index,
                           const EffectFit& fit, const RegressionOptions& options = {});

/// Model-form error as a share of the effect: how much its fitted law may still differ from the machine's, by sample.
double form_share(const Effect& effect, const RegressionOptions& options = {});

/// First-order change of an effect when its law has another exponent: the action times the logarithm of its size, one
/// column in each channel. The bounds cover the published exponents (friction with v^0.85 instead of v, pipes with
/// Q^1.75 instead of Q^2). Effects whose law has no free exponent (weights, inertia) get no columns.
/// @param theta linear parameters of the design [SI]
EffectDesign other_power(const EffectDesign& design, const Eigen::VectorXd& theta,
                         const RegressionOptions& options = {});

/// Whether one of the design's linear parameters lies on its bound. A lower bound of zero does not count: it means that
/// the effect is absent.
bool rests_on_bound(const EffectDesign& design, const Eigen::Ref<const Eigen::VectorXd>& theta);

struct HeldOutGain {
  double gain = 0.0, error = 0.0;  ///< [nats] sum over folds and its standard error
  double improved = 0.0;           ///< 0..1 share of folds whose error it reduces
  /// Chance of gains as large in the stretches of motion in which it acts, if it gained nothing: Student's test on the slope of what they
  /// show over what the other folds predict, against one half. One where fewer than two are known.
  double chance = 1.0;
};

/// Gain of one design by cross-validation over blocks of motion, with the noise models of `fit`.
HeldOutGain held_out_gain(const Evidence& evidence, const std::vector<const EffectDesign*>& designs,
                          std::size_t index, const EffectFit& fit, int folds);

/// For each nonlinear parameter, whether it has no continuous value at this point: a choice among variants of a law, or an optional
/// parameter that is absent.
std::vector<bool> shape_choices(const Effect& effect, std::span<const double> shape);

/// The design with one more column for each nonlinear parameter: d(action)/d(parameter) at `theta` [SI].
EffectDesign with_shape_slopes(const Evidence& evidence, const EffectDesign& design,
                               const Eigen::VectorXd& theta);

}  // namespace sparflow
