#include "identification/log/mat_file.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <optional>

#include "identification/log/log_dialect.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: sizes, types and classes of the format
constexpr std::size_t kHeader = 128, kTag = 8, kHeader4 = 20;
enum DataType : std::uint32_t {
  kInt8 = 1,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kSingle,
  kDouble = 9,
  kInt64 = 12,
  kUint64,
  kMatrix,
  kCompressed,
  kUtf8,
  kUtf16,
  kUtf32
};
enum ArrayClass : std::uint32_t {
  kCell = 1,
  kStructure,
  kObject,
  kChar,
  kSparse,
  kFirstNumeric,
  kLastNumeric = 15
};
constexpr std::uint32_t kComplexFlag = 0x0800;

std::size_t size_of(std::uint32_t type) {
  switch (type) {
    case kInt8:
    case kUint8:
    case kUtf8:
      return 1;
    case kInt16:
    case kUint16:
    case kUtf16:
      return 2;
    case kInt32:
    case kUint32:
    case kSingle:
    case kUtf32:
      return 4;
    case kDouble:
    case kInt64:
    case kUint64:
      return 8;
    default:
      return 0;
  }
}

/// One value of type `T` in the file's byte order.
template <class T>
T loaded(const char* at, bool swapped) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), at, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  T value{};
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

double number_at(const char* at, std::uint32_t type, bool swapped) {
  switch (type) {
    case kInt8:
      return loaded<std::int8_t>(at, swapped);
    case kUint8:
    case kUtf8:
      return loaded<std::uint8_t>(at, swapped);
    case kInt16:
      return loaded<std::int16_t>(at, swapped);
    case kUint16:
    case kUtf16:
      return loaded<std::uint16_t>(at, swapped);
    case kInt32:
      return loaded<std::int32_t>(at, swapped);
    case kUint32:
    case kUtf32:
      return loaded<std::uint32_t>(at, swapped);
    case kSingle:
      return static_cast<double>(loaded<float>(at, swapped));
    case kDouble:
      return loaded<double>(at, swapped);
    case kInt64:
      return static_cast<double>(loaded<std::int64_t>(at, swapped));
    case kUint64:
      return static_cast<double>(loaded<std::uint64_t>(at, swapped));
    default:
      return std::numeric_limits<double>::quiet_NaN();
  }
}

struct Element {
  std::uint32_t type = 0;
  std::string_view data;
};

/// Elements one after another within a part of the file.
class Elements {
 public:
  Elements(std::string_view bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}
  bool ended() const { return at_ >= bytes_.size(); }
  std::string_view rest() const { return bytes_.substr(std::min(at_, bytes_.size())); }

  /// @return nothing where the bytes end inside the element
  std::optional<Element> next() {
    if (at_ + kTag > bytes_.size()) return std::nullopt;
    const auto first = loaded<std::uint32_t>(bytes_.data() + at_, swapped_);
    Element element;
    if (first >> 16U != 0) {  // small: type, size and up to four bytes in the place of the tag
      element.type = first & 0xFFFFU;
      if (first >> 16U > 4) return std::nullopt;
      element.data = bytes_.substr(at_ + 4, first >> 16U);
      at_ += kTag;
      return element;
    }
    element.type = first;
    const std::size_t size = loaded<std::uint32_t>(bytes_.data() + at_ + 4, swapped_);
    if (size > bytes_.size() - at_ - kTag) return std::nullopt;
    element.data = bytes_.substr(at_ + kTag, size);
    at_ += kTag + size;
    if (element.type != kCompressed) at_ += (8 - size % 8) % 8;
    return element;
  }

 private:
  std::string_view bytes_;
  bool swapped_;
  std::size_t at_ = 0;
};

class MatReader {
 public:
  MatReader(std::string_view bytes, const std::string& file, const DoorLimits& limits)
      : bytes_(bytes), file_(file), limits_(limits) {}

  std::vector<MatValue> read() {
    return is_version_5(bytes_) ? read_version_5() : read_version_4();
  }

  static bool is_version_5(std::string_view bytes) {
    if (bytes.size() < kHeader) return false;
    const std::string_view mark = bytes.substr(126, 2);
    const bool little = mark == "IM", big = mark == "MI";
    return (little && bytes[125] == '\x01') || (big && bytes[124] == '\x01');
  }

 private:
  [[noreturn]] void cut(const std::string& variable) const {
    throw InputError({file_, 0, 0}, variable,
                     "the file ends inside this variable, or one of its lengths is damaged; was it "
                     "copied completely?");
  }
  [[noreturn]] void damaged(const std::string& variable, const std::string& what) const {
    throw InputError({file_, 0, 0}, variable, what + "; the file is damaged, save it again");
  }

  static std::string numbered(std::size_t i) { return fmt::format("variable {}", i + 1); }

  // --- versions 5 and 7 ---

  std::vector<MatValue> read_version_5() {
    swapped_ = bytes_.substr(126, 2) == "MI";
    Elements elements(bytes_.substr(kHeader), swapped_);
    std::vector<MatValue> variables;
    while (!elements.ended()) {
      if (elements.rest().find_first_not_of('\0') == std::string_view::npos) break;
      const std::string where = numbered(variables.size());
      const std::optional<Element> element = elements.next();
      if (!element) cut(where);
      if (element->type == kCompressed) {
        const std::string content = inflated(element->data, where);
        Elements inside(content, swapped_);
        const std::optional<Element> matrix = inside.next();
        if (!matrix) cut(where);
        if (matrix->type != kMatrix) damaged(where, "no variable in its compressed data");
        variables.push_back(read_matrix(matrix->data, where, 1));
      } else if (element->type == kMatrix) {
        variables.push_back(read_matrix(element->data, where, 1));
      } else {
        damaged(where, fmt::format("found data of type {}, expected a variable", element->type));
      }
    }
    return variables;
  }

  std::string inflated(std::string_view data, const std::string& where) {
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    struct End {
      z_stream* stream;
      ~End() { inflateEnd(stream); }
    } const end{&stream};
    // zlib does not write to its input
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
    stream.avail_in = static_cast<uInt>(data.size());
    std::string out;
    for (;;) {
      const std::size_t size = out.size();
      /// Smallest piece in which data is unpacked.
      /// @threshold [byte] 1e3..1e8; chosen: few calls, little memory
      constexpr std::size_t kPiece = 1U << 16U;
      out.resize(size + std::clamp<std::size_t>(size, kPiece, 1U << 28U));
      stream.next_out = reinterpret_cast<Bytef*>(out.data() + size);
      stream.avail_out = static_cast<uInt>(out.size() - size);
      const int state = inflate(&stream, Z_NO_FLUSH);
      out.resize(out.size() - stream.avail_out);
      inflated_ += static_cast<std::int64_t>(out.size() - size);
      if (inflated_ > limits_.log_bytes) {
        throw InputError(
            {file_, 0, 0}, where,
            fmt::format("unpacks to more than {:g} MB, the limit of a log (docs/limits.md)",
                        static_cast<double>(limits_.log_bytes) / 1e6));
      }
      if (state == Z_STREAM_END) return out;
      if (state == Z_MEM_ERROR) throw std::bad_alloc();
      if (state != Z_OK) damaged(where, "its compressed data cannot be unpacked");
    }
  }

  MatValue read_matrix(std::string_view data, const std::string& where, int depth) {
    MatValue value;
    if (data.empty()) return value;  // an empty cell or field
    if (depth > limits_.nesting) damaged(where, "cells or structs are nested too deeply");
    Elements elements(data, swapped_);
    const Element flags = need(elements, where);
    const Element dims = need(elements, where);
    const Element name = need(elements, where);
    if (flags.type != kUint32 || flags.data.size() != 8 || dims.type != kInt32 ||
        dims.data.size() < 8 || size_of(name.type) != 1) {
      // MATLAB's functions and objects of classes begin otherwise; what else does is damaged but holds no signals either.
      return value;
    }
    const auto word = loaded<std::uint32_t>(flags.data.data(), swapped_);
    const std::uint32_t kind = word & 0xFFU;
    value.name = std::string(name.data.substr(0, name.data.find('\0')));
    const std::string here = value.name.empty() ? where : printable(value.name);
    std::size_t count = 1;
    for (std::size_t i = 0; i + 4 <= dims.data.size(); i += 4) {
      const auto n = loaded<std::int32_t>(dims.data.data() + i, swapped_);
      if (n < 0 || (n > 0 && count > static_cast<std::size_t>(limits_.log_values) /
                                         static_cast<std::size_t>(n)))
        damaged(here, fmt::format("a dimension of {}", n));
      count *= static_cast<std::size_t>(n);
    }
    value.rows = static_cast<std::size_t>(loaded<std::int32_t>(dims.data.data(), swapped_));
    value.columns = static_cast<std::size_t>(loaded<std::int32_t>(dims.data.data() + 4, swapped_));
    const bool plain = dims.data.size() == 8 && (word & kComplexFlag) == 0;
    if (kind >= kFirstNumeric && kind <= kLastNumeric) {
      if (count == 0 && elements.ended()) return value;
      const Element real = need(elements, here);
      if (plain) read_numbers(real, count, here, &value);
    } else if (kind == kChar && plain) {
      read_lines(need(elements, here), &value);
    } else if (kind == kCell && plain) {
      value.kind = MatValue::Kind::kCells;
      read_children(elements, count, here, {depth, &value});
    } else if (kind == kStructure) {
      read_struct(elements, count, here, {depth, &value});
    } else if (kind == 0 || kind > 17) {
      damaged(here, fmt::format("an array of the unknown class {}", kind));
    }
    return value;
  }

  Element need(Elements& elements, const std::string& where) const {
    const std::optional<Element> element = elements.next();
    if (!element) cut(where);
    return *element;
  }

  void read_numbers(const Element& element, std::size_t count, const std::string& where,
                    MatValue* value) const {
    const std::size_t size = size_of(element.type);
    if (size == 0) damaged(where, fmt::format("data of the unknown type {}", element.type));
    if (element.data.size() != count * size) {
      damaged(where, fmt::format("{} x {} values, but data of {} bytes", value->rows,
                                 value->columns, element.data.size()));
    }
    value->kind = MatValue::Kind::kNumbers;
    value->numbers.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double v = number_at(element.data.data() + i * size, element.type, swapped_);
      value->numbers[i] = std::isfinite(v) ? v : std::numeric_limits<double>::quiet_NaN();
    }
  }

  void read_lines(const Element& element, MatValue* value) const {
    const std::size_t size = size_of(element.type);
    if (size == 0) return;
    value->kind = MatValue::Kind::kText;
    const std::size_t units = element.data.size() / size;
    if (value->rows > units) return;  // rows without characters
    value->lines.resize(value->rows);
    for (std::size_t row = 0; row < value->rows; ++row) {
      std::string& text = value->lines[row];
      for (std::size_t at = row, j = 0; j < value->columns && at < units; ++j, at += value->rows) {
        const double code = number_at(element.data.data() + at * size, element.type, swapped_);
        text += code > 0.0 && code < 128.0 ? static_cast<char>(code) : '?';
      }
      text = std::string(trimmed(text));
    }
  }

  struct Parent {
    int depth;
    MatValue* value;
  };

  void read_children(Elements& elements, std::size_t count, const std::string& where,
                     Parent parent) {
    // each takes at least its tag, so that a damaged count asks for no memory
    if (count > elements.rest().size() / kTag) cut(where);
    for (std::size_t i = 0; i < count; ++i) {
      const Element child = need(elements, where);
      if (child.type != kMatrix) damaged(where, "a cell or field that is no array");
      parent.value->children.push_back(read_matrix(child.data, where, parent.depth + 1));
    }
  }

  void read_struct(Elements& elements, std::size_t count, const std::string& where, Parent parent) {
    const Element length = need(elements, where);
    if (length.type != kInt32 || length.data.size() != 4)
      damaged(where, "no length of field names");
    const auto width = loaded<std::int32_t>(length.data.data(), swapped_);
    const Element names = need(elements, where);
    if (width <= 0 || names.data.size() % static_cast<std::size_t>(width) != 0) {
      damaged(where, "field names of a wrong length");
    }
    parent.value->kind = MatValue::Kind::kStruct;
    if (count != 1) return;  // an array of structs; the caller refuses it
    const std::size_t fields = names.data.size() / static_cast<std::size_t>(width);
    read_children(elements, fields, where, parent);
    for (std::size_t i = 0; i < fields; ++i) {
      const std::string_view name =
          names.data.substr(i * static_cast<std::size_t>(width), static_cast<std::size_t>(width));
      parent.value->children[i].name = std::string(name.substr(0, name.find('\0')));
    }
  }

  // --- version 4 ---

  std::vector<MatValue> read_version_4() {
    static constexpr std::array<std::uint32_t, 6> kTypes = {kDouble, kSingle, kInt32,
                                                            kInt16,  kUint16, kUint8};
    std::vector<MatValue> variables;
    for (std::size_t at = 0; at < bytes_.size();) {
      const std::string where = numbered(variables.size());
      if (bytes_.size() - at < kHeader4) cut(where);
      swapped_ = loaded<std::uint32_t>(bytes_.data() + at, false) > 0xFFFFU;
      const auto word = [&](std::size_t i) {
        return loaded<std::uint32_t>(bytes_.data() + at + 4 * i, swapped_);
      };
      const std::uint32_t code = word(0), precision = code / 10 % 10, kind = code % 10;
      const std::size_t rows = word(1), columns = word(2), name_size = word(4);
      const bool complex = word(3) != 0;
      if (code > 1999 || code / 100 % 10 != 0 || precision >= kTypes.size() || kind > 2 ||
          word(3) > 1)
        damaged(where, "no header of a variable where one should be");
      at += kHeader4;
      if (name_size > bytes_.size() - at) cut(where);
      MatValue value;
      const std::string_view name = bytes_.substr(at, name_size);
      value.name = std::string(name.substr(0, name.find('\0')));
      at += name_size;
      const std::uint32_t type = kTypes[precision];
      const std::size_t size = size_of(type) * (complex ? 2 : 1);
      if (columns != 0 && rows > (bytes_.size() - at) / columns / size) cut(printable(value.name));
      const Element data{type, bytes_.substr(at, rows * columns * size_of(type))};
      value.rows = rows, value.columns = columns;
      if (kind == 0 && !complex) read_numbers(data, rows * columns, printable(value.name), &value);
      if (kind == 1) read_lines(data, &value);
      at += rows * columns * size;
      variables.push_back(std::move(value));
    }
    return variables;
  }

  std::string_view bytes_;
  const std::string& file_;
  const DoorLimits& limits_;
  bool swapped_ = false;
  std::int64_t inflated_ = 0;
};

}  // namespace

bool is_mat_before_73(std::string_view bytes) {
  if (MatReader::is_version_5(bytes)) return true;
  if (bytes.size() < kHeader4) return false;
  // Version 4 has no mark; its first word is a number below 2000 of which the hundreds are zero.
  const auto little = loaded<std::uint32_t>(bytes.data(), false),
             big = loaded<std::uint32_t>(bytes.data(), true);
  const std::uint32_t code = std::min(little, big);
  return code < 2000 && code / 100 % 10 == 0 && code % 10 <= 2 && code / 10 % 10 <= 5;
}

std::vector<MatValue> read_mat(std::string_view bytes, const std::string& file,
                               const DoorLimits& limits) {
  return MatReader(bytes, file, limits).read();
}

}  // namespace sparflow
