#pragma once
/// The law of a user's effect: a text such as `Fc * tanh(v / v0)` over named signals and parameters. Its units are
/// checked when it is read, it is compiled to a flat tape, and it is evaluated in SI with any scalar of the program,
/// including exact derivatives. Grammar and functions: docs/user_effects.md.
#include <array>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "models/effects/formula/unit_algebra.h"

namespace sparflow {

/// A name that a law may contain.
struct Symbol {
  std::string name;  ///< "v", "q.boom"; "q.*" stands for every name that begins with "q."
  Unit unit;         ///< values are SI whatever its factor; a temperature reading stays in degC
  bool unit_known =
      true;  ///< false: it depends on the machine (revolute or prismatic joint) and is not checked
};

/// How a law depends on a group of parameters while everything else is constant.
enum class Dependence {
  kNone,          ///< not at all
  kProportional,  ///< sum of p_k f_k(signals, others): zero when the group is zero
  kAffine,        ///< the same plus a term without them
  kOther          ///< not linear, or not recognised as such (p^2/p is not simplified)
};

class Expression {
 public:
  /// Parses the law, checks its units and compiles it. A law has at most ten parameters.
  /// @throws TextError with the column in `law` [characters]
  static Expression compile(const std::string& law, const std::vector<Symbol>& signals,
                            const std::vector<Symbol>& parameters);

  /// Names of the functions a law may call; no symbol may have one of them.
  static std::vector<std::string> functions();

  const std::string& text() const { return text_; }
  const Dimension& dimension() const { return dimension_; }  ///< of the law's value
  bool dimension_known() const { return dimension_known_; }
  /// Names of the signals in the law, in the order of first appearance: the order of `signals` below.
  const std::vector<std::string>& signals() const { return signals_; }
  /// All parameters given to compile(), in that order: the order of `parameters` below.
  const std::vector<std::string>& parameters() const { return parameters_; }
  bool uses_parameter(const std::string& name) const;

  /// Value in SI, NaN or infinite where the law is not defined (log of a negative number, 1/0). Nothing
  /// is allocated, and objects can be shared between threads. Where a function has a kink the derivative is that of the
  /// branch taken (abs and max at the kink: the right or first one; sign, step: 0); where it would be infinite (sqrt at
  /// 0) it is 0.
  /// @param signals SI, readings in degC, in the order of signals(); T is double or has `double value` and
  ///   `T chain(f0, f1, f2) const`, as Jet
  /// @param parameters SI, in the order of parameters()
  template <class T>
  T evaluate(std::span<const T> signals, std::span<const double> parameters) const {
    return run<T, double>(signals, parameters);
  }
  /// The same with derivatives by parameters as well.
  template <class T>
  T evaluate_with(std::span<const T> signals, std::span<const T> parameters) const {
    return run<T, T>(signals, parameters);
  }
  /// Value and gradient by a reverse sweep, without allocation.
  /// @param gradient [parameters], overwritten
  double value_and_gradient(std::span<const double> signals, std::span<const double> parameters,
                            std::span<double> gradient) const;

  /// Decided from the tape, therefore for every value of the signals.
  Dependence dependence(std::span<const std::string> names) const;
  /// Whether the law is linear in this parameter while the others are constant.
  /// @throws logic_error for a name that is no parameter
  bool linear_in(const std::string& parameter) const;
  /// The largest group to which the law is jointly proportional, of several the one with earlier parameters:
  /// `Fc * sign(v) + B * v` gives {Fc, B}, `a * b * v` {a}, `k * (oil - T0)` {k}, `max(0, F - F0)` none.
  /// The law is then sum of p_k dlaw/dp_k over the group, whose derivatives do not depend on the group.
  std::vector<std::string> proportional_parameters() const;

 private:
  friend class ExpressionParser;
  enum class Op {
    kNumber,
    kSignal,
    kParameter,
    kAdd,  // two operands from here
    kSubtract,
    kMultiply,
    kDivide,
    kMin,
    kMax,
    kGreater,
    kGreaterEqual,
    kLess,
    kLessEqual,
    kVariablePower,
    kNegate,  // one operand from here
    kAbs,
    kSign,
    kStep,
    kPositive,
    kExp,
    kLog,
    kSqrt,
    kTanh,
    kSin,
    kCos,
    kPower,
  };
  /// Operands precede their operator (postfix), so that one sweep with a stack evaluates the tape.
  struct Node {
    Op op = Op::kNumber;
    int a = -1;          ///< operand's node; for signals and parameters their index
    int b = -1;          ///< second operand's node
    double value = 0.0;  ///< of a number; exponent of kPower
  };
  static constexpr std::size_t kMaxParameters = 10;
  static constexpr std::size_t kMaxNodes = 256;
  static constexpr std::size_t kMaxDepth = 24;  ///< largest size of the stack

  /// Value and derivatives of a function of one variable.
  struct Curve {
    double f0, f1, f2;
  };
  static Curve curve(const Node& node, double x);
  static bool binary(Op op) { return op >= Op::kAdd && op < Op::kNegate; }
  static bool unary(Op op) { return op >= Op::kNegate; }

  template <class T>
  static double number(const T& x) {
    if constexpr (std::is_same_v<T, double>) {
      return x;
    } else {
      return x.value;
    }
  }
  template <class T>
  static T apply(const Node& node, const T& x) {
    const Curve c = curve(node, number(x));
    if constexpr (std::is_same_v<T, double>) {
      return c.f0;
    } else {
      return x.chain(c.f0, c.f1, c.f2);
    }
  }
  template <class T>
  static T apply(const Node& node, const T& a, const T& b);
  template <class T, class P>
  T run(std::span<const T> signals, std::span<const P> parameters) const;
  void check_sizes(std::size_t signals, std::size_t parameters) const;
  Dependence dependence_on(const std::vector<bool>& in_group) const;
  static Dependence combined(const Node& node, Dependence a, Dependence b);

  std::string text_;
  Dimension dimension_;
  bool dimension_known_ = true;
  std::vector<std::string> signals_, parameters_;
  std::vector<Node> tape_;
};

template <class T>
T Expression::apply(const Node& node, const T& a, const T& b) {
  const double x = number(a), y = number(b);
  switch (node.op) {
    case Op::kAdd:
      return a + b;
    case Op::kSubtract:
      return a - b;
    case Op::kMultiply:
      return a * b;
    case Op::kDivide:
      return a / b;
    case Op::kMin:
      return y < x ? b : a;
    case Op::kMax:
      return y > x ? b : a;
    case Op::kGreater:
      return T(x > y ? 1.0 : 0.0);
    case Op::kGreaterEqual:
      return T(x >= y ? 1.0 : 0.0);
    case Op::kLess:
      return T(x < y ? 1.0 : 0.0);
    case Op::kLessEqual:
      return T(x <= y ? 1.0 : 0.0);
    default:  // kVariablePower: a smooth function of both only for a positive base
      if constexpr (std::is_same_v<T, double>) {
        return curve({Op::kPower, -1, -1, y}, x).f0;
      } else {
        if (!(x > 0.0)) return T(curve({Op::kPower, -1, -1, y}, x).f0);
        return apply<T>({Op::kExp, -1, -1, 0.0}, b * apply<T>({Op::kLog, -1, -1, 0.0}, a));
      }
  }
}

template <class T, class P>
T Expression::run(std::span<const T> signals, std::span<const P> parameters) const {
  check_sizes(signals.size(), parameters.size());
  std::array<T, kMaxDepth> stack;
  std::size_t top = 0;  // values on the stack
  for (const Node& node : tape_) {
    if (node.op == Op::kNumber) {
      stack[top++] = T(node.value);
    } else if (node.op == Op::kSignal) {
      stack[top++] = signals[static_cast<std::size_t>(node.a)];
    } else if (node.op == Op::kParameter) {
      stack[top++] = T(parameters[static_cast<std::size_t>(node.a)]);
    } else if (binary(node.op)) {
      stack[top - 2] = apply<T>(node, stack[top - 2], stack[top - 1]);
      --top;
    } else {
      stack[top - 1] = apply<T>(node, stack[top - 1]);
    }
  }
  return stack[0];
}

}  // namespace sparflow
