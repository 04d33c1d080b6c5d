#include "models/math/text_encoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

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

/// @return the character that Windows-1252 means by a byte; the five bytes that it leaves free mean what they do in Latin-1
std::uint32_t from_windows_1252(unsigned char byte) {
  // no threshold: code points of the bytes 0x80 to 0x9F
  static constexpr std::array<std::uint16_t, 32> kUpper = {
      0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
      0x2039, 0x0152, 0x8D,   0x017D, 0x8F,   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
      0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};
  return byte >= 0x80 && byte < 0xA0 ? kUpper[byte - 0x80U] : byte;
}

/// @return position of the first byte that is not valid UTF-8, npos when there is none
std::size_t first_invalid(std::string_view text, std::size_t from = 0) {
  std::size_t i = from;
  while (i < text.size()) {
    // Logs of a gigabyte are plain ASCII but for a few characters, so eight bytes are looked at together.
    if (i + 8 <= text.size()) {
      std::uint64_t eight = 0;
      std::memcpy(&eight, text.data() + i, 8);
      if ((eight & 0x8080808080808080ULL) == 0) {
        i += 8;
        continue;
      }
    }
    const std::size_t n = character_length(text, i);
    if (n == 0) return i;
    i += n;
  }
  return std::string_view::npos;
}

void append_windows_1252(std::string& out, std::string_view bytes) {
  for (const char c : bytes) {
    append_code_point(out, from_windows_1252(static_cast<unsigned char>(c)));
  }
}

/// Lines that are no UTF-8 are converted, so that a file of which only a comment was written elsewhere keeps the rest.
std::string lines_as_utf8(std::string bytes, std::vector<std::string>* warnings) {
  std::size_t bad = first_invalid(bytes);
  if (bad == std::string::npos) return bytes;
  const std::string_view all = bytes;
  const auto line =
      1 + std::count(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bad), '\n');
  std::string out;
  out.reserve(bytes.size() + bytes.size() / 16);
  std::size_t done = 0, lines = 0;
  while (bad != std::string_view::npos) {
    const std::size_t before = all.substr(0, bad).rfind('\n');
    const std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
    const std::size_t end = std::min(all.find('\n', bad), all.size());
    out += all.substr(done, begin - done);
    append_windows_1252(out, all.substr(begin, end - begin));
    done = end;
    ++lines;
    bad = first_invalid(all, end);
  }
  out += all.substr(done);
  if (warnings != nullptr) {
    warnings->push_back(fmt::format(
        "line {} is not UTF-8{} and was read as Windows-1252 (Latin-1); save the file as UTF-8 if "
        "characters look wrong",
        line, lines == 1 ? "" : fmt::format(" (nor are {} later ones)", lines - 1)));
  }
  return out;
}

/// Characters that change how what follows is shown: C0 and C1 controls, and marks of the direction of writing.
bool controls(std::uint32_t c) {
  return c < 0x20 || (c >= 0x7F && c < 0xA0) || (c >= 0x202A && c <= 0x202E) ||
         (c >= 0x2066 && c <= 0x2069) || c == 0x2028 || c == 0x2029 || c == 0x200E || c == 0x200F;
}

/// @return the code point of the valid character of `n` bytes at `i`
std::uint32_t code_point(std::string_view text, std::size_t i, std::size_t n) {
  const auto byte = [&](std::size_t k) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(text[k]));
  };
  if (n == 1) return byte(i);
  std::uint32_t c = byte(i) & (0xFFU >> (n + 1));
  for (std::size_t k = 1; k < n; ++k) c = c << 6 | (byte(i + k) & 0x3F);
  return c;
}

/// Copies `text` as UTF-8. @param control writes a character that controls
template <class F>
std::string cleaned(std::string_view text, std::size_t limit, const F& control) {
  // what is behind the limit is not looked at: a cell of a megabyte costs no more than its beginning
  const std::string_view seen = text.substr(0, limit == std::string_view::npos ? limit : limit + 4);
  const std::size_t bad = first_invalid(seen);
  const bool valid =
      bad == std::string_view::npos || (seen.size() < text.size() && bad + 4 > seen.size());
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (out.size() >= limit) return out + "...";
    std::size_t n = valid ? character_length(text, i) : 1;
    if (n == 0) n = 1;
    const std::uint32_t c = valid && (n > 1 || static_cast<unsigned char>(text[i]) < 0x80)
                                ? code_point(text, i, n)
                                : from_windows_1252(static_cast<unsigned char>(text[i]));
    if (controls(c)) {
      control(out, c);
    } else {
      append_code_point(out, c);
    }
    i += n;
  }
  return out;
}

}  // namespace

std::string text_as_utf8(const std::string& file, std::string bytes,
                         std::vector<std::string>* warnings) {
  const std::string_view view = bytes;
  if (view.starts_with("\xEF\xBB\xBF")) {
    bytes.erase(0, 3);
    return lines_as_utf8(std::move(bytes), warnings);
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
  return lines_as_utf8(std::move(bytes), warnings);
}

bool is_utf8(std::string_view text) { return first_invalid(text) == std::string_view::npos; }

std::string printable(std::string_view text, std::size_t limit) {
  return cleaned(text, limit, [](std::string& out, std::uint32_t) { out += '?'; });
}

std::string harmless(std::string_view text, std::size_t limit) {
  return cleaned(text, limit, [](std::string& out, std::uint32_t c) {
    if (c == '\n' || c == '\t') {
      out += static_cast<char>(c);
    } else if (c < 0x100) {
      out += fmt::format("\\x{:02x}", c);
    } else {
      out += fmt::format("\\u{:04x}", c);
    }
  });
}

}  // namespace sparflow
