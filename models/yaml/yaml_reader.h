#pragma once
/// A cursor over a YAML file that keeps the place of every value, so that messages can read
/// `crane.yaml:42:9: cylinders[boom].bore: got -0.18, expected a positive diameter [m]`.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "models/machine/machine.h"
#include "models/math/error.h"

namespace YAML {
class Node;
}

namespace sparflow {

/// Meaning and admissible values of a number; error messages take their words from here.
struct Quantity {
  enum class Sign { kAny, kNonNegative, kPositive };
  const char* name = "number";  ///< "diameter"
  const char* unit = "";        ///< "m"; empty for pure numbers
  Sign sign = Sign::kAny;
  double scale = 1.0;  ///< SI value = number in the file * scale
  /// A number in the file of this size or above is a unit error (180 for 0.18 m); 0 = no such bound.
  double implausible_from = 0.0;

  /// "a positive diameter [m]"
  std::string expected() const;
};

class YamlMap;

/// Advice for the user in place of the YAML library's own error message.
/// @param text the file's  @param line of the error, from 0; negative = not known
std::string explained_yaml_error(const std::string& message, const std::string& text, int line);

/// One value of the file with its place, key path and readers. It is cheap to copy and keeps the document alive.
class YamlValue {
 public:
  /// `joints[boom].axis`
  const std::string& path() const { return path_; }
  const FilePlace& place() const { return place_; }
  bool is_map() const;
  bool is_list() const;
  /// The scalar as text; "" when the value is no scalar.
  std::string word() const;
  /// The value as normalised YAML, without comments, line breaks and quotes of the file.
  std::string yaml() const;

  /// The number in SI. Text, units after the number, decimal commas, NaN, infinity and what `what` excludes are errors.
  double number(const Quantity& what) const;
  int integer(const std::string& what, int least) const;
  bool flag() const;
  /// Any non-empty text.
  std::string text(const std::string& what) const;
  /// A name suitable for a CSV column and for `effect:name`: letters, digits, `_`, `-`, `.`, no `base`.
  std::string name(const std::string& what) const;
  /// One of `choices`; the index is returned.
  int choice(const std::vector<std::string>& choices) const;
  /// Three numbers, SI.
  Eigen::Vector3d vector3(const Quantity& what) const;
  /// [lo, hi] with lo < hi, SI.
  Range range(const Quantity& what) const;
  /// Elements; their path names them by `name`, `cylinder`, `joint` or `id` where they have one.
  /// @param most largest number of elements; 0: any number
  std::vector<YamlValue> list(const std::string& what, int most = 0) const;
  /// @param keys all keys that it may contain; empty: the keys are names (of joints, of pumps)
  /// @throws InputError at the first key that is unknown, with the nearest known one, or that occurs twice
  YamlMap map(const std::string& what, const std::vector<std::string>& keys) const;

  /// @throws InputError always, at this value
  [[noreturn]] void fail(const std::string& message) const;
  /// "got <this value>, expected <what>": the common form of the above.
  [[noreturn]] void fail_expected(const std::string& what) const;

 private:
  friend class YamlMap;
  friend YamlValue parse_yaml(const std::string& text, const std::string& file);
  YamlValue(const YAML::Node& node, const std::string& file, std::string path);
  YamlValue child(const YAML::Node& node, std::string path) const;

  std::shared_ptr<const YAML::Node> node_;
  FilePlace place_;
  std::string path_;
};

/// A mapping whose keys have been checked: none is unknown, none occurs twice.
class YamlMap {
 public:
  const FilePlace& place() const { return value_.place(); }
  const std::string& path() const { return value_.path(); }
  /// @throws InputError "missing; expected ..." when the key is absent or has no value
  YamlValue need(const std::string& key, const std::string& expected) const;
  /// Shortcuts for numbers, which are the most frequent values.
  double need_number(const std::string& key, const Quantity& what) const;
  double number_or(const std::string& key, const Quantity& what, double otherwise) const;
  /// Absent key: nullopt. A key without a value is an error.
  std::optional<YamlValue> find(const std::string& key) const;
  bool has(const std::string& key) const { return find(key).has_value(); }
  /// All keys in file order, for mappings whose keys are names.
  std::vector<std::pair<std::string, YamlValue>> entries() const;
  [[noreturn]] void fail(const std::string& message) const { value_.fail(message); }

 private:
  friend class YamlValue;
  YamlMap(YamlValue value, std::vector<std::string> keys);
  void check_keys() const;
  std::string key_path(const std::string& key) const;

  struct Entry {
    std::string key;
    FilePlace place;
    YamlValue value;
  };
  YamlValue value_;
  std::vector<Entry> entries_;
  std::vector<std::string> keys_;
};

/// The only document of a text, within the limits of door.h. @param file name of the text in messages
/// @throws InputError at the place where the text is not valid YAML or beyond the limits, and when it is empty
YAML::Node first_document(const std::string& text, const std::string& file);

/// The document's root value. @param file name of the text in messages
/// @throws InputError at the place where the text is not valid YAML, or when it is empty
YamlValue parse_yaml(const std::string& text, const std::string& file);

/// "; did you mean "max_flow_lpm"?" or "" when nothing is near; knows unit suffixes.
std::string suggestion(const std::string& word, const std::vector<std::string>& candidates);

/// "boom, jib, extension" for messages; "none" when empty.
std::string listed(const std::vector<std::string>& words);

}  // namespace sparflow
