#pragma once
/// Reads delimited text: separators `,` `;` tab or blanks, decimal point or comma, a units row under the
/// header, byte order marks, UTF-16, CRLF, quotes, comments, blank lines, trailing separators, marks for
/// "missing". All of these are detected; a mapping file can prescribe them (log_mapping.h).
#include <string>
#include <string_view>
#include <vector>

#include "identification/log/log_table.h"
#include "models/math/door.h"

namespace sparflow {

/// A field that is zero or empty is detected from the file.
struct DialectOptions {
  char delimiter = 0;  ///< comma, semicolon, tabulator or blank (any number of blanks)
  char decimal = 0;    ///< '.' or ','
  int skip_rows = 0;   ///< lines above the header that are not part of the table
  std::vector<std::string> missing;  ///< further marks for "missing", e.g. "-999"
};

/// Reads the whole file in one pass.
/// @param file name for messages
/// @param bytes the file's content
/// @throws InputError when there is no header, no data, more than one row in a hundred of the wrong width,
///   or numbers that can be read two ways (thousands separators, points and commas mixed)
RawTable read_delimited(const std::string& file, std::string bytes,
                        const DialectOptions& options = {}, const DoorLimits& limits = {});

/// @return `text` without the blanks, tabs and carriage returns at its ends
std::string_view trimmed(std::string_view text);

}  // namespace sparflow
