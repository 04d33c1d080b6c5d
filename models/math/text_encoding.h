#pragma once
/// Text of foreign origin: every input becomes UTF-8, and what a message quotes is shortened and shown without control
/// characters.
#include <string>
#include <string_view>
#include <vector>

namespace sparflow {

/// Lengths of what messages quote.
struct QuoteOptions {
  /// Longest quotation of a name or a value.
  /// @threshold [byte] 20..2000; chosen: two lines of a terminal
  std::size_t quotation = 200;
  /// Longest sentence of a message; what follows is left out.
  /// @threshold [byte] 500..100000; chosen: a list of all columns of a usual log still fits
  std::size_t sentence = 4000;
};

/// Removes a UTF-8 byte order mark, converts UTF-16 (either byte order, with its mark), and reads lines that are not
/// UTF-8 as Windows-1252, which contains Latin-1.
/// @param warnings gets a sentence with the first line that was converted; may be null
/// @throws InputError for a spreadsheet, an archive, or text that is UTF-16 without a mark
std::string text_as_utf8(const std::string& file, std::string bytes,
                         std::vector<std::string>* warnings = nullptr);

/// @return whether all of `text` is valid UTF-8
bool is_utf8(std::string_view text);

/// Makes names and quotations from a file printable.
/// @return `text` as UTF-8 (what is none is read as Windows-1252); control characters and those that turn the direction of
///   writing become "?"; longer texts end after about `limit` bytes with "..."
std::string printable(std::string_view text, std::size_t limit = QuoteOptions{}.quotation);

/// Makes a whole message, or a table, harmless for a terminal.
/// @return `text` as UTF-8; line feeds and tabs stay, other control characters are written by their code (x1b after a
///   backslash); longer texts end after about `limit` bytes with "..."
std::string harmless(std::string_view text, std::size_t limit = std::string_view::npos);

}  // namespace sparflow
