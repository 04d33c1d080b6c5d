#pragma once
/// Functions that make text from users (names in machine files, column headers) safe inside a page.
#include <string>
#include <string_view>

namespace sparflow {

/// Replaces every byte sequence that is not UTF-8 by U+FFFD, so that a log written in Latin-1 does not make the whole
/// page unreadable.
std::string valid_utf8(std::string_view text);

/// Returns valid UTF-8 with & < > " ' as entities, which is safe as element content and inside quoted attributes.
std::string html_escape(std::string_view text);

/// Makes JSON text safe inside a <script> element by escaping every `<`, so that neither `</script` nor `<!--` can
/// occur. The text still parses to the same value.
std::string script_safe(std::string_view json_text);

}  // namespace sparflow
