// The rules of units in a law, in one pass over its nodes.
#include <fmt/format.h>

#include <algorithm>

#include "models/effects/formula/law.h"

namespace sparflow {
namespace {

using Op = ExpressionNode::Op;
using Rule = ExpressionFunction::Rule;

/// A reading is a temperature on the Celsius scale. A bare 0 is compatible with every unit, an unknown unit with all.
enum class Kind { kQuantity, kReading, kZero, kUnknown };

/// A part of the law with its unit.
struct Part {
  ExpressionNode node;
  Dimension dimension;
  Kind kind = Kind::kQuantity;

  bool free() const { return kind == Kind::kZero || kind == Kind::kUnknown; }
};

std::string shown(const Part& x) {
  return x.kind == Kind::kReading                      ? "[degC]"
         : x.kind == Kind::kUnknown                    ? "the unit of its joint"
         : x.kind == Kind::kZero || x.dimension.none() ? "(no unit)"
                                                       : in_brackets(x.dimension);
}

class UnitCheck {
 public:
  UnitCheck(const Expression& law, const std::vector<Symbol>& symbols)
      : law_(law), symbols_(symbols), folded_(law.text()) {}

  CheckedUnits whole() {
    for (const ExpressionNode& node : law_.nodes()) {
      const std::size_t n = node.operands();
      const Part b = n > 0 ? parts_.back() : Part{}, a = n == 2 ? parts_[parts_.size() - 2] : b;
      parts_.resize(parts_.size() - n);
      Part result = n == 0 ? leaf(node) : n == 1 ? of_one(node, a) : of_two(node, a, b);
      result.node = node;
      parts_.push_back(result);
      folded_.fold(node);
    }
    const Part& all = parts_.back();
    if (all.kind == Kind::kReading) fail_reading(all, "is the whole law");
    return {all.dimension, all.kind != Kind::kUnknown, std::move(folded_)};
  }

 private:
  Part leaf(const ExpressionNode& node) const {
    if (node.op == Op::kName) {
      const Symbol& s = symbols_[node.index];
      return {node, s.unit.dimension,
              !s.unit_known    ? Kind::kUnknown
              : s.unit.reading ? Kind::kReading
                               : Kind::kQuantity};
    }
    if (!node.unit) return {node, {}, node.number == 0.0 ? Kind::kZero : Kind::kQuantity};
    return {node, node.unit->dimension, node.unit->reading ? Kind::kReading : Kind::kQuantity};
  }

  Part of_one(const ExpressionNode& node, const Part& x) const {
    if (node.op == Op::kNegate) {
      // -10[degC] is a reading; no other reading can be negated.
      if (x.kind == Kind::kReading && !last_is_number()) fail_reading(x, "is negated");
      return x;
    }
    const Rule rule = node.function->rule;
    const std::string who = std::string(node.function->name) + "()";
    if (x.kind == Kind::kReading) fail_reading(x, "stands in " + who);
    if (rule == Rule::kKept) return x;
    if (rule == Rule::kNone) wants_none(x, who);
    if (rule == Rule::kNone || rule == Rule::kForgotten) return {node, {}, Kind::kQuantity};
    return {node, power(node, x, rule == Rule::kSquare ? 2.0 : 0.5), x.kind};
  }

  Part of_two(const ExpressionNode& node, const Part& a, const Part& b) const {
    switch (node.op) {
      case Op::kAdd:
      case Op::kSubtract:
        return added(node, a, b);
      case Op::kMultiply:
      case Op::kDivide:
        return multiplied(node, a, b);
      case Op::kPower:
        return raised(node, a, b);
      case Op::kMax:
        return compared(node, a, b, "max() compares");
      case Op::kMin:
        return compared(node, a, b, "min() compares");
      default:
        compared(node, a, b, "compares");
        return {};
    }
  }

  Part added(const ExpressionNode& node, const Part& a, const Part& b) const {
    const bool minus = node.op == Op::kSubtract;
    const auto kelvin = [](const Part& x) {
      return x.kind == Kind::kUnknown ||
             (x.kind == Kind::kQuantity && x.dimension == dimensions::kTemperature);
    };
    const bool reading_a = a.kind == Kind::kReading, reading_b = b.kind == Kind::kReading;
    if (reading_a && reading_b) {
      if (!minus) fail_reading(b, "is added to another");
      return {node, a.dimension, Kind::kQuantity};
    }
    if (reading_a && b.kind == Kind::kZero) fail_reading(a, "meets a 0 without a unit");
    if (reading_b && a.kind == Kind::kZero) fail_reading(b, "meets a 0 without a unit");
    // A reading plus or minus a difference in K is a reading.
    if (reading_a && kelvin(b)) return a;
    if (reading_b && kelvin(a)) {
      if (minus) fail_reading(b, "is subtracted from what is none");
      return b;
    }
    if (fit(a, b)) return common(a, b);
    fail(node.at, fmt::format("{} \"{}\" {} {} \"{}\" {}; both must have the same unit{}",
                              minus ? "subtracts" : "adds", law_.source(b.node), shown(b),
                              minus ? "from" : "to", law_.source(a.node), shown(a),
                              remedy(b, reading_a ? "[K]" : shown(a))));
  }

  Part multiplied(const ExpressionNode& node, const Part& a, const Part& b) const {
    const bool divided = node.op == Op::kDivide;
    if (a.kind == Kind::kReading) fail_reading(a, divided ? "is divided" : "is multiplied");
    if (b.kind == Kind::kReading) fail_reading(b, divided ? "divides" : "is multiplied");
    const bool unknown = a.kind == Kind::kUnknown || b.kind == Kind::kUnknown;
    return {node, divided ? a.dimension / b.dimension : a.dimension * b.dimension,
            unknown ? Kind::kUnknown : Kind::kQuantity};
  }

  Part raised(const ExpressionNode& node, const Part& base, const Part& exponent) const {
    if (base.kind == Kind::kReading) fail_reading(base, "is raised to a power");
    wants_none(exponent, "an exponent");
    Part result{node, base.dimension,
                base.kind == Kind::kUnknown ? Kind::kUnknown : Kind::kQuantity};
    const ExpressionNode& last = folded_.nodes().back();
    if (last.op == Op::kNumber) {
      result.dimension = power(node, base, last.number);
    } else if (result.kind == Kind::kQuantity && !base.dimension.none()) {
      fail(node.at,
           fmt::format("\"{}\" has the unit {}, so its exponent must be a number, not \"{}\"",
                       law_.source(base.node), shown(base), law_.source(exponent.node)));
    }
    return result;
  }

  Dimension power(const ExpressionNode& node, const Part& base, double exponent) const {
    try {
      return base.dimension.power(exponent);
    } catch (const TextError& error) {
      fail(node.at, error.what());
    }
  }

  Part compared(const ExpressionNode& node, const Part& a, const Part& b,
                const std::string& verb) const {
    if (fit(a, b)) return common(a, b);
    fail(node.at, fmt::format("{} \"{}\" {} with \"{}\" {}; both must have the same unit{}", verb,
                              law_.source(a.node), shown(a), law_.source(b.node), shown(b),
                              remedy(b, shown(a))));
  }

  /// Whether both can have one unit.
  static bool fit(const Part& a, const Part& b) {
    const auto is = [&](Kind kind) { return a.kind == kind || b.kind == kind; };
    if (is(Kind::kZero) && is(Kind::kReading)) return false;
    return a.free() || b.free() || (a.kind == b.kind && a.dimension == b.dimension);
  }
  static const Part& common(const Part& a, const Part& b) {
    return a.free() && b.kind != Kind::kZero ? b : a;
  }
  /// Whether the last operand is a number once constant parts are computed.
  bool last_is_number() const { return folded_.nodes().back().op == Op::kNumber; }
  std::string remedy(const Part& b, const std::string& unit) const {
    const bool bare = last_is_number() && b.dimension.none();
    return bare ? fmt::format(": write {}{}", law_.source(b.node), unit) : "";
  }

  void wants_none(const Part& x, const std::string& who) const {
    if (x.kind == Kind::kReading) fail_reading(x, "stands in " + who);
    if (x.free() || x.dimension.none()) return;
    fail(x.node.begin, fmt::format("{} needs a number without unit, \"{}\" has {}; divide it by a "
                                   "parameter or a number of that unit",
                                   who, law_.source(x.node), shown(x)));
  }
  [[noreturn]] void fail_reading(const Part& x, const std::string& what) const {
    fail(x.node.begin,
         fmt::format("\"{}\" is a reading on the Celsius scale and {}; take a difference first, as "
                     "in (oil - 20[degC]), and give differences in K",
                     law_.source(x.node), what));
  }
  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    fail_at(law_.text(), at, message);
  }

  const Expression& law_;
  const std::vector<Symbol>& symbols_;
  Expression folded_;
  std::vector<Part> parts_;
};

}  // namespace

CheckedUnits check_units(const Expression& law, const std::vector<Symbol>& symbols) {
  return UnitCheck(law, symbols).whole();
}

}  // namespace sparflow
