/// Evaluates the expressions of a mapping over the columns of a log.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "identification/log/log_mapping.h"
#include "models/expression/expression.h"
#include "models/math/text_encoding.h"
#include "models/math/units.h"

namespace sparflow {
namespace {

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ||
         (static_cast<unsigned char>(c) & 0x80) != 0;
}

bool is_number(const std::string& text) {
  double ignored = 0.0;
  const char* end = text.data() + text.size();
  return std::from_chars(text.data(), end, ignored).ptr == end;
}

/// Reads the names in an expression: columns, pi, deg and rad.
class ColumnNames {
 public:
  explicit ColumnNames(const RawTable& table) : table_(table) {}

  std::vector<const RawColumn*> used;  ///< by the index of their nodes

  std::optional<ExpressionNode> read(const std::string& text, std::size_t& at) {
    const std::size_t begin = at;
    if (text[at] == '`') {
      const std::size_t close = text.find('`', at + 1);
      if (close == std::string::npos) fail_at(text, at, "a backtick is opened and not closed");
      const std::string name = text.substr(at + 1, close - at - 1);
      const auto found = std::find_if(table_.columns.begin(), table_.columns.end(),
                                      [&](const RawColumn& c) { return c.name == name; });
      if (found == table_.columns.end()) no_such_column(text, begin, name);
      at = close + 1;
      return use(text, begin, *found);
    }
    if (const RawColumn* column = longest_column(text, at)) {
      at += column->name.size();
      return use(text, begin, *column);
    }
    std::size_t end = at;
    if (const char c = text[at]; c == '.' || (c >= '0' && c <= '9')) {
      double ignored = 0.0;
      end = static_cast<std::size_t>(
          std::from_chars(text.data() + at, text.data() + text.size(), ignored).ptr - text.data());
      if (end == text.size() || !is_word(text[end])) return std::nullopt;
      unknown_column(text, at);
    }
    while (end < text.size() && is_word(text[end])) ++end;
    const std::string word = text.substr(at, end - at);
    const std::size_t behind = skip_blanks(text, end);
    const bool call = behind < text.size() && text[behind] == '(' && find_function(word) != nullptr;
    if (word.empty() || call) return std::nullopt;
    const double value = word == "pi"    ? std::numbers::pi
                         : word == "deg" ? units::kDegree
                         : word == "rad" ? 1.0
                                         : std::numeric_limits<double>::quiet_NaN();
    if (std::isnan(value)) unknown_column(text, at);
    at = end;
    return ExpressionNode{.number = value};
  }

 private:
  /// The longest column name that matches here as a whole word, or null; a name that is a number needs backticks.
  const RawColumn* longest_column(const std::string& text, std::size_t at) const {
    const RawColumn* best = nullptr;
    for (const RawColumn& column : table_.columns) {
      const std::string& name = column.name;
      const std::size_t end = at + name.size();
      if (name.empty() || (best != nullptr && name.size() <= best->name.size())) continue;
      if (text.compare(at, name.size(), name) != 0 || is_number(name)) continue;
      if (end < text.size() && is_word(name.back()) && is_word(text[end])) continue;
      if (end < text.size() && text[end] == '(' && find_function(name) != nullptr) continue;
      best = &column;
    }
    return best;
  }

  ExpressionNode use(const std::string& text, std::size_t begin, const RawColumn& column) {
    if (column.text) {
      fail_at(text, begin,
              fmt::format("column \"{}\" holds text (\"{}\" in line {}), expected numbers",
                          column.name, column.example, column.example_line));
    }
    used.push_back(&column);
    return {.op = ExpressionNode::Op::kName, .index = used.size() - 1};
  }

  /// Reports the text up to the next sign that cannot be part of a name as unknown; a "-" can be part of one.
  [[noreturn]] void unknown_column(const std::string& text, std::size_t at) const {
    const std::size_t end = std::min(text.find_first_of("+*/^,()`", at), text.size());
    std::string name(trimmed(std::string_view(text).substr(at, end - at)));
    if (nearest(name).empty()) name = std::string(trimmed(name.substr(0, name.find('-'))));
    no_such_column(text, at, name);
  }

  std::string nearest(const std::string& name) const {
    std::vector<std::string> names;
    for (const RawColumn& column : table_.columns) names.push_back(column.name);
    return nearest_word(name, names);
  }

  [[noreturn]] void no_such_column(const std::string& text, std::size_t at,
                                   const std::string& name) const {
    const std::string near = nearest(name);
    std::string hint = fmt::format("did you mean \"{}\"?", near);
    if (near.empty()) {
      std::string all;
      for (const RawColumn& column : table_.columns) {
        all += (all.empty() ? "" : ", ") + (all.size() > 300 ? "..." : column.name);
        if (all.ends_with(", ...")) break;
      }
      hint = "its columns are: " + all;
    }
    fail_at(text, at, fmt::format("the log has no column \"{}\"; {}", printable(name), hint));
  }

  const RawTable& table_;
};

}  // namespace

std::vector<double> evaluate_expression(const std::string& expression, const RawTable& table,
                                        const FilePlace& place, const std::string& key,
                                        std::set<std::string>* read) {
  try {
    ColumnNames names(table);
    const Expression formula = Expression::parse(
        expression,
        {"expression", [&](const auto& text, auto& at) { return names.read(text, at); }});
    std::vector<double> row(names.used.size()), result(table.rows());
    for (std::size_t k = 0; k < result.size(); ++k) {
      for (std::size_t i = 0; i < row.size(); ++i) row[i] = names.used[i]->values[k];
      result[k] = formula.evaluate<double>({}, row);
    }
    for (const RawColumn* column : names.used) {
      if (read != nullptr) read->insert(column->name);
    }
    return result;
  } catch (const TextError& error) {
    throw InputError(
        place, key,
        fmt::format("\"{}\", character {}: {}", printable(expression), error.column, error.what()));
  }
}

}  // namespace sparflow
