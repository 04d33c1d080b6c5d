/// Jet against numeric derivatives, function by function.
#include "models/math/jet.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/models/numeric.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::numeric_derivative;

// Functions of two variables, written once and evaluated with doubles and with Jets.
struct Binary {
  std::string name;
  std::function<double(double, double)> plain;
  std::function<Jet(const Jet&, const Jet&)> jet;
};

#define SPARFLOW_BINARY(expression)                                                             \
  Binary {                                                                                      \
#expression,                                                                                  \
        [](double x, double y) -> double { using std::abs, std::cos, std::exp, std::log, std::sin, std::sqrt, std::tanh; return (expression) + 0.0 * (x + y); }, \
        [](const Jet& x, const Jet& y) -> Jet {                                        \
          return (expression) + 0.0 * (x + y);                                                    \
        } \
  }

const std::vector<Binary>& binary_functions() {
  static const std::vector<Binary> functions = {
      SPARFLOW_BINARY(x + y),
      SPARFLOW_BINARY(x - y),
      SPARFLOW_BINARY(-x),
      SPARFLOW_BINARY(x * y),
      SPARFLOW_BINARY(x / y),
      SPARFLOW_BINARY(2.0 / x - y / 3.0),
      SPARFLOW_BINARY(sin(x * y)),
      SPARFLOW_BINARY(cos(x - y * y)),
      SPARFLOW_BINARY(sqrt(x * x + y)),
      SPARFLOW_BINARY(exp(x * y)),
      SPARFLOW_BINARY(log(x + y * y)),
      SPARFLOW_BINARY(tanh(x * y - y)),
      SPARFLOW_BINARY(abs(x - y) * (x - y)),
      SPARFLOW_BINARY(abs(y - x) * x),
      SPARFLOW_BINARY(sin(x) * exp(y) / sqrt(x + y)),
  };
  return functions;
}

TEST(Jet, MatchesNumericDerivativesOfEveryFunction) {
  for (const Binary& f : binary_functions()) {
    for (const auto& at : {std::pair{0.7, 1.3}, std::pair{1.9, 0.4}}) {
      const double x = at.first, y = at.second;
      SCOPED_TRACE(f.name);
      const Jet d = f.jet(Jet::variable(x, 0, 2), Jet::variable(y, 1, 2));
      EXPECT_DOUBLE_EQ(d.value, f.plain(x, y));
      const auto gradient_x = [&](double a, double b) {
        return numeric_derivative([&](double v) { return f.plain(v, b); }, a);
      };
      const auto gradient_y = [&](double a, double b) {
        return numeric_derivative([&](double v) { return f.plain(a, v); }, b);
      };
      EXPECT_NEAR(d.gradient(0), gradient_x(x, y), kDerivativeTolerance);
      EXPECT_NEAR(d.gradient(1), gradient_y(x, y), kDerivativeTolerance);
      // The reference is differences of the Jet's own gradient, which the lines above have checked.
      const auto gradient = [&](double a, double b, int k) {
        return f.jet(Jet::variable(a, 0, 2), Jet::variable(b, 1, 2)).gradient(k);
      };
      const double xx = numeric_derivative([&](double v) { return gradient(v, y, 0); }, x);
      const double yx = numeric_derivative([&](double v) { return gradient(v, y, 1); }, x);
      const double yy = numeric_derivative([&](double v) { return gradient(x, v, 1); }, y);
      const double scale = 1.0 + std::abs(xx) + std::abs(yx) + std::abs(yy);
      EXPECT_NEAR(d.hessian(0, 0), xx, kDerivativeTolerance * scale);
      EXPECT_NEAR(d.hessian(1, 0), yx, kDerivativeTolerance * scale);
      EXPECT_NEAR(d.hessian(1, 1), yy, kDerivativeTolerance * scale);
      EXPECT_EQ(d.hessian(0, 1), d.hessian(1, 0));
    }
  }
}

TEST(Jet, CompoundAssignmentIsTheBinaryOperation) {
  const Jet x = Jet::variable(0.7, 0, 2), y = Jet::variable(1.3, 1, 2);
  const auto expect_equal = [](const Jet& a, const Jet& b) {
    EXPECT_EQ(a.value, b.value);
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(a.gradient(i), b.gradient(i));
      for (int k = 0; k <= i; ++k) EXPECT_EQ(a.hessian(i, k), b.hessian(i, k));
    }
  };
  Jet a = x;
  expect_equal(a += y, x + y);
  expect_equal(a = x, x);
  expect_equal(a -= y, x - y);
  a = x;
  expect_equal(a *= y, x * y);
  a = x;
  expect_equal(a /= y, x / y);
  a = x;
  expect_equal(a *= a, x * x);  // an operand that is also the result
}

TEST(Jet, ComparesByValueAlone) {
  const Jet x = Jet::variable(1.0, 0, 2), y = Jet::variable(2.0, 1, 2);
  EXPECT_TRUE(x < y);
  EXPECT_TRUE(y > x);
  EXPECT_TRUE(x == Jet(1.0));
  EXPECT_EQ(plain(x), 1.0);
}

TEST(Jet, ConstantsHaveNoVariablesAndCombineWithAny) {
  const Jet x = Jet::variable(0.7, 1, 3), constant = 2.0;
  for (const Jet& y : {constant * x, x * constant, x + x, x / Jet(0.5)}) {
    EXPECT_EQ(y.variables(), 3);
    EXPECT_EQ(y.gradient(1), 2.0);
    EXPECT_EQ(y.gradient(0), 0.0);
  }
  EXPECT_EQ((constant * constant).variables(), 0);
  EXPECT_EQ(constant.gradient(2), 0.0);
}

}  // namespace
}  // namespace sparflow
