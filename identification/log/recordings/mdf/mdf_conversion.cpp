#include "identification/log/recordings/mdf/mdf_conversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "models/math/error.h"
#include "models/math/nan.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: layout and numbers of the standard
constexpr std::size_t kFirstReference = 4, kValuesAt = 24;
constexpr std::uint64_t kLastType = 11, kValueToText = 7;
/// Deepest nesting of rules within rules.
/// @threshold [1] 2..50; chosen: the standard's examples nest once
constexpr int kDeepest = 8;

/// Pairs (key, value) must have increasing keys, so that the place of a number can be searched.
bool keys_increase(const std::vector<double>& numbers, std::size_t stride) {
  for (std::size_t i = stride; i + 1 < numbers.size(); i += stride) {
    if (!(numbers[i] >= numbers[i - stride])) return false;
  }
  return true;
}

/// X stands for the stored number, also as X1, x and {X}.
std::optional<ExpressionNode> read_x(const std::string& text, std::size_t& at) {
  const std::size_t begin = at;
  if (text[at] != 'X' && text[at] != 'x') return std::nullopt;
  std::size_t end = at + 1;
  if (end < text.size() && text[end] == '1') ++end;
  if (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0)) {
    return std::nullopt;
  }
  at = end;
  ExpressionNode node;
  node.op = ExpressionNode::Op::kName;
  node.begin = begin;
  node.end = end;
  return node;
}

}  // namespace

double MdfConversion::interpolated(double raw) const {
  const std::size_t n = numbers_.size() / 2;
  std::size_t low = 0, high = n;  // the first key above raw lies in low .. high
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (numbers_[2 * middle] > raw ? high : low) = numbers_[2 * middle] > raw ? middle : middle + 1;
  }
  if (low == 0) return numbers_[1];
  if (low == n) return numbers_[2 * n - 1];
  const double a = numbers_[2 * low - 2], b = numbers_[2 * low];
  return numbers_[2 * low - 1] +
         (raw - a) / (b - a) * (numbers_[2 * low + 1] - numbers_[2 * low - 1]);
}

double MdfConversion::nearest(double raw) const {
  const std::size_t n = numbers_.size() / 2;
  std::size_t low = 0, high = n;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (numbers_[2 * middle] > raw ? high : low) = numbers_[2 * middle] > raw ? middle : middle + 1;
  }
  if (low == 0) return numbers_[1];
  if (low == n) return numbers_[2 * n - 1];
  // In the middle between two keys the lower one counts.
  const bool upper = numbers_[2 * low] - raw < raw - numbers_[2 * low - 2];
  return numbers_[upper ? 2 * low + 1 : 2 * low - 1];
}

double MdfConversion::range(double raw, bool whole) const {
  // Triples (from, to, value) in order of `from`, and the value of all others at the end.
  const std::size_t n = numbers_.size() / 3;
  std::size_t low = 0, high = n;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    (numbers_[3 * middle] > raw ? high : low) = numbers_[3 * middle] > raw ? middle : middle + 1;
  }
  if (low == 0) return numbers_.back();
  const double to = numbers_[3 * low - 2];
  return raw < to || (whole && raw <= to) ? numbers_[3 * low - 1] : numbers_.back();
}

double MdfConversion::state(double raw, bool whole) const {
  const std::size_t n = rules_.size() - 1;  // the last rule is that of all other numbers
  std::size_t found = n;
  for (std::size_t i = 0; i < n && found == n; ++i) {
    if (kind_ == Kind::kKeys) {
      if (numbers_[i] == raw) found = i;
    } else if (raw >= numbers_[2 * i] &&
               (raw < numbers_[2 * i + 1] || (whole && raw <= numbers_[2 * i + 1]))) {
      found = i;
    }
  }
  return rules_[found] == nullptr ? kNaN : rules_[found]->value(raw, whole);
}

double MdfConversion::value(double raw, bool whole) const {
  switch (kind_) {
    case Kind::kIdentity:
      return raw;
    case Kind::kLinear:
      return numbers_[0] + numbers_[1] * raw;
    case Kind::kRational:
      return (numbers_[0] * raw * raw + numbers_[1] * raw + numbers_[2]) /
             (numbers_[3] * raw * raw + numbers_[4] * raw + numbers_[5]);
    case Kind::kFormula: {
      const std::array<double, 1> x = {raw};
      return formula_.evaluate<double>(x, {});
    }
    case Kind::kTable:
      return interpolated(raw);
    case Kind::kNearest:
      return nearest(raw);
    case Kind::kRange:
      return range(raw, whole);
    case Kind::kKeys:
    case Kind::kKeyRanges:
      break;
  }
  return state(raw, whole);
}

void MdfConversions::read_formula(const MdfBlock& block, MdfConversion* rule) {
  const std::string text = file_.text(block.link(kFirstReference));
  Expression::Grammar grammar;
  grammar.what = "formula";
  grammar.name = read_x;
  try {
    rule->formula_ = Expression::parse(text, grammar);
  } catch (const TextError& error) {
    rule->refusal_ =
        fmt::format("its formula \"{}\" is not understood ({})", printable(text), error.what());
  }
}

void MdfConversions::read_states(const MdfBlock& block, int depth, MdfConversion* rule) {
  const std::size_t references = file_.number(block, 4, 2);
  bool numbers = false;
  rule->rules_.reserve(references + 1);
  for (std::size_t i = 0; i < references; ++i) {
    const std::uint64_t at = block.link(kFirstReference + i);
    std::shared_ptr<const MdfConversion> inner;
    if (at != 0 && file_.block(at, "").id == "CC") {
      inner = read(at, depth + 1);
      if (!inner->refusal().empty()) inner = nullptr;
      numbers = numbers || inner != nullptr;
    }
    rule->rules_.push_back(std::move(inner));
  }
  rule->has_texts_ = true;
  const std::size_t keys =
      rule->numbers_.size() / (rule->kind_ == MdfConversion::Kind::kKeys ? 1 : 2);
  rule->rules_.resize(keys + 1);
  if (!numbers) {
    // Names of all states and nothing else: the number itself is the state.
    rule->kind_ = MdfConversion::Kind::kIdentity;
    rule->rules_.clear();
  }
}

std::shared_ptr<const MdfConversion> MdfConversions::read(std::uint64_t at, int depth) {
  using Kind = MdfConversion::Kind;
  if (const auto found = known_.find(at); found != known_.end()) return found->second;
  auto rule = std::make_shared<MdfConversion>();
  if (at == 0) return rule;
  const MdfBlock block = file_.block(at, "CC");
  if (depth > kDeepest) file_.fail(block, "conversion rules contain each other too deeply");
  const std::uint64_t type = file_.number(block, 0, 1);
  const std::uint64_t references = file_.number(block, 4, 2), count = file_.number(block, 6, 2);
  if (type > kLastType) {
    file_.fail(block, fmt::format("conversion of the unknown type {}", type));
  }
  if (block.link_count() < kFirstReference + references) {
    file_.fail(block, fmt::format("{} references and {} links", references, block.link_count()));
  }
  rule->numbers_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    rule->numbers_.push_back(file_.real(block, kValuesAt + 8 * i));
  }
  rule->unit_ = file_.text(block.link(1));
  // no threshold: the standard's types, and how many numbers each has
  constexpr std::array<Kind, 9> kKinds = {Kind::kIdentity, Kind::kLinear, Kind::kRational,
                                          Kind::kFormula,  Kind::kTable,  Kind::kNearest,
                                          Kind::kRange,    Kind::kKeys,   Kind::kKeyRanges};
  if (type >= kKinds.size()) {
    rule->refusal_ = "its values are texts";
    return known_[at] = rule;
  }
  rule->kind_ = kKinds[type];
  const auto need = [&](bool fits) {
    if (fits) return;
    file_.fail(block, fmt::format("a conversion of type {} with {} numbers and {} references; the "
                                  "file is damaged",
                                  type, count, references));
  };
  switch (rule->kind_) {
    case Kind::kLinear:
      need(count >= 2);
      break;
    case Kind::kRational:
      need(count >= 6);
      break;
    case Kind::kFormula:
      need(references >= 1);
      read_formula(block, rule.get());
      break;
    case Kind::kTable:
    case Kind::kNearest:
      need(count >= 2 && count % 2 == 0 && keys_increase(rule->numbers_, 2));
      break;
    case Kind::kRange:
      need(count >= 1 && count % 3 == 1 && keys_increase(rule->numbers_, 3));
      break;
    case Kind::kKeys:
    case Kind::kKeyRanges:
      // The last reference, the rule of all other numbers, may be missing.
      need(count / (type == kValueToText ? 1U : 2U) <= references &&
           count / (type == kValueToText ? 1U : 2U) + 1 >= references);
      read_states(block, depth, rule.get());
      break;
    case Kind::kIdentity:
      break;
  }
  return known_[at] = rule;
}

}  // namespace sparflow
