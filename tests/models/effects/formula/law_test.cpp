/// Laws of user effects: values against the same formula in C++, derivatives against finite differences and against
/// each other, units, linearity, and messages for wrong laws.
#include "models/effects/formula/law.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "models/math/jet.h"
#include "tests/models/numeric.h"

namespace sparflow {
namespace {

using test_support::kDerivativeTolerance;

std::vector<Symbol> numbers(const std::vector<std::string>& names) {
  std::vector<Symbol> symbols;
  for (const std::string& name : names) symbols.push_back({name, {}, true});
  return symbols;
}

Symbol symbol(const std::string& name, const std::string& unit) {
  return {name, parse_unit(unit), true};
}

/// The names of a friction law and of some more units.
std::vector<Symbol> signals() {
  return {symbol("v", "m/s"), symbol("x", "m"),      symbol("F", "N"), symbol("Q", "m^3/s"),
          symbol("pA", "Pa"), symbol("oil", "degC"), symbol("u", "1"), {"q.*", {}, false}};
}
std::vector<Symbol> parameters() {
  return {symbol("Fc", "kN"),       symbol("B", "N s/m"),
          symbol("v0", "mm/s"),     symbol("k", "bar/(l/min)^2"),
          symbol("beta", "1/degC"), symbol("T0", "degC"),
          symbol("mu", "1")};
}

double value(const std::string& law) { return Law::compile(law, {}, {}).evaluate<double>({}, {}); }

TEST(Law, ArithmeticIsThatOfMathematics) {
  EXPECT_EQ(value("1 + 2 * 3"), 7.0);
  EXPECT_EQ(value("(1 + 2) * 3"), 9.0);
  EXPECT_EQ(value("10 - 4 - 3"), 3.0);
  EXPECT_EQ(value("24 / 4 / 3"), 2.0);
  EXPECT_EQ(value("2 ^ 3 ^ 2"), 512.0);
  EXPECT_EQ(value("-2 ^ 2"), -4.0);
  EXPECT_EQ(value("(-2) ^ 2"), 4.0);
  EXPECT_EQ(value("2 ^ -1"), 0.5);
  EXPECT_EQ(value("--3 - -2"), 5.0);
  EXPECT_EQ(value("+3 * -2"), -6.0);
  EXPECT_EQ(value("1e-3 + .5 + 2."), 2.501);
  EXPECT_EQ(value("\n 1\t+ 2 \n"), 3.0);
  EXPECT_EQ(value("max(1, 3, 2) + min(4, 2)"), 5.0);
  EXPECT_EQ(value("step(2 > 1) + step(1 >= 1) + step(1 < 1) + step(1 <= 1) + step(-1)"), 3.0);
  EXPECT_EQ(value("sign(-3) + sign(0) + abs(-2) + square(3) + positive(-1) + positive(4)"), 14.0);
  EXPECT_DOUBLE_EQ(value("sqrt(2) * exp(1) * log(3) * tanh(0.4) * sin(1) * cos(1)"),
                   std::sqrt(2.0) * std::exp(1.0) * std::log(3.0) * std::tanh(0.4) * std::sin(1.0) *
                       std::cos(1.0));
}

TEST(Law, NumbersWithUnitsAreSi) {
  EXPECT_DOUBLE_EQ(value("20[bar]"), 2e6);
  EXPECT_DOUBLE_EQ(value("30[l/min] + 1[m^3/s]"), 1.0005);
  EXPECT_DOUBLE_EQ(value("sin(30[deg])"), 0.5);
  EXPECT_DOUBLE_EQ(value("5[%] * 4 [kN]"), 200.0);
  EXPECT_DOUBLE_EQ(value("(20[degC] - -10[degC]) * 1[W/K]"), 30.0);
}

// One formula, written as a law and in C++, over x, y (signals) and a, b (parameters).
struct Twin {
  std::string law;
  std::function<double(double, double, double, double)> plain;
};

const std::vector<Twin>& twins() {
  static const std::vector<Twin> all = {
#define SPARFLOW_TWIN(law, formula)                                                         \
  {                                                                                         \
    law,                                                                                    \
        []([[maybe_unused]] double x, [[maybe_unused]] double y, [[maybe_unused]] double a, \
           [[maybe_unused]] double b) -> double { return formula; }                         \
  }
      SPARFLOW_TWIN("x + y", x + y),
      SPARFLOW_TWIN("a - x * b", a - x * b),
      SPARFLOW_TWIN("a * tanh(x / b) + y", a * std::tanh(x / b) + y),
      SPARFLOW_TWIN("a * abs(x) * x - -y", a * std::abs(x) * x + y),
      SPARFLOW_TWIN("a * exp(-b * (x - y))", a * std::exp(-b * (x - y))),
      SPARFLOW_TWIN("log(x^2 + a) / sqrt(y * b)", std::log(x * x + a) / std::sqrt(y * b)),
      SPARFLOW_TWIN("sin(a * x) * cos(b * y)", std::sin(a * x) * std::cos(b * y)),
      SPARFLOW_TWIN("square(x - a) / (y + b)^3", (x - a) * (x - a) / std::pow(y + b, 3)),
      SPARFLOW_TWIN("max(x, y * a) + min(b * x, y, a)",
                    std::max(x, y * a) + std::min(b * x, std::min(y, a))),
      SPARFLOW_TWIN("positive(x - a) * y + positive(a - x) * b",
                    std::max(0.0, x - a) * y + std::max(0.0, a - x) * b),
      SPARFLOW_TWIN("step(x > a) * x * y + step(x <= a) * b * y^2", (x > a ? x * y : b * y * y)),
      SPARFLOW_TWIN("step(x - a) * y + step(y < b) * x + step(x >= b) * y * a",
                    (x > a ? y : 0.0) + (y < b ? x : 0.0) + (x >= b ? y * a : 0.0)),
      SPARFLOW_TWIN("sign(x - a) * b * y^2", (x > a ? 1.0 : -1.0) * b * y * y),
      SPARFLOW_TWIN("x^1.5 * y^-2 * a^0.5", std::pow(x, 1.5) / (y * y) * std::sqrt(a)),
      SPARFLOW_TWIN("x^a + a^y", std::pow(x, a) + std::pow(a, y)),
      SPARFLOW_TWIN("(x + y)^0 * a + (x * b)^1", a + x * b),
#undef SPARFLOW_TWIN
  };
  return all;
}

const std::vector<std::vector<double>>& points() {  // x, y, a, b: away from the kinks
  static const std::vector<std::vector<double>> all = {{0.7, 1.3, 0.9, 0.4}, {1.9, 0.6, 1.1, 0.8}};
  return all;
}

Law compiled(const Twin& twin) {
  return Law::compile(twin.law, numbers({"x", "y"}), numbers({"a", "b"}));
}
/// The same law with a and b as signals too, for derivatives by them.
Law of_signals(const Twin& twin) {
  return Law::compile(twin.law, numbers({"x", "y", "a", "b"}), {});
}

/// Values of x, y, a, b in the order in which the law names its signals.
template <class T>
std::vector<T> in_order(const Law& law, const std::vector<T>& values) {
  std::vector<T> ordered;
  for (const std::string& name : law.signals()) {
    ordered.push_back(values[std::string("xyab").find(name)]);
  }
  return ordered;
}

/// The law's value with derivatives by all four.
Jet with_derivatives(const Twin& twin, const std::vector<double>& p) {
  std::vector<Jet> values;
  for (int i = 0; i < 4; ++i) {
    values.push_back(Jet::variable(p[static_cast<std::size_t>(i)], i, 4));
  }
  const Law law = of_signals(twin);
  return law.evaluate<Jet>(in_order(law, values), {});
}

TEST(Law, ValuesAreThoseOfTheSameFormulaInCpp) {
  for (const Twin& twin : twins()) {
    SCOPED_TRACE(twin.law);
    const Law law = compiled(twin);
    for (const auto& p : points()) {
      const std::vector<double> ab = {p[2], p[3]};
      const double found = law.evaluate<double>(in_order(law, p), ab);
      // the same operations, up to their order
      EXPECT_NEAR(found, twin.plain(p[0], p[1], p[2], p[3]), 1e-14 * (1.0 + std::abs(found)));
    }
  }
}

TEST(Law, DerivativesMatchFiniteDifferencesInEveryScalar) {
  for (const Twin& twin : twins()) {
    SCOPED_TRACE(twin.law);
    const Law law = compiled(twin);
    for (const auto& p : points()) {
      const Jet d = with_derivatives(twin, p);
      const std::vector<double> ab = {p[2], p[3]};
      const std::vector<Jet> xy = {Jet::variable(p[0], 0, 2), Jet::variable(p[1], 1, 2)};
      const Jet j = law.evaluate<Jet>(in_order(law, xy), ab);
      const Eigen::VectorXd at = Eigen::Map<const Eigen::VectorXd>(p.data(), 4);
      const auto f = [&](const Eigen::VectorXd& z) { return twin.plain(z[0], z[1], z[2], z[3]); };
      // Jets divide by multiplying with the reciprocal, which is one rounding more.
      EXPECT_NEAR(j.value, law.evaluate<double>(in_order(law, p), ab),
                  1e-14 * (1.0 + std::abs(j.value)));
      for (int i = 0; i < 4; ++i) {
        const double slope = test_support::numeric_partial(f, at, i);
        EXPECT_NEAR(d.gradient(i), slope, kDerivativeTolerance * (1.0 + std::abs(slope)));
        for (int k = 0; k < 4; ++k) {
          const double bend = test_support::numeric_partial(
              [&](const Eigen::VectorXd& z) { return test_support::numeric_partial(f, z, i); }, at,
              k);
          // two nested differences: rounding of the inner one, 1e-13, is divided by the outer step 1e-2 / 4
          EXPECT_NEAR(d.hessian(i, k), bend, 1e-8 * (1.0 + std::abs(bend)));
          if (i < 2 && k < 2) {
            EXPECT_NEAR(j.hessian(i, k), d.hessian(i, k), 1e-13 * (1.0 + std::abs(bend)));
          }
        }
        if (i < 2) {
          EXPECT_NEAR(j.gradient(i), d.gradient(i), 1e-13 * (1.0 + std::abs(slope)));
        }
      }
    }
  }
}

// UserEffect::columns takes derivatives by the proportional group from values of the law.
TEST(Law, DerivativeByAProportionalParameterIsTheLawWithItAtOneAndTheOthersAtZero) {
  int compared = 0;
  for (const Twin& twin : twins()) {
    SCOPED_TRACE(twin.law);
    const Law law = compiled(twin);
    const std::vector<std::string> group = law.proportional_parameters();
    for (const auto& p : points()) {
      const Jet d = with_derivatives(twin, p);
      for (const std::string& name : group) {
        std::vector<double> ab = {p[2], p[3]};
        for (const std::string& other : group) ab[other == "a" ? 0 : 1] = other == name ? 1.0 : 0.0;
        const double slope = law.evaluate<double>(in_order(law, p), ab);
        // the same products in another order
        EXPECT_NEAR(slope, d.gradient(name == "a" ? 2 : 3), 1e-13 * (1.0 + std::abs(slope)));
        ++compared;
      }
    }
  }
  EXPECT_GE(compared, 10);
}

TEST(Law, AtAKinkTheDerivativeIsThatOfABranchAndFinite) {
  struct Kink {
    std::string law;
    double slope;
  };
  const std::vector<Kink> all = {
      {"abs(x)", 1.0},    {"sign(x)", 0.0},   {"step(x)", 0.0},    {"positive(x)", 0.0},
      {"max(x, 0)", 1.0}, {"min(0, x)", 0.0}, {"sqrt(x)", 0.0},    {"sign(x) * sqrt(abs(x))", 0.0},
      {"x^1.5", 0.0},     {"x^2", 0.0},       {"abs(x) * x", 0.0}, {"sqrt(positive(x))", 0.0},
      {"x^1", 1.0},       {"tanh(x)", 1.0}};
  for (const Kink& kink : all) {
    SCOPED_TRACE(kink.law);
    const Law law = Law::compile(kink.law, numbers({"x"}), {});
    const std::vector<Jet> x = {Jet::variable(0.0, 0, 1)};
    const Jet y = law.evaluate<Jet>(x, {});
    EXPECT_EQ(y.value, 0.0);
    EXPECT_EQ(y.gradient(0), kink.slope);
    EXPECT_TRUE(std::isfinite(y.hessian(0, 0)));
  }
}

TEST(Law, OutsideItsDomainALawIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const char* text : {"sqrt(x)", "log(x)", "x^0.5", "sqrt(x) + max(1, sqrt(x))"}) {
    const Law law = Law::compile(text, numbers({"x"}), {});
    EXPECT_TRUE(std::isnan(law.evaluate<double>(std::vector<double>{-1.0}, {}))) << text;
  }
  for (const char* text : {"x", "sign(x)", "step(x)", "positive(x)", "abs(x)", "tanh(x)"}) {
    const Law law = Law::compile(text, numbers({"x"}), {});
    EXPECT_TRUE(std::isnan(law.evaluate<double>(std::vector<double>{nan}, {})))
        << text << ": a missing sample stays missing";
  }
}

TEST(Law, SignalsComeInTheOrderOfTheLawAndOnce) {
  const Law law = Law::compile("B * v + Fc * sign(v) * (x / 1[m]) + mu * F * q.boom * q.'jib-2'",
                               signals(), parameters());
  EXPECT_EQ(law.signals(), (std::vector<std::string>{"v", "x", "F", "q.boom", "q.jib-2"}));
  EXPECT_EQ(law.parameters().size(), parameters().size());
  EXPECT_TRUE(law.uses_parameter("mu"));
  EXPECT_FALSE(law.uses_parameter("k"));
}

TEST(Law, UnitsOfALawFollowFromItsParts) {
  const std::vector<std::pair<std::string, std::string>> all = {
      {"Fc * sign(v) + B * v", "N"},
      {"Fc * tanh(v / v0)", "N"},
      {"k * Q^2", "Pa"},
      {"k * square(Q) * exp(-beta * (oil - T0))", "Pa"},
      {"k * Q^2 * (1 + beta * (oil - 40[degC]))", "Pa"},
      {"Q * sqrt(pA / 10[bar])", "m^3/s"},
      {"Q / sqrt(pA)", "m^4/(N^0.5 s)"},
      {"max(0, F - 2[kN], Fc)", "N"},
      {"0 + F - 0", "N"},
      {"mu * abs(F) * step(v > 0) * step(oil > 20[degC]) * step(0.1[m/s] > v)", "N"},
      {"max(oil, 20[degC]) - 5[K] - T0", "K"},
      {"(5[K] + oil) - T0", "K"},
      {"q.boom + oil - T0", "K"},
      {"(F / Fc)^2.5 * x^0.5", "m^0.5"},
      {"2^(F / Fc)", "1"},
      {"sin(30[deg]) * u", "1"},
  };
  for (const auto& [text, unit] : all) {
    SCOPED_TRACE(text);
    const Law law = Law::compile(text, signals(), parameters());
    EXPECT_EQ(law.dimension(), parse_unit(unit).dimension) << law.dimension().text();
    EXPECT_TRUE(law.dimension_known());
  }
  // Units of a joint that may be revolute or prismatic are not checked; the rest of the law is.
  EXPECT_FALSE(Law::compile("Fc * q.boom", signals(), parameters()).dimension_known());
  EXPECT_TRUE(Law::compile("Fc * sin(q.boom)", signals(), parameters()).dimension_known());
  EXPECT_TRUE(Law::compile("Fc * step(q.boom > x)", signals(), parameters()).dimension_known());
  EXPECT_THROW(Law::compile("q.boom * (F + v)", signals(), parameters()), TextError);
}

struct Linearity {
  std::string law;
  std::vector<std::string> proportional;
};

TEST(Law, ProportionalParametersAreFound) {
  const std::vector<Linearity> all = {
      {"a * x + b * y", {"a", "b"}},
      {"a * tanh(x / b)", {"a"}},
      {"a * b * x", {"a"}},
      {"b * (x - a)", {"b"}},
      {"a + b * exp(x)", {"a", "b"}},
      {"a * x + 1", {}},
      {"max(0, x - a)", {}},
      {"b * max(0, x - a)", {"b"}},
      {"a / x - b / 2", {"a", "b"}},
      {"x / a", {}},
      {"-a^1 * x + b^2", {}},
      {"a * x * step(y > b)", {"a"}},
      {"abs(a) * x", {}},
      {"(a * x + b) * y - (a - b)", {"a", "b"}},
      {"a * (b * x + y)", {"a"}},
      {"a * a * x", {}},
  };
  for (const Linearity& l : all) {
    SCOPED_TRACE(l.law);
    const Law law = Law::compile(l.law, numbers({"x", "y"}), numbers({"a", "b"}));
    EXPECT_EQ(law.proportional_parameters(), l.proportional);
  }
}

// The symbolic result holds in numbers: the law is the sum of p dlaw/dp over the proportional group.
TEST(Law, ProportionalParametersAreProportionalNumerically) {
  int proportional = 0;
  for (const Twin& twin : twins()) {
    SCOPED_TRACE(twin.law);
    const std::vector<std::string> group = compiled(twin).proportional_parameters();
    for (const auto& p : points()) {
      const Jet d = with_derivatives(twin, p);
      double sum = 0.0;
      for (const std::string& name : group) {
        const std::size_t i = name == "a" ? 2 : 3;
        sum += p[i] * d.gradient(static_cast<int>(i));
        EXPECT_NEAR(d.hessian(static_cast<int>(i), static_cast<int>(i)), 0.0, 1e-14);
      }
      if (!group.empty()) {
        ++proportional;
        EXPECT_NEAR(sum, d.value, 1e-14 * (1.0 + std::abs(sum)));
      }
    }
  }
  EXPECT_GT(proportional, 0);
}

struct Wrong {
  std::string law;
  int column;
  std::string message;  ///< the whole message, or its beginning when it ends in "..."
};

TEST(Law, WrongLawsAreExplained) {
  const std::vector<Wrong> all = {
      {"", 1, "the law is empty; expected a formula such as Fc * sign(v)"},
      {"Fc *", 5, "the law ends where a number, a name or ( should follow"},
      {"Fc * (1 + mu", 6, "this ( is never closed"},
      {"Fc * tanh(v / v0", 10, "this ( is never closed"},
      {"Fc)", 3, "this ) has no ( before it"},
      {"Fc sign(v)", 4,
       "expected an operator before \"sign\"; a product is written *, a number's unit in brackets, "
       "20[bar]"},
      {"20 bar", 4, "expected an operator before \"bar\"; ..."},
      {"Fc * v**2", 7, "a power is written ^, as in v^2"},
      {"Fc * 0,5", 7, "write a decimal point, not a comma"},
      {"Fc * tanh(0,5)", 12,
       "tanh() takes one value; if the comma is a decimal one, write a point"},
      {"Fc * max(1)", 6, "max() takes two values or more, as in max(0, x)"},
      {"Fc * sign()", 10, "sign() has nothing between its parentheses"},
      {"Fc * sign", 6, "sign is a function; write sign(...)"},
      {"Fc * sgn(v)", 6, "unknown function \"sgn\"; did you mean \"sign\"?"},
      {"Fc * pow(u, 2)", 6, "unknown function \"pow\"; did you mean \"x^2\"?"},
      {"Fc * tan(u)", 6, "unknown function \"tan\"; did you mean \"tanh\"?"},
      {"Fc * arctangent(u)", 6, "unknown function \"arctangent\"; known: abs, sign, max, ..."},
      {"Fc * v(1 + u)", 6, "v is no function; write v * (...)"},
      {"Fx * u", 1, "unknown name \"Fx\"; did you mean \"Fc\"?"},
      {"Fc * pi", 6, "unknown name \"pi\"; write 3.14159265"},
      {"Fc * w", 6, "unknown name \"w\"; known here: Fc, B, v0, k, beta, T0, mu, v, x, F, ..."},
      {"v * w", 5,
       "unknown name \"w\"; known here: Fc, B, v0, k, beta, T0, mu, v, x, F, Q, pA, oil, u, q.*"},
      {"Fc = 3", 4, "a formula has no =; write only what stands on its right"},
      {"Fc * (v > 0)", 9, "a comparison stands only inside step(), as in step(v > 0)"},
      {"step(0 < u < 1)", 12,
       "one comparison at a time; multiply two steps, as in step(a > b) * step(b > c)"},
      {"Fc − F", 4, "write the minus sign of the keyboard, -"},
      {"Fc·u", 3, "write *"},
      {"Fc * u²", 7, "write ^2"},
      {"Fc * µ", 6, "\"µ\" means nothing in a formula; it is written with ..."},
      {"Fc & u", 4, "\"&\" means nothing in a formula; ..."},
      {"Fc + v", 4, "adds \"v\" [m/s] to \"Fc\" [N]; both must have the same unit"},
      {"Fc * sign(v) - B * x", 14,
       "subtracts \"B * x\" [N s] from \"Fc * sign(v)\" [N]; both must have the same unit"},
      {"F - 300", 3,
       "subtracts \"300\" (no unit) from \"F\" [N]; both must have the same unit: write 300[N]"},
      {"Fc * tanh(v)", 11,
       "tanh() needs a number without unit, \"v\" has [m/s]; divide it by a parameter or a number "
       "of that unit"},
      {"Fc * exp(-beta * x)", 10,
       "exp() needs a number without unit, \"-beta * x\" has [m/K]; ..."},
      {"max(0, F, v)", 1,
       "max() compares \"0, F\" [N] with \"v\" [m/s]; both must have the same unit"},
      {"Fc * step(v > 0.01)", 13,
       "compares \"v\" [m/s] with \"0.01\" (no unit); both must have the same unit: write "
       "0.01[m/s]"},
      {"F^u", 2, "\"F\" has the unit [N], so its exponent must be a number, not \"u\""},
      {"2^x", 3, "an exponent needs a number without unit, \"x\" has [m]; ..."},
      {"F^0.3", 2, "[N] to the power 0.3 has no exponents that are whole or half"},
      {"sqrt(sqrt(x))", 1, "[m^0.5] to the power 0.5 has no exponents that are whole or half"},
      {"square(square(square(square(square(square(square(square(square(square(x))))))))))", 8,
       "[m^256] to the power 2 has exponents beyond 500"},
      {"beta * oil", 8,
       "\"oil\" is a reading on the Celsius scale and is multiplied; take a difference first, as "
       "in (oil - 20[degC]), and give differences in K"},
      {"oil + T0", 7, "\"T0\" is a reading on the Celsius scale and is added to another; ..."},
      {"exp(oil)", 5, "\"oil\" is a reading on the Celsius scale and stands in exp(); ..."},
      {"-oil - T0", 2, "\"oil\" is a reading on the Celsius scale and is negated; ..."},
      {"oil - 20", 5,
       "subtracts \"20\" (no unit) from \"oil\" [degC]; both must have the same unit: write 20[K]"},
      {"step(oil > 0)", 10,
       "compares \"oil\" [degC] with \"0\" (no unit); both must have the same unit: write 0[degC]"},
      {"T0", 1, "\"T0\" is a reading on the Celsius scale and is the whole law; ..."},
      {"Fc * v[m/s]", 7, "a unit in brackets follows a number only; v comes in [m/s]"},
      {"Fc * u[1]", 7, "a unit in brackets follows a number only; u is a pure number"},
      {"Fc * (2 * u)[m]", 13, "a unit in brackets follows a number directly, as in 20[bar]"},
      {"F + 2[KN]", 7, "unknown unit \"KN\"; did you mean \"kN\"?"},
      {"F + 2[N s/sec]", 11, "unknown unit \"sec\"; did you mean \"s\"?"},
      {"F + 2[N", 6, "this [ is never closed"},
      {"F / 0 * 2 + 1 / 0", 15, "this is not a finite number (a division by zero?)"},
      {"1e999 * F", 1, "the number 1e999 is beyond what a computer can hold, 1e-307 to 1e308"},
      {"F * q.'boom", 7, "this quote is never closed"},
      {std::string(100, '(') + "F" + std::string(100, ')'), 101,
       "the law is nested more than 100 deep; split it"},
  };
  for (const Wrong& wrong : all) {
    SCOPED_TRACE(wrong.law);
    try {
      Law::compile(wrong.law, signals(), parameters());
      ADD_FAILURE() << "was compiled";
    } catch (const TextError& error) {
      EXPECT_EQ(error.column, wrong.column) << error.what();
      if (wrong.message.ends_with("...")) {
        EXPECT_THAT(error.what(),
                    ::testing::StartsWith(wrong.message.substr(0, wrong.message.size() - 3)));
      } else {
        EXPECT_EQ(std::string(error.what()), wrong.message);
      }
    }
  }
}

TEST(Law, ManyTermsAndDeepOnesAreEvaluated) {
  std::string wide = "F", right = "F";
  for (int i = 0; i < 300; ++i) wide += " + F";
  for (int i = 0; i < 90; ++i) right = "F + (" + right + ")";
  const std::vector<double> one = {1.0};
  EXPECT_EQ(Law::compile(wide, signals(), {}).evaluate<double>(one, {}), 301.0);
  EXPECT_EQ(Law::compile(right, signals(), {}).evaluate<double>(one, {}), 91.0);
}

TEST(Law, HasAtMostTenParameters) {
  std::vector<std::string> many;
  for (int i = 0; i < 11; ++i) many.push_back("p" + std::to_string(i));
  EXPECT_THROW(Law::compile("p0", {}, numbers(many)), TextError);
  many.pop_back();
  EXPECT_NO_THROW(Law::compile("p0", {}, numbers(many)));
}

// Any string gives an expression or a TextError: never a crash, never another exception.
TEST(Law, AnyTextIsCompiledOrExplained) {
  const std::vector<std::string> words = {
      "F",    "v",     "Fc",    "oil", "2", "0",  "(",   ")",        "+", "-",
      "*",    "/",     "^",     ",",   "<", ">=", "[N]", "[",        "]", "sign(",
      "max(", "step(", "tanh(", "q.",  "'", ".",  " ",   "\xc2\xb2", "1e"};
  test_support::Random random(11);
  int compiled_count = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string law;
    for (int n = random.integer(1, 9); n > 0; --n) {
      law += words[static_cast<std::size_t>(random.integer(0, static_cast<int>(words.size()) - 1))];
    }
    try {
      const Law e = Law::compile(law, signals(), parameters());
      const std::vector<double> s(e.signals().size(), 0.5), p(e.parameters().size(), 0.3);
      const std::vector<Jet> jets(s.begin(), s.end());
      const double a = e.evaluate<double>(s, p), b = e.evaluate<Jet>(jets, p).value;
      // a quotient of jets is a product with the reciprocal, whose rounding repeated powers enlarge
      EXPECT_TRUE(a == b || std::abs(a - b) < 1e-9 * std::abs(a) ||
                  (!std::isfinite(a) && !std::isfinite(b)))
          << law << " " << a << " " << b;
      ++compiled_count;
    } catch (const TextError& error) {
      EXPECT_GE(error.column, 1) << law;
      EXPECT_NE(std::string(error.what()), "") << law;
    }
  }
  EXPECT_GT(compiled_count, 500);  // enough random texts are valid laws
}

}  // namespace
}  // namespace sparflow
