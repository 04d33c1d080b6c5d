#include "identification/log/text_encoding.h"

#include <cstdint>

#include "models/math/error.h"

namespace sparflow {
namespace {

void append_code_point(std::string& out, std::uint32_t c) {
  const auto push = [&](std::uint32_t byte) { out += static_cast<char>(byte); };
  if (c < 0x80) {
    push(c);
  } else if (c < 0x800) {
    push(0xC0 | c >> 6), push(0x80 | (c & 0x3F));
  } else if (c < 0x10000) {
    push(0xE0 | c >> 12), push(0x80 | (c >> 6 & 0x3F)), push(0x80 | (c & 0x3F));
  } else {
    push(0xF0 | c >> 18), push(0x80 | (c >> 12 & 0x3F));
    push(0x80 | (c >> 6 & 0x3F)), push(0x80 | (c & 0x3F));
  }
}

std::string from_utf16(std::string_view bytes, bool big_endian) {
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(bytes[i]);
    const auto second = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<std::uint32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  std::string out;
  out.reserve(bytes.size() / 2);
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size()) {
      const std::uint32_t low = unit(i + 2);
      if (low >= 0xDC00 && low < 0xE000) {
        c = 0x10000 + ((c - 0xD800) << 10) + (low - 0xDC00);
        i += 2;
      }
    }
    if (c >= 0xD800 && c < 0xE000) c = 0xFFFD;  // an unpaired surrogate is not a character
    append_code_point(out, c);
  }
  return out;
}

/// @return length of the UTF-8 character at `i`, 0 when it is not valid
std::size_t character_length(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char lead = byte(i);
  if (lead < 0x80) return 1;
  const std::size_t n = lead >= 0xC2 && lead < 0xE0   ? 2
                        : lead >= 0xE0 && lead < 0xF0 ? 3
                        : lead >= 0xF0 && lead < 0xF5 ? 4
                                                      : 0;
  if (n == 0 || i + n > text.size()) return 0;
  for (std::size_t k = 1; k < n; ++k) {
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  }
  const unsigned char second = byte(i + 1);  // refuses overlong forms, surrogates, > U+10FFFF
  if ((lead == 0xE0 && second < 0xA0) || (lead == 0xED && second >= 0xA0) ||
      (lead == 0xF0 && second < 0x90) || (lead == 0xF4 && second >= 0x90)) {
    return 0;
  }
  return n;
}

}  // namespace

std::string text_as_utf8(const std::string& file, std::string bytes) {
  const std::string_view view = bytes;
  if (view.starts_with("\xEF\xBB\xBF")) {
    bytes.erase(0, 3);
    return bytes;
  }
  if (view.starts_with("\xFF\xFE")) return from_utf16(view.substr(2), false);
  if (view.starts_with("\xFE\xFF")) return from_utf16(view.substr(2), true);
  const auto refuse = [&](const char* message) { throw InputError({file, 0, 0}, "", message); };
  if (view.starts_with("PK\x03\x04") || view.starts_with("\xD0\xCF\x11\xE0")) {
    refuse("this is a spreadsheet or an archive, expected text; save the sheet as CSV");
  }
  if (view.starts_with("\x1F\x8B"))
    refuse("this is a gzip archive, expected text; unpack it first");
  const std::string_view head = view.substr(0, 200);
  if (head.size() >= 4 && (head[1] == '\0' || head[0] == '\0')) {
    refuse(
        "the text holds zero bytes (UTF-16 without a byte order mark, or not text at all); save it "
        "as UTF-8");
  }
  return bytes;
}

std::string printable(std::string_view text, std::size_t limit) {
  bool valid = true;
  for (std::size_t i = 0; i < text.size() && valid;) {
    const std::size_t n = character_length(text, i);
    valid = n > 0;
    i += n;
  }
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (out.size() >= limit) return out + "...";
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t n = valid ? character_length(text, i) : 1;
    if (byte < 0x20 || byte == 0x7F) {
      out += '?';
    } else if (valid) {
      out += text.substr(i, n);
    } else {
      append_code_point(out, byte);
    }
    i += n;
  }
  return out;
}

}  // namespace sparflow
