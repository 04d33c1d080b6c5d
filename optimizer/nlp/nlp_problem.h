#pragma once
/// A smooth nonlinear programme, independent of any solver:
///   minimise f(x)   subject to   x_lower <= x <= x_upper,   g_lower <= g(x) <= g_upper
/// with exact sparse first and second derivatives whose structure never changes.
#include <Eigen/Dense>
#include <limits>
#include <string>

namespace sparflow {

/// Value of a bound that does not exist.
inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

struct NlpSize {
  int variables = 0;
  int constraints = 0;
  int jacobian_nonzeros = 0;
  int hessian_nonzeros = 0;  ///< lower triangle
};

/// Multipliers of L = f + constraint^T g - lower^T (x - x_lower) + upper^T (x - x_upper); `lower` and `upper`
/// are >= 0, and a constraint's multiplier is > 0 where its upper bound is active.
struct NlpMultipliers {
  Eigen::VectorXd constraint;  ///< [constraints]
  Eigen::VectorXd lower;       ///< [variables]
  Eigen::VectorXd upper;       ///< [variables]
};

/// An object is a mutable workspace; each thread needs its own. Calls come in any order and at any x; an object that
/// shares work between them compares x with the last one (a memcmp, far cheaper than any evaluation).
/// A value that is not finite makes the solver take a shorter step; an exception ends the solve.
class NlpProblem {
 public:
  using In = Eigen::Ref<const Eigen::VectorXd>;
  using Out = Eigen::Ref<Eigen::VectorXd>;
  using OutIndex = Eigen::Ref<Eigen::VectorXi>;

  virtual ~NlpProblem() = default;
  virtual NlpSize size() const = 0;
  /// Equal bounds fix a variable, or make an equality of a constraint; +-kNoBound leaves a side free.
  virtual void bounds(Out x_lower, Out x_upper, Out g_lower, Out g_upper) const = 0;
  virtual void start(Out x) const = 0;
  /// Initial multipliers for a `start` near a solution; nullptr = cold start.
  virtual const NlpMultipliers* start_multipliers() const { return nullptr; }

  virtual double objective(In x) = 0;
  virtual void gradient(In x, Out gradient) = 0;
  virtual void constraints(In x, Out g) = 0;
  /// Row and column of each value that `jacobian` writes, 0-based; values with equal indices are added.
  virtual void jacobian_structure(OutIndex row, OutIndex column) const = 0;
  virtual void jacobian(In x, Out value) = 0;
  /// Row >= column of each value that `hessian` writes, 0-based; values with equal indices are added.
  virtual void hessian_structure(OutIndex row, OutIndex column) const = 0;
  /// objective_factor * Hessian(f) + sum_i multiplier[i] * Hessian(g_i)
  virtual void hessian(In x, double objective_factor, In multiplier, Out value) = 0;

  /// Name for messages, e.g. "q[jib] at t = 1.84 s".
  virtual std::string variable_name(int index) const { return "x[" + std::to_string(index) + "]"; }
  virtual std::string constraint_name(int index) const {
    return "g[" + std::to_string(index) + "]";
  }
};

}  // namespace sparflow
