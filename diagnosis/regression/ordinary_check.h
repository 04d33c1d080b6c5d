#pragma once
/// A second opinion on which of two effects explains the same evidence better: ordinary least squares, where every row
/// counts the same. Weighting by a noise model is sharper as long as that model is right; where most of a residual is
/// physics still missing it is not, and an autoregression close to a random walk then trusts differences between
/// neighbouring rows and looks away from what is large. Where the two ways of counting contradict each other
/// significantly, the noise model is what is wrong. Used by effect_search.cpp only.
/// Source: J. A. Hausman (1978), Specification tests in econometrics, Econometrica 46(6), on generalised against
/// ordinary least squares; the paired comparison as Q. H. Vuong (1989), Econometrica 57(2), with whole motions as units.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

/// Residuals of `base` and one more effect, by ordinary least squares.
struct OrdinaryResidual {
  std::vector<bool> channels;  ///< where the added effect shows
  std::vector<Eigen::VectorXd> residual;
};
/// @param active channels to fit: all that share a parameter with the effect
OrdinaryResidual ordinary_residual(const Evidence& evidence,
                                   const std::vector<const EffectDesign*>& base,
                                   const EffectDesign& effect, const std::vector<bool>& active);

/// By how much `other` leaves less than `one` in the channels where both show, each in units of what `one` leaves
/// there. [rows] Zero unless it is more than two standard errors over motions and a twentieth of what `one` leaves.
double ordinary_advantage(const Evidence& evidence, const OrdinaryResidual& other,
                          const OrdinaryResidual& one);

}  // namespace sparflow
