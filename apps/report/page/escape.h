#pragma once
/// Text that came from users (names in machine files, column headers) made safe inside a page.
#include <string>
#include <string_view>

namespace sparflow {

/// `text` with every byte sequence that is not UTF-8 replaced by U+FFFD. A log written in Latin-1 must not
/// make the whole page unreadable.
std::string valid_utf8(std::string_view text);

/// Valid UTF-8 with & < > " ' as entities: safe as element content and inside quoted attributes.
std::string html_escape(std::string_view text);

/// JSON text made safe inside a <script> element: no `<` is left, so neither `</script` nor `<!--` can
/// occur. The value it parses to is the same.
std::string script_safe(std::string_view json_text);

}  // namespace sparflow
