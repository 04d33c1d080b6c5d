/// The grammar of formulas against damaged, long and deep texts; limits; numbers beyond a computer's.
#include "models/expression/expression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "models/math/error.h"
#include "tests/models/numeric.h"

namespace sparflow {
namespace {

/// One name, x.
Expression::Grammar only_x() {
  return {"formula",
          [](const std::string& text, std::size_t& at) -> std::optional<ExpressionNode> {
            if (text[at] != 'x') return std::nullopt;
            ++at;
            return ExpressionNode{.op = ExpressionNode::Op::kName};
          },
          true};
}

double evaluated(const std::string& text, double x = 0.0) {
  const std::vector<double> variables = {x};
  return Expression::parse(text, only_x()).evaluate<double>({}, variables);
}

/// "column: message", or "" when the text is read.
std::string refusal(const std::string& text) {
  try {
    Expression::parse(text, only_x());
  } catch (const TextError& error) {
    return std::to_string(error.column) + ": " + error.what();
  }
  return "";
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST(Expression, NestingIsLimitedBeforeTheStackIs) {
  Expression::Grammar grammar = only_x();
  grammar.options.longest = 2000000;  // the limit of the length alone would refuse these texts
  for (const char* opening : {"(", "-", "x^", "abs(", "max(0,", "step(", "x-(", "x*(", "(-(+"}) {
    SCOPED_TRACE(opening);
    try {
      Expression::parse(repeated(opening, 100000), grammar);
      ADD_FAILURE() << "was read";
    } catch (const TextError& error) {
      EXPECT_STREQ(error.what(), "the formula is nested more than 100 deep; split it");
    }
  }
  EXPECT_EQ(evaluated(repeated("(", 99) + "x" + repeated(")", 99), 2.0), 2.0);
  EXPECT_EQ(refusal(repeated("(", 100) + "x" + repeated(")", 100)),
            "101: the formula is nested more than 100 deep; split it");
}

TEST(Expression, LengthIsLimited) {
  EXPECT_EQ(evaluated("x" + repeated("+x", 4999), 1.0), 5000.0);
  EXPECT_EQ(refusal("x" + repeated("+x", 5000)),
            "10001: the formula is longer than 10000 characters; split it or shorten it");
}

TEST(Expression, NumbersBeyondAComputersAreRefused) {
  const std::string beyond = " is beyond what a computer can hold, 1e-307 to 1e308";
  EXPECT_EQ(refusal("x * 1e999"), "5: the number 1e999" + beyond);
  EXPECT_EQ(refusal("1e-999"), "1: the number 1e-999" + beyond);
  EXPECT_EQ(refusal(repeated("9", 400)), "1: the number " + repeated("9", 400) + beyond);
  EXPECT_EQ(refusal("x + 1e308[km]"),
            "5: 1e308[km] is beyond what a computer can hold in SI, 1e308");
  EXPECT_EQ(refusal("1[(km^12)^12]"),
            "3: this unit is beyond what a computer can hold, 1e-307 to 1e308 in SI");
  EXPECT_EQ(refusal("x + ."), "5: expected digits before or behind the point");
  EXPECT_EQ(evaluated("1e308"), 1e308);
}

TEST(Expression, AMissingValueStaysMissing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const char* text :
       {"x", "x * 0", "0 - x", "x / 2", "x ^ 2", "2 ^ x", "min(x, 1)", "min(1, x)", "max(x, 1)",
        "max(1, x)", "abs(x)", "sign(x)", "exp(x)", "sqrt(x)", "step(x)", "positive(x)"}) {
    EXPECT_TRUE(std::isnan(evaluated(text, nan))) << text;
  }
}

TEST(Expression, NodesKnowTheirPlaceInTheText) {
  const Expression e = Expression::parse("max( 1, (x + 2) ) * -3 [m]", only_x());
  std::vector<std::string> parts;
  for (const ExpressionNode& node : e.nodes()) parts.push_back(e.source(node));
  EXPECT_EQ(parts, (std::vector<std::string>{"1", "x", "2", "(x + 2)", "max( 1, (x + 2) )", "3 [m]",
                                             "-3 [m]", "max( 1, (x + 2) ) * -3 [m]"}));
}

// Any bytes give an expression that can be evaluated, or a TextError inside the text.
TEST(Expression, AnyBytesAreReadOrExplained) {
  const std::vector<std::string> pieces = {
      "x",        "1",  "0.5", "1e9",  "e",    "(",    ")",  "+",    "-",    "*",     "/",    "^",
      ",",        "<",  ">=",  "=",    "[m]",  "[",    "]",  "sin(", "max(", "step(", "`",    " ",
      "\xc2\xb2", "\n", "\0",  "\xff", "\xe2", "tan(", "..", "''",   "2[(",  "%",     "1e999"};
  test_support::Random random(5);
  int read = 0, refused = 0;
  for (int i = 0; i < 30000; ++i) {
    std::string text;
    for (int n = random.integer(1, 8); n > 0; --n) {
      text += random.integer(0, 9) == 0 ? std::string(1, static_cast<char>(random.integer(0, 255)))
                                        : pieces[static_cast<std::size_t>(random.integer(
                                              0, static_cast<int>(pieces.size()) - 1))];
    }
    try {
      evaluated(text, 0.3);
      ++read;
    } catch (const TextError& error) {
      ++refused;
      EXPECT_GE(error.column, 1) << text;
      EXPECT_LE(error.column, static_cast<int>(text.size()) + 1) << text;
      EXPECT_NE(std::string(error.what()), "") << text;
    }
  }
  EXPECT_GT(read, 300);  // enough random texts are formulas
  EXPECT_GT(refused, 10000);
}

}  // namespace
}  // namespace sparflow
