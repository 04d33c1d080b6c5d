/// Evaluates expressions over columns by recursive descent; each operation acts on all rows at once.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "identification/log/log_mapping.h"
#include "identification/log/text_encoding.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

using Values = std::vector<double>;

bool is_word(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         (static_cast<unsigned char>(c) & 0x80) != 0;
}

class Expression {
 public:
  Expression(const std::string& text, const RawTable& table, const FilePlace& place,
             const std::string& key, std::set<std::string>* read)
      : text_(text), table_(table), place_(place), key_(key), read_(read) {}

  Values evaluate() {
    Values result = sum();
    skip_blanks();
    if (at_ < text_.size()) {
      fail(fmt::format("found \"{}\", expected an operator or the end", rest()));
    }
    return result;
  }

 private:
  static constexpr int kDeepest = 100;  // largest nesting, which limits the use of the stack

  [[noreturn]] void fail(const std::string& message) const {
    throw InputError(place_, key_,
                     fmt::format("\"{}\", character {}: {}", printable(text_), at_ + 1, message));
  }
  std::string rest() const { return printable(std::string_view(text_).substr(at_), 40); }
  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n'))
      ++at_;
  }
  bool take(char c) {
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  template <class Operation>
  static void combine(Values* left, const Values& right, Operation operation) {
    for (std::size_t i = 0; i < left->size(); ++i) (*left)[i] = operation((*left)[i], right[i]);
  }

  Values sum() {
    Values left = product();
    for (;;) {
      if (take('+')) {
        combine(&left, product(), [](double a, double b) { return a + b; });
      } else if (take('-')) {
        combine(&left, product(), [](double a, double b) { return a - b; });
      } else {
        return left;
      }
    }
  }

  Values product() {
    Values left = signed_power();
    for (;;) {
      if (take('*')) {
        combine(&left, signed_power(), [](double a, double b) { return a * b; });
      } else if (take('/')) {
        combine(&left, signed_power(), [](double a, double b) { return a / b; });
      } else {
        return left;
      }
    }
  }

  /// A power binds more strongly than a sign and is right-associative: -2^2 = -4, 2^-1 = 0.5, 2^3^2 = 2^9.
  Values signed_power() {
    if (++depth_ > kDeepest) fail("nested too deeply");
    Values result;
    if (take('-')) {
      result = signed_power();
      for (double& v : result) v = -v;
    } else if (take('+')) {
      result = signed_power();
    } else {
      result = primary();
      if (take('^')) {
        combine(&result, signed_power(), [](double a, double b) { return std::pow(a, b); });
      }
    }
    --depth_;
    return result;
  }

  Values primary() {
    skip_blanks();
    if (at_ >= text_.size()) fail("the expression ends where a column or a number was expected");
    if (take('(')) {
      Values inside = sum();
      if (!take(')')) fail("a bracket is opened and not closed");
      return inside;
    }
    if (text_[at_] == '`') return quoted_column();
    if (const RawColumn* column = longest_column()) {
      const std::size_t start = at_;
      at_ += column->name.size();
      return values_of(*column, start);
    }
    const char c = text_[at_];
    if ((c >= '0' && c <= '9') || c == '.') return number();
    if (is_word(c)) return word();
    fail(fmt::format("found \"{}\", expected a column, a number or a bracket", rest()));
  }

  Values number() {
    double value = 0.0;
    const auto [stop, error] =
        std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc{}) fail(fmt::format("\"{}\" is not a number", rest()));
    const auto end = static_cast<std::size_t>(stop - text_.data());
    if (end < text_.size() && is_word(text_[end])) unknown_column();
    at_ = end;
    return constant(value);
  }

  Values quoted_column() {
    const std::size_t close = text_.find('`', at_ + 1);
    if (close == std::string::npos) fail("a backtick is opened and not closed");
    const std::string name = text_.substr(at_ + 1, close - at_ - 1);
    const auto column = std::find_if(table_.columns.begin(), table_.columns.end(),
                                     [&](const RawColumn& c) { return c.name == name; });
    if (column == table_.columns.end()) no_such_column(name);
    const std::size_t start = at_;
    at_ = close + 1;
    return values_of(*column, start);
  }

  /// @return the longest column name that matches here as a whole word, or nullptr; a name that is a number needs backticks
  const RawColumn* longest_column() const {
    const RawColumn* best = nullptr;
    for (const RawColumn& column : table_.columns) {
      const std::string& name = column.name;
      if (name.empty() || (best != nullptr && name.size() <= best->name.size())) continue;
      if (text_.compare(at_, name.size(), name) != 0) continue;
      const std::size_t end = at_ + name.size();
      if (end < text_.size() && is_word(name.back()) && is_word(text_[end])) continue;
      if (end < text_.size() && text_[end] == '(' && is_function(name)) continue;
      double ignored = 0.0;
      if (std::from_chars(name.data(), name.data() + name.size(), ignored).ptr ==
          name.data() + name.size()) {
        continue;
      }
      best = &column;
    }
    return best;
  }

  static bool is_function(const std::string& name) {
    static const std::vector<std::string> kNames = {"abs", "sqrt", "sin", "cos", "min", "max"};
    return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
  }

  Values word() {
    std::size_t end = at_;
    while (end < text_.size() && is_word(text_[end])) ++end;
    const std::string name = text_.substr(at_, end - at_);
    std::size_t behind = end;
    while (behind < text_.size() && text_[behind] == ' ') ++behind;
    if (behind < text_.size() && text_[behind] == '(' && is_function(name)) {
      at_ = behind + 1;
      return function(name);
    }
    const double value = name == "pi"    ? std::numbers::pi
                         : name == "deg" ? units::kDegree
                         : name == "rad" ? 1.0
                                         : std::numeric_limits<double>::quiet_NaN();
    if (std::isnan(value)) unknown_column();
    at_ = end;
    return constant(value);
  }

  Values function(const std::string& name) {
    Values result = sum();
    const bool two = name == "min" || name == "max";
    if (two) {
      if (!take(',')) fail(fmt::format("{} takes two values, separated by a comma", name));
      combine(&result, sum(), [&](double a, double b) {
        if (std::isnan(a) || std::isnan(b)) return std::numeric_limits<double>::quiet_NaN();
        return name == "min" ? std::min(a, b) : std::max(a, b);
      });
    }
    if (!take(')')) fail(fmt::format("the bracket of {}( is not closed", name));
    for (double& v : result) {
      if (name == "abs") v = std::abs(v);
      if (name == "sqrt") v = std::sqrt(v);
      if (name == "sin") v = std::sin(v);
      if (name == "cos") v = std::cos(v);
    }
    return result;
  }

  /// Reports the text up to the next sign that cannot be part of a name as unknown; a "-" can be part of one.
  [[noreturn]] void unknown_column() const {
    const std::size_t end = std::min(text_.find_first_of("+*/^,()`", at_), text_.size());
    std::string name(trimmed(std::string_view(text_).substr(at_, end - at_)));
    if (nearest(name).empty()) name = std::string(trimmed(name.substr(0, name.find('-'))));
    no_such_column(name);
  }

  std::string nearest(const std::string& name) const {
    std::vector<std::string> names;
    for (const RawColumn& column : table_.columns) names.push_back(column.name);
    return nearest_word(name, names);
  }

  [[noreturn]] void no_such_column(const std::string& name) const {
    const std::string near = nearest(name);
    if (!near.empty()) {
      fail(
          fmt::format("the log has no column \"{}\"; did you mean \"{}\"?", printable(name), near));
    }
    std::string all;
    for (const RawColumn& column : table_.columns) {
      if (all.size() > 300) {
        all += ", ...";
        break;
      }
      all += (all.empty() ? "" : ", ") + column.name;
    }
    fail(fmt::format("the log has no column \"{}\"; its columns are: {}", printable(name), all));
  }

  Values values_of(const RawColumn& column, std::size_t start) {
    if (column.text) {
      at_ = start;
      fail(fmt::format("column \"{}\" holds text (\"{}\" in line {}), expected numbers",
                       column.name, column.example, column.example_line));
    }
    if (read_ != nullptr) read_->insert(column.name);
    return column.values;
  }
  Values constant(double value) const { return Values(table_.rows(), value); }

  const std::string& text_;
  const RawTable& table_;
  const FilePlace& place_;
  const std::string& key_;
  std::set<std::string>* read_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

std::vector<double> evaluate_expression(const std::string& expression, const RawTable& table,
                                        const FilePlace& place, const std::string& key,
                                        std::set<std::string>* read) {
  return Expression(expression, table, place, key, read).evaluate();
}

}  // namespace sparflow
