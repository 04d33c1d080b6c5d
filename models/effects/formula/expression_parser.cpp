#include "models/effects/formula/expression_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include "models/math/error.h"
#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

bool letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// The name as a law must write it: q.'jib-2' for a joint whose name would otherwise be read as a difference.
std::string as_written(const std::string& name) {
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos || name.find('-') == std::string::npos) return name;
  return fmt::format("{}.'{}'", name.substr(0, dot), name.substr(dot + 1));
}

}  // namespace

Expression Expression::compile(const std::string& law, const std::vector<Symbol>& signals,
                               const std::vector<Symbol>& parameters) {
  return ExpressionParser(law, signals, parameters).whole();
}

std::vector<std::string> Expression::functions() { return ExpressionParser::function_names(); }

const std::vector<ExpressionParser::Function>& ExpressionParser::functions() {
  static const std::vector<Function> all = {
      {"abs", Op::kAbs, Rule::kKeepsUnit},
      {"sign", Op::kSign, Rule::kForgetsUnit},
      {"max", Op::kMax, Rule::kSameUnit},
      {"min", Op::kMin, Rule::kSameUnit},
      {"exp", Op::kExp, Rule::kWantsNone},
      {"log", Op::kLog, Rule::kWantsNone},
      {"sqrt", Op::kSqrt, Rule::kHalvesUnit},
      {"tanh", Op::kTanh, Rule::kWantsNone},
      {"sin", Op::kSin, Rule::kWantsNone},
      {"cos", Op::kCos, Rule::kWantsNone},
      {"step", Op::kStep, Rule::kForgetsUnit},
      {"square", Op::kPower, Rule::kSquaresUnit, 2.0},
      {"positive", Op::kPositive, Rule::kKeepsUnit},
  };
  return all;
}

std::vector<std::string> ExpressionParser::function_names() {
  std::vector<std::string> names;
  names.reserve(functions().size());
  for (const Function& f : functions()) names.emplace_back(f.name);
  return names;
}

Expression ExpressionParser::whole() {
  result_.text_ = law_;
  for (const Symbol& p : parameters_) result_.parameters_.push_back(p.name);
  skip_blanks();
  if (at_end()) fail(0, "the law is empty; expected a formula such as Fc * sign(v)");
  if (parameters_.size() > Expression::kMaxParameters) {
    fail(0, fmt::format("a law has at most {} parameters, this one has {}",
                        Expression::kMaxParameters, parameters_.size()));
  }
  const Operand law = sum();
  if (!at_end()) unexpected();
  if (law.kind == Kind::kReading) fail_reading(law, "is the whole law");
  check_depth();
  result_.dimension_ = law.dimension;
  result_.dimension_known_ = law.kind != Kind::kUnknown;
  return std::move(result_);
}

ExpressionParser::Operand ExpressionParser::sum() {
  Operand left = product();
  while (next() == '+' || next() == '-') {
    const std::size_t at = pos_++;
    const Operand right = product();
    left = added(left, right, at);
  }
  return left;
}

ExpressionParser::Operand ExpressionParser::product() {
  Operand left = signed_power();
  while (next() == '*' || next() == '/') {
    const std::size_t at = pos_++;
    if (law_[at] == '*' && next() == '*') fail(at, "a power is written ^, as in v^2");
    const Operand right = signed_power();
    left = multiplied(left, right, at);
  }
  return left;
}

/// Parses a sign; -x^2 is -(x^2), as in mathematics.
ExpressionParser::Operand ExpressionParser::signed_power() {
  if (++depth_ > kMaxNesting) fail(pos_, "the law is nested too deeply; split it into two effects");
  const char sign = next();
  const std::size_t at = pos_;
  Operand result;
  if (sign == '-' || sign == '+') {
    ++pos_;
    result = signed_power();
    if (sign == '-') {
      // -10[degC] is a reading; no other reading can be negated.
      if (result.kind == Kind::kReading && !is_number(result.node)) {
        fail_reading(result, "is negated");
      }
      result.node = emit({Op::kNegate, result.node, -1, 0.0}, at);
    }
    result.begin = at;
  } else {
    result = power();
  }
  --depth_;
  return result;
}

ExpressionParser::Operand ExpressionParser::power() {
  const Operand base = primary();
  if (next() != '^') return base;
  const std::size_t at = pos_++;
  const Operand exponent = signed_power();
  return raised(base, exponent, at);
}

ExpressionParser::Operand ExpressionParser::primary() {
  const char c = next();
  const std::size_t at = pos_;
  if (at_end()) fail(at, "the law ends where a number, a name or ( should follow");
  if (c == '(') {
    ++pos_;
    Operand inside = sum();
    if (next() != ')') not_closed(at);
    ++pos_;
    inside.begin = at;
    inside.end = pos_;
    return inside;
  }
  if (digit(c) || c == '.') return number();
  if (!letter(c)) unexpected();
  const std::string word = name();
  return next() == '(' ? call(word, at) : symbol(word, at);
}

ExpressionParser::Operand ExpressionParser::number() {
  const std::size_t at = pos_;
  Operand result{-1, at, at, dimensions::kNone, Kind::kQuantity};
  double value = 0.0;
  const auto [stop, error] = std::from_chars(law_.data() + at, law_.data() + law_.size(), value);
  if (error != std::errc()) fail(at, "expected a number here that a computer can hold");
  pos_ = static_cast<std::size_t>(stop - law_.data());
  if (next() == ',' && arguments_ == 0) fail(pos_, "write a decimal point, not a comma");
  if (next() == '[') {
    const std::size_t open = pos_;
    const std::size_t close = law_.find(']', open);
    if (close == std::string::npos) fail(open, "this [ is never closed");
    try {
      const Unit unit = parse_unit(law_.substr(open + 1, close - open - 1));
      result.dimension = unit.dimension;
      if (unit.reading) result.kind = Kind::kReading;
      value *= unit.si;
    } catch (const TextError& unit_error) {
      throw TextError(column(open) + unit_error.column, unit_error.what());
    }
    pos_ = close + 1;
  } else if (value == 0.0) {
    result.kind = Kind::kZero;
  }
  result.end = pos_;
  result.node = emit({Op::kNumber, -1, -1, value}, at);
  return result;
}

ExpressionParser::Operand ExpressionParser::symbol(const std::string& word, std::size_t at) {
  Operand result{-1, at, pos_, {}, Kind::kQuantity};
  const auto is = [&](const Symbol& s) {
    if (s.name == word) return true;
    return s.name.ends_with(".*") && word.size() >= s.name.size() &&
           word.starts_with(s.name.substr(0, s.name.size() - 1));
  };
  Expression::Node node{Op::kParameter, -1, -1, 0.0};
  auto found = std::find_if(parameters_.begin(), parameters_.end(), is);
  if (found != parameters_.end()) {
    node.a = static_cast<int>(found - parameters_.begin());
  } else {
    found = std::find_if(signals_.begin(), signals_.end(), is);
    if (found == signals_.end()) unknown_name(word, at);
    std::vector<std::string>& used = result_.signals_;
    const auto place = std::find(used.begin(), used.end(), word);
    node = {Op::kSignal, static_cast<int>(place - used.begin()), -1, 0.0};
    if (place == used.end()) used.push_back(word);
  }
  result.dimension = found->unit.dimension;
  if (found->unit.reading) result.kind = Kind::kReading;
  if (!found->unit_known) result.kind = Kind::kUnknown;
  if (next() == '[') {
    const bool pure = result.kind == Kind::kQuantity && result.dimension.none();
    fail(pos_, fmt::format("a unit in brackets follows a number only; {} {}", word,
                           pure ? "is a pure number" : "comes in " + shown(result)));
  }
  result.node = emit(node, at);
  return result;
}

ExpressionParser::Operand ExpressionParser::call(const std::string& word, std::size_t at) {
  const auto function = std::find_if(functions().begin(), functions().end(),
                                     [&](const Function& f) { return word == f.name; });
  if (function == functions().end()) unknown_function(word, at);
  const std::size_t open = pos_++;
  ++arguments_;
  if (next() == ')') fail(open, fmt::format("{}() has nothing between its parentheses", word));
  Operand result = function->op == Op::kStep ? condition() : sum();
  const bool several = function->rule == Rule::kSameUnit;
  if (several && next() == ')') {
    fail(at, fmt::format("{0}() takes two values or more, as in {0}(0, F)", word));
  }
  while (next() == ',') {
    if (!several) {
      fail(pos_,
           fmt::format("{}() takes one value; if the comma is a decimal one, write a point", word));
    }
    ++pos_;
    const Operand other = sum();
    const int node = result.node;
    result = same_unit(result, other, at, word + "() compares");
    result.node = emit({function->op, node, other.node, 0.0}, at);
  }
  if (next() != ')') not_closed(open);
  ++pos_;
  --arguments_;
  if (!several) result = applied(*function, result, at);
  result.begin = at;
  result.end = pos_;
  return result;
}

/// Parses `a > b` inside step(); a single value is compared with 0.
ExpressionParser::Operand ExpressionParser::condition() {
  const Operand left = sum();
  const char c = next();
  if (c != '<' && c != '>') return left;
  const std::size_t at = pos_++;
  const bool equal = !at_end() && law_[pos_] == '=';
  if (equal) ++pos_;
  const Operand right = sum();
  if (next() == '<' || next() == '>') {
    fail(pos_, "one comparison at a time; multiply two steps, as in step(a > b) * step(b > c)");
  }
  same_unit(left, right, at, "compares");
  const Op op =
      c == '>' ? (equal ? Op::kGreaterEqual : Op::kGreater) : (equal ? Op::kLessEqual : Op::kLess);
  return {emit({op, left.node, right.node, 0.0}, at), left.begin, right.end, dimensions::kNone,
          Kind::kQuantity};
}

/// Parses a name: `v`, `q.boom`, `q.'jib-2'` (returned without its quotes).
std::string ExpressionParser::name() {
  std::string word;
  const auto more = [&] { return !at_end() && (letter(law_[pos_]) || digit(law_[pos_])); };
  while (more()) word += law_[pos_++];
  while (pos_ + 1 < law_.size() && law_[pos_] == '.') {
    const char after = law_[pos_ + 1];
    if (after == '\'' || after == '"') {
      const std::size_t close = law_.find(after, pos_ + 2);
      if (close == std::string::npos) fail(pos_ + 1, "this quote is never closed");
      word += '.' + law_.substr(pos_ + 2, close - pos_ - 2);
      pos_ = close + 1;
    } else if (letter(after) || digit(after)) {
      word += law_[pos_++];
      while (more()) word += law_[pos_++];
    } else {
      break;
    }
  }
  return word;
}

std::size_t ExpressionParser::skip_blanks() {
  while (!at_end() && std::isspace(static_cast<unsigned char>(law_[pos_])) != 0) ++pos_;
  return pos_;
}

char ExpressionParser::next() {
  skip_blanks();
  return at_end() ? '\0' : law_[pos_];
}

void ExpressionParser::fail(std::size_t at, const std::string& message) const {
  throw TextError(column(at), message);
}

int ExpressionParser::column(std::size_t at) const {
  const auto end = law_.begin() + static_cast<std::ptrdiff_t>(std::min(at, law_.size()));
  return 1 + static_cast<int>(std::count_if(law_.begin(), end, [](char c) {
           return (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // UTF-8: not a continuation
         }));
}

void ExpressionParser::unknown_name(const std::string& word, std::size_t at) const {
  std::vector<std::string> names, candidates = function_names();
  for (const Symbol& p : parameters_) names.push_back(p.name);
  for (const Symbol& s : signals_) names.push_back(as_written(s.name));
  candidates.insert(candidates.begin(), names.begin(), names.end());
  if (std::find(candidates.begin(), candidates.end(), word) != candidates.end()) {
    fail(at, fmt::format("{0} is a function; write {0}(...)", word));
  }
  std::string hint = suggestion(word, candidates);
  if (word == "pi") hint = "; write 3.14159265";
  if (hint.empty() || word.size() == 1) hint = "; known here: " + listed(names);
  fail(at, fmt::format("unknown name \"{}\"{}", word, hint));
}

void ExpressionParser::unknown_function(const std::string& word, std::size_t at) const {
  for (const std::vector<Symbol>* symbols : {&signals_, &parameters_}) {
    for (const Symbol& s : *symbols) {
      if (s.name == word) fail(at, fmt::format("{0} is no function; write {0} * (...)", word));
    }
  }
  static constexpr std::array<std::array<const char*, 2>, 8> kHabits = {{{"pow", "x^2"},
                                                                         {"sgn", "sign"},
                                                                         {"signum", "sign"},
                                                                         {"ln", "log"},
                                                                         {"fabs", "abs"},
                                                                         {"sqr", "square"},
                                                                         {"heaviside", "step"},
                                                                         {"relu", "positive"}}};
  std::string hint = suggestion(word, function_names());
  for (const auto& habit : kHabits) {
    if (word == habit[0]) hint = fmt::format("; did you mean \"{}\"?", habit[1]);
  }
  if (hint.empty()) hint = "; known: " + listed(function_names());
  fail(at, fmt::format("unknown function \"{}\"{}", word, hint));
}

void ExpressionParser::not_closed(std::size_t open) const {
  if (at_end()) fail(open, "this ( is never closed");
  unexpected();
}

void ExpressionParser::unexpected() const {
  struct Sign {
    const char* found;
    const char* remedy;
  };
  static constexpr Sign kSigns[] = {
      {")", "this ) has no ( before it"},
      {"<", "a comparison stands only inside step(), as in step(v > 0)"},
      {">", "a comparison stands only inside step(), as in step(v > 0)"},
      {"=", "a law is one formula without =; it gives what is added to the stage"},
      {",", "a comma separates the values of min() and max(); a decimal one is written as a point"},
      {"[", "a unit in brackets follows a number directly, as in 20[bar]"},
      {"−", "write the minus sign of the keyboard, -"},
      {"–", "write the minus sign of the keyboard, -"},
      {"·", "write *"},
      {"×", "write *"},
      {"²", "write ^2"},
      {"³", "write ^3"},
      {"√", "write sqrt(...)"},
  };
  for (const Sign& sign : kSigns) {
    if (law_.compare(pos_, std::string(sign.found).size(), sign.found) == 0) {
      fail(pos_, sign.remedy);
    }
  }
  std::size_t end = pos_ + 1;
  if (letter(law_[pos_]) || digit(law_[pos_]) || law_[pos_] == '(' || law_[pos_] == '.') {
    while (law_[pos_] != '(' && end < law_.size() && (letter(law_[end]) || digit(law_[end]))) ++end;
    const std::string word = law_.substr(pos_, end - pos_);
    fail(pos_, fmt::format("expected an operator before \"{}\"; a product is written *, a number's "
                           "unit in brackets, 20[bar]",
                           word));
  }
  while (end < law_.size() && (static_cast<unsigned char>(law_[end]) & 0xC0) == 0x80) ++end;
  fail(pos_,
       fmt::format("\"{}\" means nothing in a law; it is written with + - * / ^ ( ) and names "
                   "of plain letters, digits and _",
                   law_.substr(pos_, end - pos_)));
}

}  // namespace sparflow
