#pragma once
/// Checks an NlpProblem's derivatives against central differences with one Richardson extrapolation (error of
/// order h^4). Tests use it on every problem; users may apply it to their own.
#include <string>

#include "optimizer/nlp/nlp_problem.h"

namespace sparflow {

/// Errors are relative to the scale of what is compared: |exact - numeric| / max(1, largest |numeric| of the column).
struct DerivativeCheck {
  double gradient_error = 0.0;
  double jacobian_error = 0.0;
  double hessian_error = 0.0;  ///< of the Lagrangian, with multipliers of both signs
  std::string worst_gradient, worst_jacobian, worst_hessian;  ///< which entry, exact and numeric
  double worst() const;
};

/// Entries missing from a sparse structure count as zeros, so a wrong structure is found too.
/// @param x a point inside the domain of all functions; bounds are ignored
/// @param step difference step relative to max(1, |x_i|). The default balances the truncation error
///        h^4 f^(5) against the rounding error eps f / h for functions whose natural scale is 1; pass less
///        for functions that vary over a shorter length.
DerivativeCheck check_derivatives(NlpProblem& problem, const Eigen::VectorXd& x,
                                  double step = 1e-3);

}  // namespace sparflow
