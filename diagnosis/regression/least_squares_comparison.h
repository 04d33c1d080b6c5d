#pragma once
/// Compares two effects that explain the same evidence by ordinary least squares, as a check on the noise model.
/// Weighting by a noise model has more power as long as that model is right. While most of a residual is missing
/// physics, it is not: an autoregression close to a random walk then weights differences of neighbouring rows and
/// ignores large slow errors. Where both estimates contradict each other significantly, the noise model is rejected.
/// Used by the search only.
/// Source: J. A. Hausman (1978), Specification tests in econometrics, Econometrica 46(6), on generalised against
/// ordinary least squares; the paired comparison as Q. H. Vuong (1989), Econometrica 57(2), with motions as units.
#include <vector>

#include "diagnosis/regression/effect_fit.h"
#include "diagnosis/regression/regression_options.h"

namespace sparflow {

/// Residuals of `base` and one more effect, by ordinary least squares.
struct LeastSquaresResidual {
  std::vector<bool> channels;             ///< by channel: whether the added effect acts there
  std::vector<Eigen::VectorXd> residual;  ///< by channel [rows, SI]
};
/// @param active by channel: those to fit, which are all that share a parameter with the effect
LeastSquaresResidual least_squares_residual(const Evidence& evidence,
                                            const std::vector<const EffectDesign*>& base,
                                            const EffectDesign& effect,
                                            const std::vector<bool>& active);

/// Sum of squares of `one` less that of `other` over the channels where both act, each in units of the mean square of
/// `one` there [rows]. Zero unless it exceeds RegressionOptions::advantage_standard_errors over motions and
/// RegressionOptions::least_advantage of that of `one`.
double least_squares_advantage(const Evidence& evidence, const LeastSquaresResidual& other,
                               const LeastSquaresResidual& one,
                               const RegressionOptions& options = {});

}  // namespace sparflow
