#pragma once
/// Least squares within the plausible ranges of the linear parameters, as every estimate of effects has them: in the regression itself
/// and in the prediction of motions left out. Used inside diagnosis/regression only.
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow {

struct ParameterBounds {
  Eigen::VectorXd lower, upper;  ///< [SI] by linear parameter
  ParameterBounds of(const std::vector<Eigen::Index>& some) const {
    return {lower(some), upper(some)};
  }
};

/// Ranges of all linear parameters of the designs, in their order.
ParameterBounds bounds_of(const std::vector<const EffectDesign*>& designs);

/// min 1/2 x'Nx - g'x inside bounds: the unconstrained solution or, outside them, cyclic coordinate descent.
/// @param at_bound if given, whether the unconstrained solution lies outside
Eigen::VectorXd solve_bounded(const Eigen::MatrixXd& n, const Eigen::VectorXd& g,
                              const ParameterBounds& b, bool* at_bound = nullptr);

}  // namespace sparflow
