#pragma once
/// Minimises a smooth function of a few variables inside a box: BFGS with projected steps.
/// Source: Nocedal & Wright (2006), ch. 6.1 (update), 16.7 (projection, active set).
#include <Eigen/Dense>
#include <functional>

namespace sparflow {

struct BoxBfgsOptions {
  int max_iterations = 60;
  double gradient_tolerance = 1e-3;  ///< on the largest component that is not held by a bound
  double value_tolerance = 1e-7;     ///< decrease relative to 1 + |value| over one iteration
  double max_step = 2.0;             ///< longest change of one variable in one iteration
};

struct BoxBfgsResult {
  Eigen::VectorXd x;
  double value = 0.0;
  Eigen::VectorXd gradient;
  int iterations = 0;
  int evaluations = 0;
  bool converged = false;  ///< false: max_iterations, or no descent in working precision
};

/// @param function value at x; writes the gradient. May return infinity or NaN where it is not defined.
/// @param start moved into the box first
BoxBfgsResult minimise_in_box(
    const std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>& function,
    const Eigen::VectorXd& start, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
    const BoxBfgsOptions& options = {});

}  // namespace sparflow
