#pragma once
/// Converts the byte encodings of log files to UTF-8, which the rest of the program uses.
#include <string>
#include <string_view>

namespace sparflow {

/// Removes a UTF-8 byte order mark and converts UTF-16 (either byte order, with its mark).
/// @throws InputError for a spreadsheet, an archive, or text that is UTF-16 without a mark
std::string text_as_utf8(const std::string& file, std::string bytes);

/// Makes names and quotations from a file printable.
/// @return `text` if it is valid UTF-8, else its conversion from Latin-1 (0xB0 is a degree sign); control characters
///   become "?"; longer texts end after about `limit` bytes with "..."
std::string printable(std::string_view text, std::size_t limit = 200);

}  // namespace sparflow
