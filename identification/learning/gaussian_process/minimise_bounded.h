#pragma once
/// Minimises a smooth function of a few bounded variables. NLopt's SLSQP does the work.
/// Source: D. Kraft (1994), Algorithm 733, ACM Transactions on Mathematical Software 20(3).
#include <Eigen/Dense>
#include <functional>

namespace sparflow {

struct MinimiseOptions {
  int max_evaluations = 200;
  double value_tolerance = 1e-7;  ///< [1] relative decrease at which it ends
};

struct Minimum {
  Eigen::VectorXd x;
  double value = 0.0;
  int evaluations = 0;
  bool converged = false;  ///< false after max_evaluations or without descent in working precision
};

/// @param function returns the value at x and writes the gradient; infinity or NaN where it is not defined
/// @param start is projected into the box first
/// @return the best point that was evaluated
Minimum minimise_bounded(
    const std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>& function,
    const Eigen::VectorXd& start, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
    const MinimiseOptions& options = {});

}  // namespace sparflow
