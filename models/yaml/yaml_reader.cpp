#include "models/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "models/math/text_encoding.h"
#include "models/yaml/yaml_guard.h"

namespace sparflow {
namespace {

FilePlace place_of(const YAML::Mark& mark, const std::string& file) {
  if (mark.is_null()) return {file, 0, 0};
  return {file, mark.line + 1, mark.column + 1};
}

/// The value in the form in which the user recognises it in a message.
std::string shown(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar: {
      const std::string word = printable(node.Scalar());
      const bool plain =
          !word.empty() && word.find_first_not_of("0123456789+-.eE") == std::string::npos;
      return plain ? word : fmt::format("\"{}\"", word);
    }
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node.size());
    case YAML::NodeType::Map:
      return "a mapping {...}";
    default:
      return "nothing";
  }
}

struct ParsedNumber {
  double value = 0.0;
  std::string rest;  ///< text after the number
  bool ok = false;
};

ParsedNumber parse_number(const std::string& word) {
  ParsedNumber parsed;
  const char* begin = word.data();
  const char* end = begin + word.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, parsed.value);
  if (error == std::errc::result_out_of_range) {
    parsed.value = std::numeric_limits<double>::infinity();
  } else if (error != std::errc()) {
    return parsed;
  }
  parsed.ok = true;
  parsed.rest.assign(stop, end);
  return parsed;
}

bool means_not_finite(const std::string& word) {
  static const std::array<const char*, 14> kWords = {".nan", ".NaN",  ".NAN",  ".inf",  ".Inf",
                                                     ".INF", "+.inf", "-.inf", "-.Inf", "-.INF",
                                                     "nan",  "inf",   "-inf",  "NaN"};
  return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
}

/// Line `line` (from 0) of `text`, empty when there is none.
std::string line_of(const std::string& text, int line) {
  std::size_t start = 0;
  for (int i = 0; i < line && start != std::string::npos; ++i) {
    start = text.find('\n', start);
    if (start != std::string::npos) ++start;
  }
  if (line < 0 || start == std::string::npos) return "";
  return text.substr(start, text.find('\n', start) - start);
}

/// Whether the first line that is neither empty nor a comment begins with blanks.
bool first_key_indented(const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t content = text.find_first_not_of(" \t\r", at);
    if (content < end && text[content] != '#') return content > at;
    at = end + 1;
  }
  return false;
}

bool tab_indents(const std::string& text, int line) {
  const std::string l = line_of(text, line);
  return l.substr(0, l.find_first_not_of(" \t")).find('\t') != std::string::npos;
}

std::string without_unit(const std::string& key) {
  static const std::array<const char*, 12> kSuffixes = {
      "_lpm", "_bar", "_kg", "_m", "_s", "_W", "_C", "_rad", "_Pa", "_mm", "_deg", "_kW"};
  for (const char* suffix : kSuffixes) {
    const std::string s = suffix;
    if (key.size() > s.size() && key.compare(key.size() - s.size(), s.size(), s) == 0) {
      return key.substr(0, key.size() - s.size());
    }
  }
  return key;
}

}  // namespace

std::string explained_yaml_error(const std::string& message, const std::string& text, int line) {
  if (tab_indents(text, line)) return "a tab indents this line; YAML needs spaces";
  static const std::array<std::array<const char*, 2>, 12> kTable = {{
      {YAML::ErrorMsg::TAB_IN_INDENTATION, "a tab indents this line; YAML needs spaces"},
      {YAML::ErrorMsg::END_OF_MAP_FLOW,
       "a `{` opened before here is not closed, or a comma is missing; write {key: value, key: "
       "value}"},
      {YAML::ErrorMsg::END_OF_SEQ_FLOW,
       "a `[` opened before here is not closed, or a comma is missing; write [1, 2, 3]"},
      {YAML::ErrorMsg::FLOW_END, "a closing `}` or `]` without its opening one; remove it"},
      {YAML::ErrorMsg::END_OF_MAP,
       "this line fits no mapping; check its indentation: every key of a mapping starts in the "
       "same "
       "column and ends with a colon"},
      {YAML::ErrorMsg::END_OF_SEQ,
       "this line fits no list; check its indentation: every `-` of a list starts in the same "
       "column, every key below it in the column of its first key"},
      {YAML::ErrorMsg::MAP_VALUE,
       "a colon where none can stand; check the indentation or put the text in quotes"},
      {YAML::ErrorMsg::MAP_KEY, "a key where none can stand; check the indentation"},
      {YAML::ErrorMsg::BLOCK_ENTRY, "a `-` where no list can start; check the indentation"},
      {YAML::ErrorMsg::EOF_IN_SCALAR, "a quoted text is not closed; add the missing quote"},
      {YAML::ErrorMsg::DOC_IN_SCALAR,
       "a quoted text opened before here is not closed; add the missing quote"},
      {YAML::ErrorMsg::UNKNOWN_TOKEN, "a character YAML cannot read here; put the text in quotes"},
  }};
  for (const auto& [theirs, ours] : kTable) {
    if (message == theirs) return ours;
  }
  // The rest (anchors, aliases, tags, escapes, directives) are special characters in text that was meant as plain.
  return fmt::format(
      "not readable as YAML ({}); if this is plain text, put it in single quotes ('...')", message);
}

std::string Quantity::expected() const {
  std::string text = sign == Sign::kPositive      ? fmt::format("a positive {}", name)
                     : sign == Sign::kNonNegative ? fmt::format("a {} that is not negative", name)
                     : std::string("aeiou").find(name[0]) != std::string::npos
                         ? fmt::format("an {}", name)
                         : fmt::format("a {}", name);
  if (unit[0] != '\0') text += fmt::format(" [{}]", unit);
  return text;
}

std::string suggestion(const std::string& word, const std::vector<std::string>& candidates) {
  const std::size_t space = word.find(' ');
  const std::string first = word.substr(0, space);
  if (space != std::string::npos &&
      std::find(candidates.begin(), candidates.end(), first) != candidates.end())
    return fmt::format("; a colon is missing: \"{}: {}\"", first,
                       printable(word.substr(space + 1)));
  for (const std::string& candidate : candidates) {  // the right key with a wrong unit or none
    if (without_unit(candidate) == without_unit(word)) {
      return fmt::format("; did you mean \"{}\"?", candidate);
    }
  }
  const std::string nearest = nearest_word(word, candidates);
  return nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest);
}

std::string listed(const std::vector<std::string>& words) {
  return words.empty() ? "none" : fmt::format("{}", fmt::join(words, ", "));
}

YamlValue::YamlValue(const YAML::Node& node, const std::string& file, std::string path)
    : node_(std::make_shared<const YAML::Node>(node)),
      place_(place_of(node.Mark(), file)),
      path_(std::move(path)) {}

YamlValue YamlValue::child(const YAML::Node& node, std::string path) const {
  YamlValue value(node, place_.file, std::move(path));
  if (value.place_.line == 0) value.place_ = place_;
  return value;
}

bool YamlValue::is_map() const { return node_->IsMap(); }
bool YamlValue::is_list() const { return node_->IsSequence(); }
std::string YamlValue::word() const { return node_->IsScalar() ? node_->Scalar() : ""; }

std::string YamlValue::yaml() const {
  YAML::Emitter out;
  out << *node_;
  return out.c_str();
}

void YamlValue::fail(const std::string& message) const { throw InputError(place_, path_, message); }

void YamlValue::fail_expected(const std::string& what) const {
  fail(fmt::format("got {}, expected {}", shown(*node_), what));
}

double YamlValue::number(const Quantity& what) const {
  if (!node_->IsScalar()) fail_expected(what.expected());
  const std::string& word = node_->Scalar();
  if (means_not_finite(word)) {
    fail(fmt::format("got {}, expected {}; give a finite number", word, what.expected()));
  }
  const ParsedNumber parsed = parse_number(word);
  if (!parsed.ok) fail_expected(what.expected());
  if (!parsed.rest.empty()) {
    if (parsed.rest[0] == ',') {
      fail(fmt::format("got \"{}\", expected {}; write a decimal point, not a comma", word,
                       what.expected()));
    }
    fail(fmt::format("got \"{}\", expected {}; write the number alone{}", word, what.expected(),
                     what.unit[0] != '\0' ? fmt::format(", in {}", what.unit) : ""));
  }
  if (!std::isfinite(parsed.value)) {
    fail(fmt::format("got {}, expected {}; give a finite number", word, what.expected()));
  }
  if ((what.sign == Quantity::Sign::kPositive && !(parsed.value > 0.0)) ||
      (what.sign == Quantity::Sign::kNonNegative && !(parsed.value >= 0.0))) {
    fail(fmt::format("got {}, expected {}", word, what.expected()));
  }
  if (what.implausible_from > 0.0 && std::abs(parsed.value) >= what.implausible_from) {
    const std::string remedy =
        std::string(what.unit) == "m"
            ? fmt::format("in millimetres? then write {}", parsed.value / 1e3)
            : std::string("is it given in another unit?");
    fail(fmt::format("got {}, expected {} below {:g}; {}", word, what.expected(),
                     what.implausible_from, remedy));
  }
  return parsed.value * what.scale;
}

int YamlValue::integer(const std::string& what, int least) const {
  const std::string expected = fmt::format("{}, a whole number of at least {}", what, least);
  if (!node_->IsScalar()) fail_expected(expected);
  const std::string& word = node_->Scalar();
  int value = 0;
  const char* begin = word.data() + (!word.empty() && word[0] == '+' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || value < least) fail_expected(expected);
  return value;
}

bool YamlValue::flag() const {
  const std::string w = word();
  if (w == "true" || w == "True" || w == "yes" || w == "on") return true;
  if (w == "false" || w == "False" || w == "no" || w == "off") return false;
  fail_expected("true or false");
}

std::string YamlValue::text(const std::string& what) const {
  if (!node_->IsScalar() || node_->Scalar().empty()) fail_expected(what);
  return node_->Scalar();
}

std::string YamlValue::name(const std::string& what) const {
  const std::string word = text(what);
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char c = word[i];
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '.') {
      // a character of several bytes is named whole
      std::size_t character = 1;
      while (i + character < word.size() && (word[i + character] & 0xC0) == 0x80) ++character;
      fail(
          fmt::format("got \"{}\", expected {} of letters, digits, `_`, `-` and `.` (it names log "
                      "columns); replace \"{}\"",
                      printable(word), what, printable(word.substr(i, character))));
    }
  }
  if (word == "base") {
    fail(fmt::format("got \"base\", which names the machine's base frame; expected {} of its own",
                     what));
  }
  return word;
}

int YamlValue::choice(const std::vector<std::string>& choices) const {
  const std::string found = word();
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (found == choices[i]) return static_cast<int>(i);
  }
  fail(fmt::format("got {}, expected one of {}{}", shown(*node_), listed(choices),
                   suggestion(found, choices)));
}

Eigen::Vector3d YamlValue::vector3(const Quantity& what) const {
  const std::string expected = fmt::format("three numbers [x, y, z], each {}", what.expected());
  if (!node_->IsSequence() || node_->size() != 3) fail_expected(expected);
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    v[i] =
        child((*node_)[static_cast<std::size_t>(i)], fmt::format("{}[{}]", path_, i)).number(what);
  }
  return v;
}

Range YamlValue::range(const Quantity& what) const {
  const std::string expected = fmt::format("a range [lo, hi], each {}", what.expected());
  if (!node_->IsSequence() || node_->size() != 2) fail_expected(expected);
  Range r;
  r.lo = child((*node_)[0], path_ + "[0]").number(what);
  r.hi = child((*node_)[1], path_ + "[1]").number(what);
  if (!(r.lo < r.hi)) {
    fail(fmt::format("got [{}, {}], expected [lo, hi] with lo < hi{}", (*node_)[0].Scalar(),
                     (*node_)[1].Scalar(), r.lo > r.hi ? "; swap the two" : ""));
  }
  return r;
}

std::vector<YamlValue> YamlValue::list(const std::string& what, int most) const {
  if (!node_->IsSequence()) fail_expected(fmt::format("a list of {}", what));
  if (most > 0 && node_->size() > static_cast<std::size_t>(most)) {
    fail_expected(fmt::format("at most {} {}", most, what));
  }
  std::vector<YamlValue> values;
  std::size_t index = 0;
  for (const YAML::Node& element : *node_) {
    std::string label = fmt::format("{}", index++);
    if (element.IsMap()) {
      for (const char* key : {"name", "cylinder", "joint", "id"}) {
        const YAML::Node named = element[key];
        if (named && named.IsScalar() && !named.Scalar().empty()) {
          label = printable(named.Scalar());
          break;
        }
      }
    }
    values.push_back(child(element, fmt::format("{}[{}]", path_, label)));
  }
  return values;
}

YamlMap YamlValue::map(const std::string& what, const std::vector<std::string>& keys) const {
  if (!node_->IsMap()) fail_expected(what);
  return YamlMap(*this, keys);
}

YamlMap::YamlMap(YamlValue value, std::vector<std::string> keys)
    : value_(std::move(value)), keys_(std::move(keys)) {
  std::unordered_map<std::string, int> lines;  // of the keys so far
  for (const auto& pair : *value_.node_) {
    if (!pair.first.IsScalar()) {
      value_.child(pair.first, value_.path_).fail("a key must be a plain word");
    }
    const std::string key = pair.first.Scalar();
    FilePlace place = place_of(pair.first.Mark(), value_.place_.file);
    const auto [earlier, first] = lines.emplace(key, place.line);
    if (!first) {
      throw InputError(place, value_.path_,
                       fmt::format("key \"{}\" occurs here and on line {}; keep one of them",
                                   printable(key), earlier->second));
    }
    YamlValue child = value_.child(pair.second, key_path(key));
    if (pair.second.IsNull()) child.place_ = place;  // A missing value has no place of its own.
    entries_.push_back({key, std::move(place), std::move(child)});
  }
  if (!keys_.empty()) check_keys();
}

void YamlMap::check_keys() const {
  const auto present = [&](const std::string& key) {
    return std::any_of(entries_.begin(), entries_.end(),
                       [&](const Entry& e) { return e.key == key; });
  };
  for (const Entry& entry : entries_) {
    if (std::find(keys_.begin(), keys_.end(), entry.key) != keys_.end()) continue;
    std::vector<std::string> absent;  // Keys that are present already are not suggested.
    std::copy_if(keys_.begin(), keys_.end(), std::back_inserter(absent),
                 [&](const std::string& key) { return !present(key); });
    const std::string hint = suggestion(entry.key, absent);
    throw InputError(entry.place, value_.path_,
                     fmt::format("unknown key \"{}\"{}", printable(entry.key),
                                 hint.empty() ? "; known here: " + listed(keys_) : hint));
  }
}

std::string YamlMap::key_path(const std::string& key) const {
  return value_.path_.empty() ? printable(key) : value_.path_ + "." + printable(key);
}

std::optional<YamlValue> YamlMap::find(const std::string& key) const {
  SPARFLOW_CHECK(keys_.empty() || std::find(keys_.begin(), keys_.end(), key) != keys_.end(),
                 "a key is read that is not declared: " + key);
  for (const Entry& entry : entries_) {
    if (entry.key != key) continue;
    if (entry.value.node_->IsNull()) entry.value.fail("has no value; give one or remove the key");
    return entry.value;
  }
  return std::nullopt;
}

YamlValue YamlMap::need(const std::string& key, const std::string& expected) const {
  if (auto value = find(key)) return *value;
  throw InputError(value_.place_, key_path(key), fmt::format("missing; expected {}", expected));
}

double YamlMap::need_number(const std::string& key, const Quantity& what) const {
  return need(key, what.expected()).number(what);
}

double YamlMap::number_or(const std::string& key, const Quantity& what, double otherwise) const {
  const auto value = find(key);
  return value ? value->number(what) : otherwise;
}

std::vector<std::pair<std::string, YamlValue>> YamlMap::entries() const {
  std::vector<std::pair<std::string, YamlValue>> all;
  all.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    if (entry.value.node_->IsNull()) entry.value.fail("has no value; give one or remove the key");
    all.emplace_back(entry.key, entry.value);
  }
  return all;
}

YAML::Node first_document(const std::string& text, const std::string& file) {
  try {
    // With the end mark yaml-cpp reports a quote that is not closed; without it the rest would be taken as text.
    const std::string ended = text + "\n...\n";
    const YamlOutline outline = yaml_outline(ended, file);
    if (outline.empty && !outline.second) {
      throw InputError({file, 0, 0}, "", "the file is empty; expected `key: value` lines");
    }
    if (outline.second) {
      const bool marked = text.starts_with("---") || text.find("\n---") != std::string::npos;
      throw InputError(outline.second_place, "",
                       marked ? "a second document starts here; remove the `---` line"
                       : first_key_indented(text)
                           ? "this line is indented less than the first key; check its "
                             "indentation: every key of the file starts in the first column"
                           : "this fits no mapping; is the file YAML?");
    }
    return YAML::Load(ended);
  } catch (const YAML::Exception& error) {
    throw InputError(place_of(error.mark, file), "",
                     explained_yaml_error(error.msg, text, error.mark.line));
  }
}

YamlValue parse_yaml(const std::string& text, const std::string& file) {
  return YamlValue(first_document(text, file), file, "");
}

}  // namespace sparflow
