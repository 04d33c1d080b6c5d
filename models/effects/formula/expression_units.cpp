// Rules for units in a law, and the operations that are appended to the tape.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/effects/formula/expression_parser.h"

namespace sparflow {

ExpressionParser::Operand ExpressionParser::added(const Operand& left, const Operand& right,
                                                  std::size_t at) {
  const bool minus = law_[at] == '-';
  Operand result{-1, left.begin, right.end, left.dimension, left.kind};
  const bool reading_left = left.kind == Kind::kReading,
             reading_right = right.kind == Kind::kReading;
  const auto kelvin = [](const Operand& x) {
    return x.kind == Kind::kUnknown ||
           (x.kind == Kind::kQuantity && x.dimension == dimensions::kTemperature);
  };
  if (reading_left && reading_right) {
    if (!minus) fail_reading(right, "is added to another");
    result.kind = Kind::kQuantity;
  } else if (reading_left && kelvin(right)) {
    // A reading plus or minus a difference in K is a reading.
  } else if (reading_right && kelvin(left)) {
    if (minus) fail_reading(right, "is subtracted from what is none");
    result.kind = Kind::kReading;
  } else if (left.kind == Kind::kUnknown || left.kind == Kind::kZero) {
    result.dimension = right.dimension;
    result.kind = right.kind == Kind::kZero ? left.kind : right.kind;
  } else if (right.kind == Kind::kQuantity || reading_right) {
    if (reading_left || reading_right || left.dimension != right.dimension) {
      const bool bare = is_number(right.node) && right.dimension.none();
      fail(at, fmt::format("{} \"{}\" {} {} \"{}\" {}; both must have the same unit{}",
                           minus ? "subtracts" : "adds", source(right), shown(right),
                           minus ? "from" : "to", source(left), shown(left),
                           bare ? fmt::format(": write {}{}", source(right),
                                              reading_left ? "[K]" : shown(left))
                                : ""));
    }
  }
  if (reading_left && right.kind == Kind::kZero) fail_reading(left, "meets a 0 without a unit");
  if (reading_right && left.kind == Kind::kZero) fail_reading(right, "meets a 0 without a unit");
  result.node = emit({minus ? Op::kSubtract : Op::kAdd, left.node, right.node, 0.0}, at);
  return result;
}

ExpressionParser::Operand ExpressionParser::multiplied(const Operand& left, const Operand& right,
                                                       std::size_t at) {
  const bool divided = law_[at] == '/';
  if (left.kind == Kind::kReading) fail_reading(left, divided ? "is divided" : "is multiplied");
  if (right.kind == Kind::kReading) fail_reading(right, divided ? "divides" : "is multiplied");
  Operand result{-1, left.begin, right.end,
                 divided ? left.dimension / right.dimension : left.dimension * right.dimension,
                 Kind::kQuantity};
  if (left.kind == Kind::kUnknown || right.kind == Kind::kUnknown) result.kind = Kind::kUnknown;
  result.node = emit({divided ? Op::kDivide : Op::kMultiply, left.node, right.node, 0.0}, at);
  return result;
}

ExpressionParser::Operand ExpressionParser::raised(const Operand& base, const Operand& exponent,
                                                   std::size_t at) {
  if (base.kind == Kind::kReading) fail_reading(base, "is raised to a power");
  wants_none(exponent, "an exponent");
  Operand result{-1, base.begin, exponent.end, base.dimension, base.kind};
  if (result.kind == Kind::kZero) result.kind = Kind::kQuantity;
  if (is_number(exponent.node)) {
    const double value = result_.tape_.back().value;
    result_.tape_.pop_back();
    try {
      result.dimension = base.dimension.power(value);
    } catch (const TextError& error) {
      fail(at, error.what());
    }
    result.node = emit({Op::kPower, base.node, -1, value}, at);
    return result;
  }
  if (result.kind == Kind::kQuantity && !base.dimension.none()) {
    fail(at, fmt::format("\"{}\" has the unit {}, so its exponent must be a number, not \"{}\"",
                         source(base), shown(base), source(exponent)));
  }
  result.node = emit({Op::kVariablePower, base.node, exponent.node, 0.0}, at);
  return result;
}

ExpressionParser::Operand ExpressionParser::applied(const Function& function, Operand x,
                                                    std::size_t at) {
  const std::string who = std::string(function.name) + "()";
  if (x.kind == Kind::kReading) fail_reading(x, "stands in " + who);
  switch (function.rule) {
    case Rule::kKeepsUnit:
    case Rule::kSameUnit:
      break;
    case Rule::kWantsNone:
      wants_none(x, who);
      x.dimension = dimensions::kNone;
      x.kind = Kind::kQuantity;
      break;
    case Rule::kForgetsUnit:
      x.dimension = dimensions::kNone;
      x.kind = Kind::kQuantity;
      break;
    case Rule::kSquaresUnit:
      x.dimension = x.dimension.power(2.0);
      break;
    case Rule::kHalvesUnit:
      try {
        x.dimension = x.dimension.power(0.5);
      } catch (const TextError&) {
        fail(at, fmt::format("the root of \"{}\" {} has no whole or half exponents", source(x),
                             shown(x)));
      }
      break;
  }
  x.node = emit({function.op, x.node, -1, function.value}, at);
  return x;
}

ExpressionParser::Operand ExpressionParser::same_unit(const Operand& a, const Operand& b,
                                                      std::size_t at,
                                                      const std::string& verb) const {
  Operand result{-1, a.begin, b.end, a.dimension, a.kind};
  const auto adapts = [](const Operand& x) {
    return x.kind == Kind::kUnknown || x.kind == Kind::kZero;
  };
  const bool zero_reading = (a.kind == Kind::kZero && b.kind == Kind::kReading) ||
                            (b.kind == Kind::kZero && a.kind == Kind::kReading);
  if (!zero_reading && (adapts(a) || adapts(b))) {
    if (!adapts(b) || (b.kind == Kind::kUnknown && a.kind == Kind::kZero)) {
      result.dimension = b.dimension;
      result.kind = b.kind;
    }
    return result;
  }
  if (zero_reading || a.kind != b.kind || a.dimension != b.dimension) {
    std::string remedy;
    if (is_number(b.node) && b.dimension.none()) {
      remedy = fmt::format(": write {}{}", source(b), shown(a));
    }
    fail(at, fmt::format("{} \"{}\" {} with \"{}\" {}; both must have the same unit{}", verb,
                         source(a), shown(a), source(b), shown(b), remedy));
  }
  return result;
}

void ExpressionParser::wants_none(const Operand& x, const std::string& who) const {
  if (x.kind == Kind::kReading) fail_reading(x, "stands in " + who);
  if (x.kind == Kind::kUnknown || x.kind == Kind::kZero || x.dimension.none()) return;
  fail(x.begin, fmt::format("{} needs a number without unit, \"{}\" has {}; divide it by a "
                            "parameter or a number of that unit",
                            who, source(x), shown(x)));
}

std::string ExpressionParser::shown(const Operand& x) {
  switch (x.kind) {
    case Kind::kReading:
      return "[degC]";
    case Kind::kUnknown:
      return "the unit of its joint";
    case Kind::kZero:
      return "(no unit)";
    default:
      return x.dimension.none() ? "(no unit)" : in_brackets(x.dimension);
  }
}

void ExpressionParser::fail_reading(const Operand& x, const std::string& what) const {
  fail(x.begin, fmt::format("\"{}\" is a reading on the Celsius scale and {}; take a difference "
                            "first, as in (oil - 20[degC]), and give differences in K",
                            source(x), what));
}

std::string ExpressionParser::source(const Operand& x) const {
  std::string text = law_.substr(x.begin, x.end - x.begin);
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  return text;
}

bool ExpressionParser::is_number(int node) const {
  return node + 1 == static_cast<int>(result_.tape_.size()) &&
         result_.tape_.back().op == Op::kNumber;
}

int ExpressionParser::emit(const Expression::Node& node, std::size_t at) {
  std::vector<Expression::Node>& tape = result_.tape_;
  const std::size_t operands = Expression::binary(node.op) ? 2 : Expression::unary(node.op) ? 1 : 0;
  const bool constant = operands > 0 && tape.size() >= operands &&
                        std::all_of(tape.end() - static_cast<std::ptrdiff_t>(operands), tape.end(),
                                    [](const Expression::Node& n) { return n.op == Op::kNumber; });
  if (constant) {  // Operands are the last nodes, so numbers there are the operands.
    const double b = tape.back().value;
    double value = 0.0;
    if (operands == 2) {
      value = Expression::apply<double>(node, tape[tape.size() - 2].value, b);
    } else {
      value = Expression::apply<double>(node, b);
    }
    if (!std::isfinite(value)) fail(at, "this is not a finite number (a division by zero?)");
    tape.resize(tape.size() - operands);
    tape.push_back({Op::kNumber, -1, -1, value});
  } else {
    if (tape.size() >= Expression::kMaxNodes) {
      fail(at, fmt::format("the law has more than {} operations; split it into several effects",
                           Expression::kMaxNodes));
    }
    tape.push_back(node);
  }
  return static_cast<int>(tape.size()) - 1;
}

void ExpressionParser::check_depth() const {
  std::size_t waiting = 0;
  for (const Expression::Node& node : result_.tape_) {
    if (Expression::binary(node.op)) {
      --waiting;
    } else if (!Expression::unary(node.op)) {
      ++waiting;
    }
    if (waiting > Expression::kMaxDepth) {
      fail(0, fmt::format("more than {} intermediate values wait for each other; put the longer "
                          "part of sums and products first",
                          Expression::kMaxDepth));
    }
  }
}

}  // namespace sparflow
