#pragma once
/// The one grammar of all formulas that users write: laws of effects, columns of a log's mapping, and units. A text becomes
/// a list of nodes with their places in the text, which is evaluated with any scalar of the program. What a name means is
/// the caller's matter.
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "models/expression/unit_algebra.h"

namespace sparflow {

struct ExpressionOptions {
  /// Longest text that is read.
  /// @threshold [characters] 1000..100000; chosen: a hundred lines, more than a person can check
  std::size_t longest = 10000;
  /// Deepest nesting of parentheses, signs and powers.
  /// @threshold [1] 30..1000; chosen: more than a person nests; five calls a level fit any stack
  int deepest = 100;
};

/// Value and derivatives of a function of one variable.
struct Curve {
  double f0, f1, f2;
};
Curve power_curve(double x, double n);  ///< x^n

/// A function that a formula may call.
struct ExpressionFunction {
  enum class Rule { kKept, kNone, kForgotten, kRoot, kSquare };
  const char* name;
  Rule rule;  ///< unit of the value; kNone: of the argument as well
  /// Null for min and max, which take two values or more. Where it has a kink, the derivative is that of one branch; where
  /// it would be infinite (sqrt at 0), it is 0.
  Curve (*curve)(double x);
};
const std::vector<ExpressionFunction>& expression_functions();
const ExpressionFunction* find_function(const std::string& name);  ///< null: there is none

struct ExpressionNode {
  enum class Op {
    kNumber,
    kName,
    kNegate,  // one operand from here
    kFunction,
    kRaise,  // to the constant power `number`; made by Expression::fold()
    kAdd,    // two operands from here
    kSubtract,
    kMultiply,
    kDivide,
    kPower,
    kMin,
    kMax,
    kGreater,
    kGreaterEqual,
    kLess,
    kLessEqual
  };
  Op op = Op::kNumber;
  double number = 0.0;             ///< SI
  std::size_t index = 0;           ///< of a name, as the caller counts
  std::size_t begin = 0, end = 0;  ///< [bytes] place in the text
  std::size_t at = 0;              ///< [bytes] of the operator, or of the function's name
  const ExpressionFunction* function = nullptr;
  std::optional<Unit> unit = {};  ///< of a number that has one in brackets

  std::size_t operands() const { return op < Op::kNegate ? 0 : op < Op::kAdd ? 1 : 2; }
};

class Expression {
 public:
  /// Reads the name at `at` and moves `at` behind it: a kName, or a kNumber for a constant. It returns nothing where no
  /// name begins, or a function's with its parenthesis. @throws TextError for an unknown name
  using NameReader =
      std::function<std::optional<ExpressionNode>(const std::string& text, std::size_t& at)>;
  struct Grammar {
    std::string what;  ///< "law", for messages
    NameReader name;
    bool numbers_have_units = false;  ///< 20[bar]
    bool of_units =
        false;  ///< `N·s/m²`: what stands side by side is multiplied, and · ² ³ are read
    ExpressionOptions options = {};
  };
  /// @throws TextError with the place of what is wrong, what was expected and what to do
  static Expression parse(const std::string& text, const Grammar& grammar);

  Expression() = default;
  explicit Expression(std::string text) : text_(std::move(text)) {}
  const std::string& text() const { return text_; }
  /// Operands precede their operator, so that one sweep with a stack evaluates them.
  const std::vector<ExpressionNode>& nodes() const { return nodes_; }
  std::string source(const ExpressionNode& node) const;  ///< its part of the text

  /// Appends a node whose operands are the last ones.
  void push(const ExpressionNode& node);
  /// The same, but an operation on numbers becomes a number, and a power with a constant exponent a kRaise.
  /// @throws TextError when the number is not finite
  void fold(ExpressionNode node);

  /// Value in SI, NaN or infinite where the formula is not defined (log of a negative number, 1/0). A NaN stays one, but in
  /// comparisons. It allocates only on a thread's first call; objects can be shared between threads.
  /// @param numbers, variables values of the names: index i is numbers[i], behind their end variables[i - numbers.size()]
  /// @tparam T double, or a scalar with `double value`, `T chain(f0, f1, f2) const` and + - * /
  template <class T>
  T evaluate(std::span<const double> numbers, std::span<const T> variables) const;

 private:
  friend class ExpressionParser;
  template <class T>
  static double number_of(const T& x) {
    if constexpr (std::is_same_v<T, double>) {
      return x;
    } else {
      return x.value;
    }
  }
  template <class T>
  static T chained(const T& x, const Curve& c) {
    if constexpr (std::is_same_v<T, double>) {
      return c.f0;
    } else {
      return x.chain(c.f0, c.f1, c.f2);
    }
  }
  template <class T>
  static T apply(const ExpressionNode& node, const T& a);
  template <class T>
  static T apply(const ExpressionNode& node, const T& a, const T& b);

  std::string text_;
  std::vector<ExpressionNode> nodes_;
  std::size_t waiting_ = 0, stack_ = 0;  // values on the stack behind the last node, and at most
};

/// The place of a byte, counted in characters from 1.
int text_column(const std::string& text, std::size_t at);
/// @throws TextError always, at this byte of the text
[[noreturn]] void fail_at(const std::string& text, std::size_t at, const std::string& message);
/// @return the place of the next character that is no blank, or the end
std::size_t skip_blanks(const std::string& text, std::size_t at);

template <class T>
T Expression::apply(const ExpressionNode& node, const T& a) {
  const double x = number_of(a);
  return chained(a, node.op == ExpressionNode::Op::kNegate  ? Curve{-x, -1.0, 0.0}
                    : node.op == ExpressionNode::Op::kRaise ? power_curve(x, node.number)
                                                            : node.function->curve(x));
}

template <class T>
T Expression::apply(const ExpressionNode& node, const T& a, const T& b) {
  using Op = ExpressionNode::Op;
  const double x = number_of(a), y = number_of(b);
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
      return y < x || std::isnan(y) ? b : a;
    case Op::kMax:
      return y > x || std::isnan(y) ? b : a;
    case Op::kGreater:
      return T(x > y ? 1.0 : 0.0);
    case Op::kGreaterEqual:
      return T(x >= y ? 1.0 : 0.0);
    case Op::kLess:
      return T(x < y ? 1.0 : 0.0);
    case Op::kLessEqual:
      return T(x <= y ? 1.0 : 0.0);
    default: {  // kPower: x^y0 exp((y - y0) log x), which depends on the exponent only where log x exists
      const T power = chained(a, power_curve(x, y));
      if constexpr (std::is_same_v<T, double>) {
        return power;
      } else {
        if (!(x > 0.0)) return power;
        return power * ((b - T(y)) * a.chain(std::log(x), 1.0 / x, -1.0 / (x * x))).chain(1, 1, 1);
      }
    }
  }
}

template <class T>
T Expression::evaluate(std::span<const double> numbers, std::span<const T> variables) const {
  using Op = ExpressionNode::Op;
  thread_local std::vector<T> stack;
  if (stack.size() < stack_) stack.resize(stack_);
  T* top = stack.data();  // behind the last value
  for (const ExpressionNode& node : nodes_) {
    if (node.op == Op::kNumber) {
      *top++ = T(node.number);
    } else if (node.op == Op::kName && node.index < numbers.size()) {
      *top++ = T(numbers[node.index]);
    } else if (node.op == Op::kName) {
      *top++ = variables[node.index - numbers.size()];
    } else if (node.operands() == 1) {
      top[-1] = apply(node, top[-1]);
    } else {
      top[-2] = apply(node, top[-2], top[-1]);
      --top;
    }
  }
  return *(top - 1);
}

}  // namespace sparflow
