/// TaylorSeries against numeric derivatives, function by function.
#include "models/math/taylor.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/models/numeric.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;
using test_support::numeric_derivative;

using Series = TaylorSeries<3>;

struct Unary {
  std::string name;
  std::function<double(double)> plain;
  std::function<Series(const Series&)> taylor;
};

#define SPARFLOW_UNARY(expression)                                                                     \
  Unary {                                                                                              \
#expression, [](double x) -> double { using std::cos, std::sin, std::sqrt; return (expression); },   \
        [](const Series& x) -> Series { return (expression); } \
  }

TEST(TaylorSeries, MatchesNumericDerivativesOfEveryFunction) {
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
      const Series t = f.taylor(Series::variable(x));
      EXPECT_DOUBLE_EQ(t.value(), f.plain(x));
      const auto at = [&](double v) { return f.taylor(Series::variable(v)); };
      // each derivative against differences of the one below; the lowest against the plain function
      EXPECT_NEAR(t.derivative(1), numeric_derivative(f.plain, x),
                  kDerivativeTolerance * (1 + std::abs(t.derivative(1))));
      EXPECT_NEAR(t.derivative(2),
                  numeric_derivative([&](double v) { return at(v).derivative(1); }, x),
                  kDerivativeTolerance * (1 + std::abs(t.derivative(2))));
      EXPECT_NEAR(t.derivative(3),
                  numeric_derivative([&](double v) { return at(v).derivative(2); }, x),
                  kDerivativeTolerance * (1 + std::abs(t.derivative(3))));
    }
  }
}

TEST(TaylorSeries, CompoundAssignmentIsTheBinaryOperation) {
  const Series x = Series::variable(0.7), y = sin(x);
  const auto expect_equal = [](const Series& a, const Series& b) {
    EXPECT_EQ(a.coefficient, b.coefficient);
  };
  Series a = x;
  expect_equal(a += y, x + y);
  a = x;
  expect_equal(a -= y, x - y);
  a = x;
  expect_equal(a *= y, x * y);
  a = x;
  expect_equal(a /= y, x / y);
}

TEST(TaylorSeries, WorksInsideEigen) {
  const Series x = Series::variable(0.4);
  const Vector3<Series> circle(cos(x), sin(x), Series(0.5));
  const Series norm2 = circle.dot(circle);
  // cos^2 + sin^2 is constant: only rounding of terms of size one remains
  EXPECT_NEAR(norm2.value(), 1.25, 1e-15);
  EXPECT_NEAR(norm2.derivative(1), 0.0, 1e-15);
  EXPECT_NEAR(norm2.derivative(2), 0.0, 1e-14);
  EXPECT_NEAR(norm2.derivative(3), 0.0, 1e-14);
}

TEST(TaylorSeries, FromDerivativesIsTheInverseOfDerivative) {
  const TaylorSeries<4> t = TaylorSeries<4>::from_derivatives({1.5, -2.0, 3.0, 5.0, -7.0});
  const std::vector<double> expected = {1.5, -2.0, 3.0, 5.0, -7.0};
  // one division and one multiplication by the same factorial
  for (int k = 0; k <= 4; ++k) EXPECT_DOUBLE_EQ(t.derivative(k), expected[std::size_t(k)]);
  const Taylor3 plain = Series::from_derivatives({1.5, -2.0, 3.0, 5.0});
  EXPECT_DOUBLE_EQ(plain.value, 1.5);
  EXPECT_DOUBLE_EQ(plain.d1, -2.0);
  EXPECT_DOUBLE_EQ(plain.d2, 3.0);
  EXPECT_DOUBLE_EQ(plain.d3, 5.0);
}

}  // namespace
}  // namespace sparflow
