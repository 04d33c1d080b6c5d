#include "identification/log/recordings/mcap/ros2_definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <map>
#include <optional>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

using Kind = Ros2Field::Kind;
using Repeat = Ros2Field::Repeat;

// no threshold: words of the language; `char` and `byte` are whole numbers of eight bits without sign
constexpr std::array<std::pair<std::string_view, Kind>, 14> kPrimitives = {
    {{"bool", Kind::kBool},
     {"byte", Kind::kUint8},
     {"char", Kind::kUint8},
     {"int8", Kind::kInt8},
     {"uint8", Kind::kUint8},
     {"int16", Kind::kInt16},
     {"uint16", Kind::kUint16},
     {"int32", Kind::kInt32},
     {"uint32", Kind::kUint32},
     {"int64", Kind::kInt64},
     {"uint64", Kind::kUint64},
     {"float32", Kind::kFloat32},
     {"float64", Kind::kFloat64},
     {"string", Kind::kString}}};
constexpr std::string_view kBlank = " \t\r";

/// package/msg/Type and package/Type are the same.
std::string short_name(std::string_view name) {
  std::string out(name);
  const std::size_t middle = out.find("/msg/");
  if (middle != out.npos) out.erase(middle, 4);  // no threshold: the length of "/msg"
  return out;
}

bool is_word(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

/// Fields of this name hold names of the elements of the sequences beside them, as in sensor_msgs/JointState.
bool names_elements(const Ros2Field& field) {
  return field.kind == Kind::kString && field.repeat != Repeat::kOne &&
         (field.name == "name" || field.name == "names" || field.name.ends_with("_names"));
}

/// A type as it is written; its fields' own types are not looked up yet.
struct WrittenField {
  Ros2Field field;
  std::string type;
  int line = 0;
};
struct WrittenType {
  std::string name;
  std::vector<WrittenField> fields;
};

[[noreturn]] void refuse(int line, const std::string& message) { throw TextError(line, message); }

class DefinitionText {
 public:
  DefinitionText(std::string_view name, std::string_view text) : rest_(text) {
    types_.push_back({short_name(name), {}});
  }

  std::vector<WrittenType> read() {
    while (next_line()) {
      const std::size_t begin = line_.find_first_not_of(kBlank);
      if (begin == line_.npos || line_[begin] == '#') continue;
      std::string_view text = line_.substr(begin);
      if (text.find_first_not_of("= \t\r") == text.npos) {
        begin_type();
      } else {
        read_field(text);
      }
    }
    return std::move(types_);
  }

 private:
  bool next_line() {
    if (rest_.empty()) return false;
    line_ = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(line_.size() + 1, rest_.size()));
    ++number_;
    return true;
  }

  void begin_type() {
    constexpr std::string_view kMark = "MSG:";
    const bool any = next_line();
    const std::size_t begin = line_.find_first_not_of(kBlank);
    if (!any || begin == line_.npos || !line_.substr(begin).starts_with(kMark))
      refuse(number_, "expected `MSG: package/Type` below a line of =");
    std::string_view name = line_.substr(begin + kMark.size());
    name.remove_prefix(std::min(name.find_first_not_of(kBlank), name.size()));
    name = name.substr(0, name.find_last_not_of(kBlank) + 1);
    if (name.empty()) refuse(number_, "expected a type's name behind `MSG:`");
    types_.push_back({short_name(name), {}});
  }

  void read_field(std::string_view text) {
    WrittenField written;
    written.line = number_;
    const std::size_t end = std::min(text.find_first_of(kBlank), text.size());
    written.type = text.substr(0, end);
    text.remove_prefix(end);
    text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
    const std::size_t stop = std::min(text.find_first_of(" \t\r=#"), text.size());
    written.field.name = text.substr(0, stop);
    text.remove_prefix(stop);
    text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
    if (!is_word(written.field.name)) {
      refuse(number_, fmt::format("got \"{}\", expected `type name`", printable(line_)));
    }
    if (text.starts_with('=')) return;  // a constant; no message holds it
    read_repeat(&written);
    types_.back().fields.push_back(std::move(written));
  }

  /// Takes `[]`, `[3]` or `[<=3]`, and the `<=10` of a text, from a type's end.
  void read_repeat(WrittenField* written) const {
    std::string& type = written->type;
    const std::size_t open = type.find('[');
    if (open != type.npos) {
      const std::string_view inside = std::string_view(type).substr(open + 1);
      if (!inside.ends_with(']'))
        refuse(number_, fmt::format("got \"{}\", expected ]", printable(type)));
      const std::string_view count = inside.substr(0, inside.size() - 1);
      written->field.repeat = Repeat::kSequence;
      if (!count.empty() && !count.starts_with("<=")) {
        const auto [at, error] =
            std::from_chars(count.data(), count.data() + count.size(), written->field.count);
        if (error != std::errc{} || at != count.data() + count.size() ||
            written->field.count == 0) {
          refuse(number_, fmt::format("got \"{}\", expected a number of elements above 0",
                                      printable(count)));
        }
        written->field.repeat = Repeat::kArray;
      }
      type.resize(open);
    }
    if (const std::size_t bound = type.find("<="); bound != type.npos) type.resize(bound);
  }

  std::string_view rest_, line_;
  int number_ = 0;
  std::vector<WrittenType> types_;
};

/// Looks up the types that are used, beginning with the message.
class DefinitionTypes {
 public:
  DefinitionTypes(std::vector<WrittenType> written, int deepest)
      : written_(std::move(written)), deepest_(deepest) {
    for (std::size_t i = 0; i < written_.size(); ++i)
      index_.try_emplace(written_[i].name, Known{i, false, {}});
  }

  Ros2Definition read() {
    // The message itself may be described again under its name; the text that comes first counts.
    make(written_.front().name, &index_.at(written_.front().name), 0);
    return std::move(definition_);
  }

 private:
  struct Known {
    std::size_t written = 0;
    bool open = false;  ///< its fields are being looked up
    std::optional<std::size_t> made;
  };

  std::size_t make(const std::string& name, Known* known, int line) {
    if (known->made) return *known->made;
    if (known->open) refuse(line, fmt::format("type {} contains itself", printable(name)));
    if (++depth_ > deepest_) refuse(line, "types contain each other too deeply");
    known->open = true;
    const std::size_t place = definition_.types.size();
    definition_.types.emplace_back();
    Ros2Type type;
    type.name = name;
    for (const WrittenField& written : written_[known->written].fields) {
      Ros2Field field = written.field;
      look_up(written, name, &field);
      field.names = names_elements(field);
      add_size(field, &type);
      type.fields.push_back(std::move(field));
    }
    // A structure without fields has a byte, because IDL knows no empty structures.
    if (type.fields.empty()) type.least_bytes = 1;
    definition_.types[place] = std::move(type);
    known->open = false;
    known->made = place;
    --depth_;
    return place;
  }

  void look_up(const WrittenField& written, const std::string& user, Ros2Field* field) {
    const auto primitive = std::find_if(kPrimitives.begin(), kPrimitives.end(), [&](const auto& p) {
      return p.first == std::string_view(written.type);
    });
    if (primitive != kPrimitives.end()) {
      field->kind = primitive->second;
      return;
    }
    if (written.type == "wstring")
      refuse(written.line, "its wide texts (wstring) have no common form; record it without");
    std::string name = short_name(written.type);
    if (name == "Header") name = "std_msgs/Header";
    if (name.find('/') == name.npos) name = user.substr(0, user.find('/') + 1) + name;
    if (name == "builtin_interfaces/Time" || name == "builtin_interfaces/Duration") {
      field->kind = Kind::kTime;
      return;
    }
    const auto found = index_.find(name);
    if (found == index_.end())
      refuse(written.line, fmt::format("type {} is not described", printable(name)));
    field->kind = Kind::kStruct;
    field->type = make(name, &found->second, written.line);
  }

  void add_size(const Ros2Field& field, Ros2Type* type) const {
    // no threshold: far above any file, so that products and sums stay below the end of 64 bits
    constexpr std::uint64_t kMost = std::uint64_t{1} << 40U;
    constexpr std::uint64_t kLength = 4, kTimeBytes = 8;  // no threshold: bytes in CDR
    std::uint64_t least = ros2_bytes(field.kind);
    if (field.kind == Kind::kTime) least = kTimeBytes;
    if (field.kind == Kind::kString) least = kLength;
    if (field.kind == Kind::kStruct) least = definition_.types[field.type].least_bytes;
    least = field.repeat == Repeat::kSequence ? kLength : std::min(least * field.count, kMost);
    type->least_bytes = std::min(type->least_bytes + least, kMost);
    type->has_numbers = type->has_numbers ||
                        (field.kind == Kind::kStruct ? definition_.types[field.type].has_numbers
                                                     : field.kind != Kind::kString);
  }

  std::vector<WrittenType> written_;
  int deepest_ = 0, depth_ = 0;
  std::map<std::string, Known> index_;
  Ros2Definition definition_;
};

}  // namespace

std::size_t ros2_bytes(Ros2Field::Kind kind) {
  switch (kind) {
    case Kind::kBool:
    case Kind::kInt8:
    case Kind::kUint8:
      return 1;
    case Kind::kInt16:
    case Kind::kUint16:
      return 2;
    case Kind::kInt32:
    case Kind::kUint32:
    case Kind::kFloat32:
      return 4;
    case Kind::kInt64:
    case Kind::kUint64:
    case Kind::kFloat64:
      return 8;
    default:
      return 0;
  }
}

Ros2Definition parse_ros2_definition(const std::string& name, std::string_view text, int deepest) {
  return DefinitionTypes(DefinitionText(name, text).read(), deepest).read();
}

}  // namespace sparflow
