#include "models/effects/formula/expression.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "models/math/error.h"

namespace sparflow {

Expression::Curve Expression::curve(const Node& node, double x) {
  switch (node.op) {
    case Op::kNegate:
      return {-x, -1.0, 0.0};
    case Op::kAbs:
      return x < 0.0 ? Curve{-x, -1.0, 0.0} : Curve{x, 1.0, 0.0};
    case Op::kSign:
      return {x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x, 0.0, 0.0};  // The last x preserves NaN.
    case Op::kStep:
      return {x > 0.0 ? 1.0 : x <= 0.0 ? 0.0 : x, 0.0, 0.0};
    case Op::kPositive:
      return x <= 0.0 ? Curve{0.0, 0.0, 0.0} : Curve{x, 1.0, 0.0};
    case Op::kExp: {
      const double e = std::exp(x);
      return {e, e, e};
    }
    case Op::kLog:
      return {std::log(x), 1.0 / x, -1.0 / (x * x)};
    case Op::kSqrt: {
      const double s = std::sqrt(x);
      if (x == 0.0) return {s, 0.0, 0.0};
      return {s, 0.5 / s, -0.25 / (s * x)};
    }
    case Op::kTanh: {
      const double t = std::tanh(x), t1 = 1.0 - t * t;
      return {t, t1, -2.0 * t * t1};
    }
    case Op::kSin: {
      const double s = std::sin(x);
      return {s, std::cos(x), -s};
    }
    case Op::kCos: {
      const double c = std::cos(x);
      return {c, -std::sin(x), -c};
    }
    default: {  // kPower
      const double n = node.value;
      if (n == 2.0) return {x * x, 2.0 * x, 2.0};
      Curve c{std::pow(x, n), n == 0.0 ? 0.0 : n * std::pow(x, n - 1.0),
              n == 0.0 || n == 1.0 ? 0.0 : n * (n - 1.0) * std::pow(x, n - 2.0)};
      if (x == 0.0 && n > 0.0) {  // x^1.5 has no second derivative at 0
        if (!std::isfinite(c.f1)) c.f1 = 0.0;
        if (!std::isfinite(c.f2)) c.f2 = 0.0;
      }
      return c;
    }
  }
}

void Expression::check_sizes(std::size_t signals, std::size_t parameters) const {
  SPARFLOW_CHECK(!tape_.empty(), "a law is evaluated that was never compiled");
  SPARFLOW_CHECK(signals == signals_.size() && parameters == parameters_.size(),
                 "a law is evaluated with another number of signals or parameters than it has");
}

bool Expression::uses_parameter(const std::string& name) const {
  return std::any_of(tape_.begin(), tape_.end(), [&](const Node& node) {
    return node.op == Op::kParameter && parameters_[static_cast<std::size_t>(node.a)] == name;
  });
}

double Expression::value_and_gradient(std::span<const double> signals,
                                      std::span<const double> parameters,
                                      std::span<double> gradient) const {
  check_sizes(signals.size(), parameters.size());
  SPARFLOW_CHECK(gradient.size() == parameters_.size(), "a gradient has one entry a parameter");
  std::fill(gradient.begin(), gradient.end(), 0.0);
  std::array<double, kMaxNodes> value, adjoint;
  const auto at = [](int node) { return static_cast<std::size_t>(node); };
  for (std::size_t i = 0; i < tape_.size(); ++i) {
    const Node& node = tape_[i];
    adjoint[i] = 0.0;
    value[i] = node.op == Op::kNumber      ? node.value
               : node.op == Op::kSignal    ? signals[at(node.a)]
               : node.op == Op::kParameter ? parameters[at(node.a)]
               : binary(node.op) ? apply<double>(node, value[at(node.a)], value[at(node.b)])
                                 : apply<double>(node, value[at(node.a)]);
  }
  adjoint[tape_.size() - 1] = 1.0;
  for (std::size_t i = tape_.size(); i-- > 0;) {
    const Node& node = tape_[i];
    if (adjoint[i] == 0.0 || node.op == Op::kNumber || node.op == Op::kSignal) continue;
    if (node.op == Op::kParameter) {
      gradient[at(node.a)] += adjoint[i];
      continue;
    }
    const double x = value[at(node.a)];
    double by_a = 0.0, by_b = 0.0;
    if (unary(node.op)) {
      adjoint[at(node.a)] += adjoint[i] * curve(node, x).f1;
      continue;
    }
    const double y = value[at(node.b)];
    switch (node.op) {
      case Op::kAdd:
        by_a = by_b = 1.0;
        break;
      case Op::kSubtract:
        by_a = 1.0;
        by_b = -1.0;
        break;
      case Op::kMultiply:
        by_a = y;
        by_b = x;
        break;
      case Op::kDivide:
        by_a = 1.0 / y;
        by_b = -x / (y * y);
        break;
      case Op::kMin:
        (y < x ? by_b : by_a) = 1.0;
        break;
      case Op::kMax:
        (y > x ? by_b : by_a) = 1.0;
        break;
      case Op::kVariablePower:
        if (x > 0.0) {
          by_a = y * std::pow(x, y - 1.0);
          by_b = value[i] * std::log(x);
        }
        break;
      default:  // comparisons
        break;
    }
    adjoint[at(node.a)] += adjoint[i] * by_a;
    adjoint[at(node.b)] += adjoint[i] * by_b;
  }
  return value[tape_.size() - 1];
}

Dependence Expression::combined(const Node& node, Dependence a, Dependence b) {
  if (a == Dependence::kOther || b == Dependence::kOther) return Dependence::kOther;
  const bool free_a = a == Dependence::kNone, free_b = b == Dependence::kNone;
  if (free_a && free_b) return Dependence::kNone;
  switch (node.op) {
    case Op::kAdd:
    case Op::kSubtract:
      return a == b ? a : Dependence::kAffine;
    case Op::kMultiply:
      return free_a ? b : free_b ? a : Dependence::kOther;
    case Op::kDivide:
      return free_b ? a : Dependence::kOther;
    case Op::kNegate:
      return a;
    case Op::kPower:
      return node.value == 1.0 ? a : Dependence::kOther;
    default:
      return Dependence::kOther;
  }
}

Dependence Expression::dependence_on(const std::vector<bool>& in_group) const {
  std::array<Dependence, kMaxDepth> stack;
  std::size_t top = 0;
  for (const Node& node : tape_) {
    if (node.op == Op::kParameter) {
      const bool inside = in_group[static_cast<std::size_t>(node.a)];
      stack[top++] = inside ? Dependence::kProportional : Dependence::kNone;
    } else if (node.op == Op::kNumber || node.op == Op::kSignal) {
      stack[top++] = Dependence::kNone;
    } else if (binary(node.op)) {
      stack[top - 2] = combined(node, stack[top - 2], stack[top - 1]);
      --top;
    } else {
      stack[top - 1] = combined(node, stack[top - 1], Dependence::kNone);
    }
  }
  return stack[0];
}

Dependence Expression::dependence(std::span<const std::string> names) const {
  std::vector<bool> in_group(parameters_.size(), false);
  for (const std::string& name : names) {
    const auto found = std::find(parameters_.begin(), parameters_.end(), name);
    SPARFLOW_CHECK(found != parameters_.end(), "a law has no parameter " + name);
    in_group[static_cast<std::size_t>(found - parameters_.begin())] = true;
  }
  return dependence_on(in_group);
}

bool Expression::linear_in(const std::string& parameter) const {
  return dependence({&parameter, 1}) != Dependence::kOther;
}

std::vector<std::string> Expression::proportional_parameters() const {
  unsigned best = 0;
  for (unsigned group = 1; group < 1u << parameters_.size(); ++group) {
    if (std::popcount(group) <= std::popcount(best) && best != 0) {
      // Of groups of equal size the one with earlier parameters (lower bits) is kept.
      continue;
    }
    std::vector<bool> in_group(parameters_.size());
    for (std::size_t i = 0; i < in_group.size(); ++i) in_group[i] = ((group >> i) & 1u) != 0;
    if (dependence_on(in_group) == Dependence::kProportional) best = group;
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (((best >> i) & 1u) != 0 && uses_parameter(parameters_[i])) names.push_back(parameters_[i]);
  }
  return names;
}

}  // namespace sparflow
