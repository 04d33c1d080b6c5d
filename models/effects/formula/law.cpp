#include "models/effects/formula/law.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>

#include "models/yaml/yaml_reader.h"

namespace sparflow {
namespace {

using Op = ExpressionNode::Op;

/// Largest number of parameters of a law.
/// @threshold [1] 1..20; derived: all groups of them are tried for linearity, a thousand
constexpr std::size_t kMaxParameters = 10;

/// Reads `v`, `q.boom`, `q.'jib-2'` (returned without its quotes); "" where no name begins.
std::string read_word(const std::string& text, std::size_t& at) {
  const auto in_word = [&](std::size_t k) {
    return k < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[k])) != 0 || text[k] == '_');
  };
  std::string word;
  if (std::isdigit(static_cast<unsigned char>(text[at])) != 0) return word;
  while (in_word(at)) word += text[at++];
  while (!word.empty() && at + 1 < text.size() && text[at] == '.') {
    const char after = text[at + 1];
    if (after == '\'' || after == '"') {
      const std::size_t close = text.find(after, at + 2);
      if (close == std::string::npos) fail_at(text, at + 1, "this quote is never closed");
      word += '.' + text.substr(at + 2, close - at - 2);
      at = close + 1;
    } else if (in_word(at + 1)) {
      do word += text[at++];
      while (in_word(at));
    } else {
      break;
    }
  }
  return word;
}

/// Says what an unknown name could mean.
std::string unknown_name(const std::string& word, const std::vector<Symbol>& symbols) {
  if (find_function(word) != nullptr) return fmt::format("{0} is a function; write {0}(...)", word);
  std::vector<std::string> names;
  for (const Symbol& s : symbols) {
    // q.'jib-2' for a joint whose name would otherwise be read as a difference
    std::string name = s.name;
    const std::size_t dot = name.find('.');
    if (dot != name.npos && name.find('-') != name.npos) name.insert(dot + 1, 1, '\'') += '\'';
    names.push_back(name);
  }
  std::vector<std::string> candidates = names;
  for (const ExpressionFunction& f : expression_functions()) candidates.emplace_back(f.name);
  std::string hint = word == "pi" ? "; write 3.14159265" : suggestion(word, candidates);
  if (hint.empty() || word.size() == 1) hint = "; known here: " + listed(names);
  return fmt::format("unknown name \"{}\"{}", word, hint);
}

bool means(const Symbol& symbol, const std::string& word) {
  const std::string& name = symbol.name;
  return name == word || (name.ends_with(".*") && word.size() >= name.size() &&
                          word.starts_with(name.substr(0, name.size() - 1)));
}

/// Reads the names of a law and collects them. @param symbols parameters and signals that it may contain
/// @param used its parameters and those signals that were read: a name's index is its place there
std::optional<ExpressionNode> read_name(const std::string& text, std::size_t& at,
                                        const std::vector<Symbol>& symbols,
                                        std::vector<Symbol>& used) {
  const std::size_t begin = at;
  const std::string word = read_word(text, at);
  if (word.empty()) return std::nullopt;
  const std::size_t behind = skip_blanks(text, at);
  const char next = behind < text.size() ? text[behind] : '\0';
  const auto found =
      std::find_if(symbols.begin(), symbols.end(), [&](const Symbol& s) { return means(s, word); });
  const bool known = found != symbols.end();
  if (next == '(') {
    if (known) fail_at(text, begin, fmt::format("{0} is no function; write {0} * (...)", word));
    at = begin;
    return std::nullopt;
  }
  if (!known) fail_at(text, begin, unknown_name(word, symbols));
  if (!found->refused.empty()) fail_at(text, begin, found->refused);
  if (next == '[') {
    const Unit& unit = found->unit;
    fail_at(text, behind,
            fmt::format("a unit in brackets follows a number only; {} {}", word,
                        !found->unit_known      ? "comes in the unit of its joint"
                        : unit.reading          ? "comes in [degC]"
                        : unit.dimension.none() ? "is a pure number"
                                                : "comes in " + in_brackets(unit.dimension)));
  }
  const auto place =
      std::find_if(used.begin(), used.end(), [&](const Symbol& s) { return s.name == word; });
  const auto index = static_cast<std::size_t>(place - used.begin());
  if (place == used.end()) used.push_back({word, found->unit, found->unit_known});
  return ExpressionNode{.op = Op::kName, .index = index};
}

}  // namespace

Law Law::compile(const std::string& text, const std::vector<Symbol>& signals,
                 const std::vector<Symbol>& parameters) {
  if (skip_blanks(text, 0) == text.size()) {
    fail_at(text, 0, "the law is empty; expected a formula such as Fc * sign(v)");
  }
  if (parameters.size() > kMaxParameters) {
    fail_at(text, 0,
            fmt::format("a law has at most {} parameters, this one has {}", kMaxParameters,
                        parameters.size()));
  }
  std::vector<Symbol> used = parameters, symbols = parameters;
  symbols.insert(symbols.end(), signals.begin(), signals.end());
  const auto name = [&](const std::string& all, std::size_t& at) {
    return read_name(all, at, symbols, used);
  };
  Law law;
  CheckedUnits checked = check_units(Expression::parse(text, {"law", name, true}), used);
  law.formula_ = std::move(checked.folded);
  law.dimension_ = checked.dimension;
  law.dimension_known_ = checked.known;
  for (std::size_t i = 0; i < used.size(); ++i) {
    (i < parameters.size() ? law.parameters_ : law.signals_).push_back(used[i].name);
  }
  return law;
}

bool Law::uses_parameter(const std::string& name) const {
  return std::any_of(formula_.nodes().begin(), formula_.nodes().end(), [&](const auto& node) {
    return node.op == Op::kName && node.index < parameters_.size() &&
           parameters_[node.index] == name;
  });
}

std::vector<std::string> Law::proportional_parameters() const {
  // Degree of each part in the parameters of a group: 0 without them, 1 proportional to them, 2 anything else.
  const auto degree = [&](unsigned group) {
    std::vector<int> stack;
    for (const ExpressionNode& node : formula_.nodes()) {
      const int b = node.operands() > 0 ? stack.back() : 0;
      const int a = node.operands() == 2 ? stack[stack.size() - 2] : b;
      const bool free = a == 0 && b == 0;
      stack.resize(stack.size() - node.operands());
      int result = free ? 0 : 2;
      if (node.op == Op::kName && node.index < parameters_.size()) {
        result = static_cast<int>((group >> node.index) & 1u);
      } else if (node.op == Op::kAdd || node.op == Op::kSubtract) {
        result = a == b ? a : 2;
      } else if (node.op == Op::kMultiply) {
        result = std::min(a + b, 2);
      } else if ((node.op == Op::kDivide && b == 0) || node.op == Op::kNegate ||
                 (node.op == Op::kRaise && node.number == 1.0)) {
        result = a;
      }
      stack.push_back(result);
    }
    return stack.back();
  };
  unsigned best = 0;  // of groups of equal size the one with earlier parameters, lower bits
  for (unsigned group = 1; group < 1u << parameters_.size(); ++group) {
    if (std::popcount(group) > std::popcount(best) && degree(group) == 1) best = group;
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    if (((best >> i) & 1u) != 0 && uses_parameter(parameters_[i])) names.push_back(parameters_[i]);
  }
  return names;
}

}  // namespace sparflow
