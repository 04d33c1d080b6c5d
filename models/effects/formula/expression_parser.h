#pragma once
/// Recursive-descent parser from the text of a law to the tape of an Expression; internal to expression*.cpp.
/// Grammar and lexing are in expression_parser.cpp, the rules of units in expression_units.cpp.
#include <string>
#include <vector>

#include "models/effects/formula/expression.h"

namespace sparflow {

class ExpressionParser {
 public:
  ExpressionParser(const std::string& law, const std::vector<Symbol>& signals,
                   const std::vector<Symbol>& parameters)
      : law_(law), signals_(signals), parameters_(parameters) {}
  Expression whole();
  static std::vector<std::string> function_names();

 private:
  using Op = Expression::Op;
  /// A reading is a temperature on the Celsius scale. A bare 0 is compatible with every unit, an unknown unit with all.
  enum class Kind { kQuantity, kReading, kZero, kUnknown };
  /// A part of the law that has a value and a unit.
  struct Operand {
    int node = -1;
    std::size_t begin = 0, end = 0;  ///< [characters] in the law
    Dimension dimension;
    Kind kind = Kind::kQuantity;
  };
  enum class Rule { kKeepsUnit, kWantsNone, kForgetsUnit, kHalvesUnit, kSquaresUnit, kSameUnit };
  struct Function {
    const char* name;
    Op op;
    Rule rule;
    double value = 0.0;  ///< exponent of kPower
  };
  static const std::vector<Function>& functions();

  // grammar, one function for each level of precedence
  Operand sum();
  Operand product();
  Operand signed_power();
  Operand power();
  Operand primary();
  Operand number();
  Operand symbol(const std::string& word, std::size_t at);
  Operand call(const std::string& word, std::size_t at);
  Operand condition();
  std::string name();

  // units
  Operand added(const Operand& left, const Operand& right, std::size_t at);
  Operand multiplied(const Operand& left, const Operand& right, std::size_t at);
  Operand raised(const Operand& base, const Operand& exponent, std::size_t at);
  Operand applied(const Function& function, Operand x, std::size_t at);
  /// The common unit of two compared operands; the caller sets the node.
  Operand same_unit(const Operand& a, const Operand& b, std::size_t at,
                    const std::string& verb) const;
  void wants_none(const Operand& x, const std::string& who) const;
  static std::string shown(const Operand& x);

  // tape
  int emit(const Expression::Node& node, std::size_t at);
  bool is_number(int node) const;
  void check_depth() const;

  // messages
  [[noreturn]] void fail(std::size_t at, const std::string& message) const;
  [[noreturn]] void fail_reading(const Operand& x, const std::string& what) const;
  [[noreturn]] void unknown_name(const std::string& word, std::size_t at) const;
  [[noreturn]] void unknown_function(const std::string& word, std::size_t at) const;
  [[noreturn]] void unexpected() const;
  [[noreturn]] void not_closed(std::size_t open) const;
  std::string source(const Operand& x) const;
  int column(std::size_t at) const;

  // text
  bool at_end() const { return pos_ >= law_.size(); }
  std::size_t skip_blanks();
  char next();  ///< the next character that is no blank, '\0' at the end

  static constexpr int kMaxNesting = 60;
  const std::string& law_;
  const std::vector<Symbol>& signals_;
  const std::vector<Symbol>& parameters_;
  Expression result_;
  std::size_t pos_ = 0;
  int depth_ = 0;
  int arguments_ = 0;  ///< number of open function calls, within which a comma may follow a number
};

}  // namespace sparflow
