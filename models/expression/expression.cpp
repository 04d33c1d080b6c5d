#include "models/expression/expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

#include "models/math/error.h"

namespace sparflow {
namespace {

using Op = ExpressionNode::Op;

bool letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }
bool inside_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }  // UTF-8

}  // namespace

Curve power_curve(double x, double n) {
  if (n == 2.0) return {x * x, 2.0 * x, 2.0};
  if (n == 0.5 && x > 0.0) return {std::sqrt(x), 0.5 / std::sqrt(x), -0.25 / (std::sqrt(x) * x)};
  Curve c{std::pow(x, n), n == 0.0 ? 0.0 : n * std::pow(x, n - 1.0),
          n == 0.0 || n == 1.0 ? 0.0 : n * (n - 1.0) * std::pow(x, n - 2.0)};
  if (x == 0.0 && n > 0.0) {  // x^1.5 has no second derivative at 0
    if (!std::isfinite(c.f1)) c.f1 = 0.0;
    if (!std::isfinite(c.f2)) c.f2 = 0.0;
  }
  return c;
}

const std::vector<ExpressionFunction>& expression_functions() {
  using enum ExpressionFunction::Rule;
  static const auto curve = [](double f0, double f1, double f2) { return Curve{f0, f1, f2}; };
  static const auto exponential = [](double e) { return Curve{e, e, e}; };
  static const auto tangent = [](double t) { return curve(t, 1 - t * t, -2 * t * (1 - t * t)); };
  static const std::vector<ExpressionFunction> all = {
      // sign and step leave a NaN as it is
      {"abs", kKept, [](double x) { return x < 0 ? curve(-x, -1, 0) : curve(x, 1, 0); }},
      {"sign", kForgotten, [](double x) { return curve(x > 0   ? 1
                                                       : x < 0 ? -1
                                                               : x,
                                                       0, 0); }},
      {"max", kKept, nullptr},
      {"min", kKept, nullptr},
      {"exp", kNone, [](double x) { return exponential(std::exp(x)); }},
      {"log", kNone, [](double x) { return curve(std::log(x), 1 / x, -1 / (x * x)); }},
      {"sqrt", kRoot, [](double x) { return power_curve(x, 0.5); }},
      {"tanh", kNone, [](double x) { return tangent(std::tanh(x)); }},
      {"sin", kNone, [](double x) { return curve(std::sin(x), std::cos(x), -std::sin(x)); }},
      {"cos", kNone, [](double x) { return curve(std::cos(x), -std::sin(x), -std::cos(x)); }},
      {"step", kForgotten, [](double x) { return curve(x > 0    ? 1
                                                       : x <= 0 ? 0
                                                                : x,
                                                       0, 0); }},
      {"square", kSquare, [](double x) { return power_curve(x, 2); }},
      {"positive", kKept, [](double x) { return x <= 0 ? curve(0, 0, 0) : curve(x, 1, 0); }}};
  return all;
}

const ExpressionFunction* find_function(const std::string& name) {
  for (const ExpressionFunction& f : expression_functions()) {
    if (name == f.name) return &f;
  }
  return nullptr;
}

int text_column(const std::string& text, std::size_t at) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(at, text.size()));
  return 1 + static_cast<int>(
                 std::count_if(text.begin(), end, [](char c) { return !inside_character(c); }));
}

void fail_at(const std::string& text, std::size_t at, const std::string& message) {
  throw TextError(text_column(text, at), message);
}

std::size_t skip_blanks(const std::string& text, std::size_t at) {
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
  return at;
}

/// Recursive descent, one function for each level of precedence; each leaves the nodes of what it read.
class ExpressionParser {
 public:
  ExpressionParser(const std::string& text, const Expression::Grammar& grammar)
      : text_(text), grammar_(grammar), result_(text) {}

  Expression whole() {
    if (text_.size() > grammar_.options.longest) {
      fail(grammar_.options.longest,
           fmt::format("the {} is longer than {} characters; split it or shorten it", grammar_.what,
                       grammar_.options.longest));
    }
    sum();
    if (next() != '\0') unexpected();
    return std::move(result_);
  }

 private:
  void sum() {
    product();
    for (char c = next(); c == '+' || c == '-'; c = next()) {
      const std::size_t begin = last().begin, at = pos_++;
      product();
      binary(c == '+' ? Op::kAdd : Op::kSubtract, begin, at);
    }
  }

  void product() {
    signed_power();
    bool divided = false;
    for (char c = next(); c != '\0'; c = next()) {
      const std::size_t begin = last().begin, at = pos_;
      const bool beside = grammar_.of_units && std::string("*/+-^),").find(c) == std::string::npos;
      if (c != '*' && c != '/' && !beside) return;
      if (!beside) {
        ++pos_;
      } else {
        eat("·");
      }
      if (c == '*' && next() == '*') fail(at, "a power is written ^, as in v^2");
      if (grammar_.of_units && divided && c != '/') {
        fail(at, fmt::format("it is not clear whether \"{}\" stands above or below the /; put what "
                             "stands below in parentheses, as in J/(kg K)",
                             text_.substr(at)));
      }
      divided = divided || c == '/';
      signed_power();
      binary(c == '/' ? Op::kDivide : Op::kMultiply, begin, at);
    }
  }

  /// Parses a sign; -x^2 is -(x^2) and 2^3^2 is 2^9, as in mathematics.
  void signed_power() {
    if (++depth_ > grammar_.options.deepest) {
      fail(pos_, fmt::format("the {} is nested more than {} deep; split it", grammar_.what,
                             grammar_.options.deepest));
    }
    const char sign = next();
    const std::size_t begin = pos_;
    if (sign == '-' || sign == '+') {
      ++pos_;
      signed_power();
      if (sign == '-') push({.op = Op::kNegate, .begin = begin, .end = last().end, .at = begin});
      last().begin = begin;
    } else {
      primary();
      power(begin);
    }
    --depth_;
  }

  void power(std::size_t begin) {
    const char c = next();
    const std::size_t at = pos_;
    if (c == '^') {
      ++pos_;
      signed_power();
    } else if (grammar_.of_units && (eat("²") || eat("³"))) {
      push({.number = text_.compare(at, 2, "²") == 0 ? 2.0 : 3.0, .begin = at, .end = pos_});
    } else {
      return;
    }
    binary(Op::kPower, begin, at);
  }

  void primary() {
    const char c = next();
    const std::size_t at = pos_;
    if (c == '\0') {
      fail(at, fmt::format("the {} ends where a number, a name or ( should follow", grammar_.what));
    }
    if (c == '(') {
      ++pos_;
      sum();
      close(at);
      last().begin = at;
      last().end = pos_;
    } else if (std::optional<ExpressionNode> name = grammar_.name(text_, pos_)) {
      name->begin = name->at = at;
      name->end = pos_;
      push(*name);
    } else if (digit(c) || c == '.') {
      number();
    } else {
      std::size_t end = at;
      while (end < text_.size() && (letter(text_[end]) || digit(text_[end]))) ++end;
      if (end == at) unexpected();
      call(text_.substr(at, end - at));
    }
  }

  void number() {
    const std::size_t at = pos_;
    ExpressionNode node{.begin = at, .at = at};
    const auto [stop, error] =
        std::from_chars(text_.data() + at, text_.data() + text_.size(), node.number);
    pos_ = static_cast<std::size_t>(stop - text_.data());
    if (error == std::errc::result_out_of_range) {
      fail(at, fmt::format("the number {} is beyond what a computer can hold, 1e-307 to 1e308",
                           text_.substr(at, pos_ - at)));
    }
    if (error != std::errc()) fail(at, "expected digits before or behind the point");
    node.end = pos_;
    if (next() == ',' && arguments_ == 0) fail(pos_, "write a decimal point, not a comma");
    if (grammar_.numbers_have_units && next() == '[') {
      const std::size_t open = pos_;
      const std::size_t end = text_.find(']', open);
      if (end == std::string::npos) fail(open, "this [ is never closed");
      try {
        node.unit = parse_unit(text_.substr(open + 1, end - open - 1));
      } catch (const TextError& unit_error) {
        throw TextError(text_column(text_, open) + unit_error.column, unit_error.what());
      }
      node.number *= node.unit->si;
      node.end = pos_ = end + 1;
      if (!std::isfinite(node.number)) {
        fail(at, fmt::format("{} is beyond what a computer can hold in SI, 1e308",
                             text_.substr(at, pos_ - at)));
      }
    }
    push(node);
  }

  void call(const std::string& word) {
    const std::size_t at = pos_, open = skip_blanks(text_, at + word.size());
    const ExpressionFunction* function = find_function(word);
    if (function == nullptr || open >= text_.size() || text_[open] != '(') unknown_function(word);
    pos_ = open + 1;
    ++arguments_;
    if (next() == ')') fail(open, fmt::format("{}() has nothing between its parentheses", word));
    sum();
    const std::size_t begin = last().begin;
    if (function->curve == nullptr) {
      if (next() == ')') {
        fail(at, fmt::format("{0}() takes two values or more, as in {0}(0, x)", word));
      }
      while (next() == ',') {
        ++pos_;
        sum();
        binary(word == "max" ? Op::kMax : Op::kMin, begin, at);
      }
    } else if (word != "step" || !comparison(begin)) {
      if (next() == ',') {
        fail(pos_, fmt::format("{}() takes one value; if the comma is a decimal one, write a point",
                               word));
      }
      push({.op = Op::kFunction, .at = at, .function = function});
    }
    close(open);
    --arguments_;
    last().begin = at;
    last().end = pos_;
  }

  /// Parses the rest of `a > b` inside step(). @return whether there is one
  bool comparison(std::size_t begin) {
    const char c = next();
    if (c != '<' && c != '>') return false;
    const std::size_t at = pos_++;
    const bool equal = pos_ < text_.size() && text_[pos_] == '=';
    if (equal) ++pos_;
    sum();
    if (next() == '<' || next() == '>') {
      fail(pos_, "one comparison at a time; multiply two steps, as in step(a > b) * step(b > c)");
    }
    binary(c == '>' ? (equal ? Op::kGreaterEqual : Op::kGreater)
                    : (equal ? Op::kLessEqual : Op::kLess),
           begin, at);
    return true;
  }

  void close(std::size_t open) {
    const char c = next();
    if (c == '\0') fail(open, "this ( is never closed");
    if (c != ')') unexpected();
    ++pos_;
  }

  ExpressionNode& last() { return result_.nodes_.back(); }
  void push(const ExpressionNode& node) { result_.push(node); }
  void binary(Op op, std::size_t begin, std::size_t at) {
    push({.op = op, .begin = begin, .end = last().end, .at = at});
  }

  /// The next character that is no blank, '\0' at the end.
  char next() {
    pos_ = skip_blanks(text_, pos_);
    return pos_ < text_.size() ? text_[pos_] : '\0';
  }
  bool eat(const std::string& sign) {
    if (text_.compare(pos_, sign.size(), sign) != 0) return false;
    pos_ += sign.size();
    return true;
  }

  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    fail_at(text_, at, message);
  }

  [[noreturn]] void unknown_function(const std::string& word) const {
    static const std::vector<std::array<const char*, 2>> kHabits = {
        {"pow", "x^2"},  {"sgn", "sign"},   {"signum", "sign"},    {"ln", "log"},
        {"fabs", "abs"}, {"sqr", "square"}, {"heaviside", "step"}, {"relu", "positive"}};
    std::vector<std::string> names;
    for (const ExpressionFunction& f : expression_functions()) names.emplace_back(f.name);
    std::string meant = nearest_word(word, names);
    for (const auto& habit : kHabits) {
      if (word == habit[0]) meant = habit[1];
    }
    fail(pos_, fmt::format("unknown function \"{}\"; {}", word,
                           meant.empty() ? fmt::format("known: {}", fmt::join(names, ", "))
                                         : fmt::format("did you mean \"{}\"?", meant)));
  }

  /// Says what is wrong with the text at the present place, where an operator or the end should follow, or an operand.
  [[noreturn]] void unexpected() const {
    static const std::vector<std::array<const char*, 2>> kSigns = {
        {")", "this ) has no ( before it"},
        {"<", "a comparison stands only inside step(), as in step(v > 0)"},
        {">", "a comparison stands only inside step(), as in step(v > 0)"},
        {"=", "a formula has no =; write only what stands on its right"},
        {",",
         "a comma separates the values of min() and max(); a decimal one is written as a point"},
        {"−", "write the minus sign of the keyboard, -"},
        {"–", "write the minus sign of the keyboard, -"},
        {"·", "write *"},
        {"×", "write *"},
        {"²", "write ^2"},
        {"³", "write ^3"},
        {"√", "write sqrt(...)"}};
    for (const auto& [found, remedy] : kSigns) {
      if (text_.compare(pos_, std::string(found).size(), found) == 0) fail(pos_, remedy);
    }
    const char c = text_[pos_];
    if (c == '[' && grammar_.numbers_have_units) {
      fail(pos_, "a unit in brackets follows a number directly, as in 20[bar]");
    }
    std::size_t end = pos_ + 1;
    if (c == '*' || c == '/' || c == '^') {
      fail(pos_, fmt::format("found \"{}\", expected a number, a name or ( before it", c));
    }
    if (letter(c) || digit(c) || c == '(' || c == '[' || c == '.' || c == '`') {
      while (c != '(' && end < text_.size() && (letter(text_[end]) || digit(text_[end]))) ++end;
      if (c == '[') end = std::min(text_.find(']', pos_), text_.size() - 1) + 1;
      fail(pos_, fmt::format(
                     "expected an operator before \"{}\"; a product is written *{}",
                     text_.substr(pos_, end - pos_),
                     grammar_.numbers_have_units ? ", a number's unit in brackets, 20[bar]" : ""));
    }
    while (end < text_.size() && inside_character(text_[end])) ++end;
    fail(pos_,
         fmt::format("\"{}\" means nothing in a formula; it is written with numbers, names and "
                     "+ - * / ^ ( )",
                     text_.substr(pos_, end - pos_)));
  }

  const std::string& text_;
  const Expression::Grammar& grammar_;
  Expression result_;
  std::size_t pos_ = 0;
  int depth_ = 0;
  int arguments_ = 0;  // number of open function calls, within which a comma may follow a number
};

Expression Expression::parse(const std::string& text, const Grammar& grammar) {
  return ExpressionParser(text, grammar).whole();
}

std::string Expression::source(const ExpressionNode& node) const {
  return text_.substr(node.begin, node.end - node.begin);
}

void Expression::push(const ExpressionNode& node) {
  nodes_.push_back(node);
  waiting_ += 1 - node.operands();
  stack_ = std::max(stack_, waiting_);
}

void Expression::fold(ExpressionNode node) {
  const std::size_t n = node.operands();
  const auto constant = [&](std::size_t k) {  // the k-th node from the end
    return nodes_[nodes_.size() - k].op == Op::kNumber;
  };
  const auto pop = [&] {
    const double number = nodes_.back().number;
    nodes_.pop_back();
    --waiting_;
    return number;
  };
  // Operands are the last nodes, so numbers there are the operands.
  if (n > 0 && constant(1) && (n == 1 || constant(2))) {
    const double b = pop();
    node.number = n == 1 ? apply<double>(node, b) : apply<double>(node, pop(), b);
    node.op = Op::kNumber;
    if (!std::isfinite(node.number)) {
      fail_at(text_, node.at, "this is not a finite number (a division by zero?)");
    }
  } else if (node.op == Op::kPower && constant(1)) {
    node.number = pop();
    node.op = Op::kRaise;
  }
  push(node);
}

}  // namespace sparflow
