/// Dual2 and Taylor3 against numeric derivatives, function by function.
#include "models/math/dual.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/models/numeric.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::numeric_derivative;

// Functions of two variables, written once and evaluated with doubles and with duals.
struct Binary {
  std::string name;
  std::function<double(double, double)> plain;
  std::function<Dual2<2>(const Dual2<2>&, const Dual2<2>&)> dual;
};

#define SPARFLOW_BINARY(expression)                                                             \
  Binary {                                                                                      \
#expression,                                                                                  \
        [](double x, double y) -> double { using namespace std; return (expression) + 0.0 * (x + y); }, \
        [](const Dual2<2>& x, const Dual2<2>& y) -> Dual2<2> {                                    \
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

TEST(Dual2, MatchesNumericDerivativesOfEveryFunction) {
  for (const Binary& f : binary_functions()) {
    for (const auto& [x, y] : {std::pair{0.7, 1.3}, std::pair{1.9, 0.4}}) {
      SCOPED_TRACE(f.name);
      const Dual2<2> d = f.dual(Dual2<2>::variable(x, 0), Dual2<2>::variable(y, 1));
      EXPECT_DOUBLE_EQ(d.value, f.plain(x, y));
      const auto gradient_x = [&](double a, double b) {
        return numeric_derivative([&](double v) { return f.plain(v, b); }, a);
      };
      const auto gradient_y = [&](double a, double b) {
        return numeric_derivative([&](double v) { return f.plain(a, v); }, b);
      };
      EXPECT_NEAR(d.gradient[0], gradient_x(x, y), kDerivativeTolerance);
      EXPECT_NEAR(d.gradient[1], gradient_y(x, y), kDerivativeTolerance);
      // The reference is differences of the dual's own gradient, which the lines above have checked.
      const auto gradient = [&](double a, double b, std::size_t k) {
        return f.dual(Dual2<2>::variable(a, 0), Dual2<2>::variable(b, 1)).gradient[k];
      };
      const double xx = numeric_derivative([&](double v) { return gradient(v, y, 0); }, x);
      const double yx = numeric_derivative([&](double v) { return gradient(v, y, 1); }, x);
      const double yy = numeric_derivative([&](double v) { return gradient(x, v, 1); }, y);
      const double scale = 1.0 + std::abs(xx) + std::abs(yx) + std::abs(yy);
      EXPECT_NEAR(d.hess(0, 0), xx, kDerivativeTolerance * scale);
      EXPECT_NEAR(d.hess(1, 0), yx, kDerivativeTolerance * scale);
      EXPECT_NEAR(d.hess(1, 1), yy, kDerivativeTolerance * scale);
      EXPECT_EQ(d.hess(0, 1), d.hess(1, 0));
    }
  }
}

TEST(Dual2, CompoundAssignmentIsTheBinaryOperation) {
  const Dual2<2> x = Dual2<2>::variable(0.7, 0), y = Dual2<2>::variable(1.3, 1);
  const auto expect_equal = [](const Dual2<2>& a, const Dual2<2>& b) {
    EXPECT_EQ(a.value, b.value);
    EXPECT_EQ(a.gradient, b.gradient);
    EXPECT_EQ(a.hessian, b.hessian);
  };
  Dual2<2> a = x;
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

TEST(Dual2, ComparesByValueAlone) {
  const Dual2<2> x = Dual2<2>::variable(1.0, 0), y = Dual2<2>::variable(2.0, 1);
  EXPECT_TRUE(x < y);
  EXPECT_TRUE(y > x);
  EXPECT_TRUE(x == Dual2<2>(1.0));
  EXPECT_EQ(plain(x), 1.0);
}

struct Unary {
  std::string name;
  std::function<double(double)> plain;
  std::function<Taylor3(const Taylor3&)> taylor;
};

#define SPARFLOW_UNARY(expression)                                                     \
  Unary {                                                                              \
#expression, [](double x) -> double { using namespace std; return (expression); },   \
        [](const Taylor3& x) -> Taylor3 { return (expression); } \
  }

TEST(Taylor3, MatchesNumericDerivativesOfEveryFunction) {
  const std::vector<Unary> functions = {
      SPARFLOW_UNARY(x + 2.0),
      SPARFLOW_UNARY(2.0 - x * x),
      SPARFLOW_UNARY(-x * x * x),
      SPARFLOW_UNARY(x * sin(x)),
      SPARFLOW_UNARY(1.0 / (x * x)),
      SPARFLOW_UNARY(x / (1.0 + x * x)),
      SPARFLOW_UNARY(sin(x * x)),
      SPARFLOW_UNARY(cos(2.0 * x + x * x)),
      SPARFLOW_UNARY(sqrt(1.0 + x * x * x)),
      SPARFLOW_UNARY(sqrt(5.0 - 4.0 * cos(x)) / sin(x)),
  };
  for (const Unary& f : functions) {
    for (const double x : {0.6, 1.4}) {
      SCOPED_TRACE(f.name);
      const Taylor3 t = f.taylor(Taylor3::variable(x));
      EXPECT_DOUBLE_EQ(t.value, f.plain(x));
      const auto at = [&](double v) { return f.taylor(Taylor3::variable(v)); };
      // each derivative against differences of the one below; the lowest against the plain function
      EXPECT_NEAR(t.d1, numeric_derivative(f.plain, x),
                  kDerivativeTolerance * (1 + std::abs(t.d1)));
      EXPECT_NEAR(t.d2, numeric_derivative([&](double v) { return at(v).d1; }, x),
                  kDerivativeTolerance * (1 + std::abs(t.d2)));
      EXPECT_NEAR(t.d3, numeric_derivative([&](double v) { return at(v).d2; }, x),
                  kDerivativeTolerance * (1 + std::abs(t.d3)));
    }
  }
}

TEST(Taylor3, CompoundAssignmentIsTheBinaryOperation) {
  const Taylor3 x = Taylor3::variable(0.7), y = sin(x);
  const auto expect_equal = [](const Taylor3& a, const Taylor3& b) {
    EXPECT_EQ(a.value, b.value);
    EXPECT_EQ(a.d1, b.d1);
    EXPECT_EQ(a.d2, b.d2);
    EXPECT_EQ(a.d3, b.d3);
  };
  Taylor3 a = x;
  expect_equal(a += y, x + y);
  a = x;
  expect_equal(a -= y, x - y);
  a = x;
  expect_equal(a *= y, x * y);
  a = x;
  expect_equal(a /= y, x / y);
}

TEST(Taylor3, WorksInsideEigen) {
  const Taylor3 x = Taylor3::variable(0.4);
  const Vector3<Taylor3> circle(cos(x), sin(x), Taylor3(0.5));
  const Taylor3 norm2 = circle.dot(circle);
  // cos^2 + sin^2 is constant: only rounding of terms of size one remains
  EXPECT_NEAR(norm2.value, 1.25, 1e-15);
  EXPECT_NEAR(norm2.d1, 0.0, 1e-15);
  EXPECT_NEAR(norm2.d2, 0.0, 1e-14);
  EXPECT_NEAR(norm2.d3, 0.0, 1e-14);
}

}  // namespace
}  // namespace sparflow
