#pragma once
/// Byte encodings a log may come in; everything behind this door is UTF-8.
#include <string>
#include <string_view>

namespace sparflow {

/// Takes off a UTF-8 mark, converts UTF-16 (either byte order, with its mark).
/// @throws InputError for a spreadsheet, an archive, or text that is UTF-16 without a mark
std::string text_as_utf8(const std::string& file, std::string bytes);

/// `text` if it is valid UTF-8, else read as Latin-1 (a lone 0xB0 is a degree sign); control characters
/// become "?". At most `limit` bytes: for names and for quoting a file's content in a message.
std::string printable(std::string_view text, std::size_t limit = 200);

}  // namespace sparflow
