#pragma once
/// The law of a user's effect: a formula such as `Fc * tanh(v / v0)` over named signals and parameters, whose units are
/// checked when it is read. Grammar and functions: docs/user_effects.md.
#include <span>
#include <string>
#include <vector>

#include "models/expression/expression.h"
#include "models/math/error.h"

namespace sparflow {

/// A name that a law may contain.
struct Symbol {
  std::string name;  ///< "v", "q.boom"; "q.*" stands for every name that begins with "q."
  Unit unit;         ///< values are SI whatever its factor; a temperature reading stays in degC
  /// False: it depends on the machine (revolute or prismatic joint) and is not checked.
  bool unit_known = true;
  std::string refused = {};  ///< why a law of this stage cannot have it; empty: it can
};

class Law {
 public:
  /// Parses a law and checks its units. A law has at most ten parameters.
  /// @throws TextError with the column in `text`
  static Law compile(const std::string& text, const std::vector<Symbol>& signals,
                     const std::vector<Symbol>& parameters);

  const std::string& text() const { return formula_.text(); }
  const Dimension& dimension() const { return dimension_; }  ///< of the law's value
  bool dimension_known() const { return dimension_known_; }
  /// Names of the signals in the law, in the order of first appearance: the order of `signals` below.
  const std::vector<std::string>& signals() const { return signals_; }
  /// All parameters given to compile(), in that order: the order of `parameters` below.
  const std::vector<std::string>& parameters() const { return parameters_; }
  bool uses_parameter(const std::string& name) const;
  /// The largest group to which the law is jointly proportional, of several the one with earlier parameters:
  /// `Fc * sign(v) + B * v` gives {Fc, B}, `a * b * v` {a}, `k * (oil - T0)` {k}, `max(0, F - F0)` none. Decided from the
  /// formula, therefore for every value of the signals; p^2/p is not simplified. The derivative by one parameter of the group
  /// is the law with that one at 1 and the others of the group at 0.
  std::vector<std::string> proportional_parameters() const;

  /// Value in SI (Expression::evaluate).
  /// @param signals SI, readings in degC, in the order of signals()
  /// @param parameters SI, in the order of parameters()
  template <class T>
  T evaluate(std::span<const T> signals, std::span<const double> parameters) const {
    SPARFLOW_CHECK(signals.size() == signals_.size() && parameters.size() == parameters_.size(),
                   "a law is evaluated with another number of signals or parameters than it has");
    return formula_.evaluate<T>(parameters, signals);
  }

 private:
  Expression formula_;  // names are indices of parameters, and behind these of signals
  Dimension dimension_;
  bool dimension_known_ = true;
  std::vector<std::string> signals_, parameters_;
};

/// The dimension of a law whose units have been checked, and the same law with its constant parts computed.
struct CheckedUnits {
  Dimension dimension;
  bool known = true;
  Expression folded;
};
/// @param symbols by the index of their names  @throws TextError with the column of what does not fit
CheckedUnits check_units(const Expression& law, const std::vector<Symbol>& symbols);

}  // namespace sparflow
