#include "models/files/xml_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "models/math/door.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

class XmlOutline {
 public:
  XmlOutline(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  void check() {
    bool root = false;
    while (go_to('<')) {
      if (skip("<!--", "-->", "a comment") || skip("<![CDATA[", "]]>", "a CDATA section") ||
          skip("<?", "?>", "a declaration") || skip_doctype()) {
        continue;
      }
      if (text_.substr(at_).starts_with("</")) {
        close_element();
      } else {
        if (open_.empty() && root) fail("a second root element; XML has one");
        root = true;
        open_element();
      }
    }
    if (!open_.empty()) {
      fail_at(open_.back().line,
              fmt::format("<{}> is opened here and not closed; was the file copied "
                          "completely?",
                          quoted(open_.back().name)));
    }
    if (!root) {
      throw InputError({file_, 0, 0}, "",
                       "not readable as URDF: no XML element in it, expected <robot ...>");
    }
  }

 private:
  struct Element {
    std::string_view name;
    int line = 0;
  };

  [[noreturn]] void fail_at(int line, const std::string& message) const {
    throw InputError({file_, line, 0}, "", "not readable as URDF: " + message);
  }
  [[noreturn]] void fail(const std::string& message) { fail_at(line(), message); }
  static std::string quoted(std::string_view name) { return printable(name, 60); }

  /// Line of the current position; the text before it is counted once only.
  int line() {
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
    counted_ = at_;
    return line_;
  }

  bool go_to(char c) {
    at_ = std::min(text_.find(c, at_), text_.size());
    return at_ < text_.size();
  }

  bool skip(std::string_view begin, std::string_view end, const char* what) {
    if (!text_.substr(at_).starts_with(begin)) return false;
    const std::size_t stop = text_.find(end, at_ + begin.size());
    if (stop == std::string_view::npos) fail(fmt::format("{} is opened here and not closed", what));
    at_ = stop + end.size();
    return true;
  }

  bool skip_doctype() {
    if (!text_.substr(at_).starts_with("<!")) return false;
    const std::size_t stop = text_.find('>', at_);
    if (stop == std::string_view::npos) fail("a declaration is opened here and not closed");
    if (text_.substr(at_, stop - at_).find('[') != std::string_view::npos) {
      fail("a document type with declarations of its own; URDF has none, remove it");
    }
    at_ = stop + 1;
    return true;
  }

  std::string_view name_at(std::size_t begin) const {
    std::size_t end = begin;
    while (end < text_.size() && !blank(text_[end]) && text_[end] != '>' && text_[end] != '/' &&
           text_[end] != '<') {
      ++end;
    }
    return text_.substr(begin, end - begin);
  }

  void open_element() {
    const std::string_view name = name_at(at_ + 1);
    if (name.empty()) fail("a `<` without the name of an element; write &lt; in text");
    const int here = line();
    std::size_t i = at_ + 1 + name.size();
    char quote = 0;
    for (; i < text_.size(); ++i) {
      const char c = text_[i];
      if (quote != 0) {
        if (c == quote) quote = 0;
      } else if (c == '"' || c == '\'') {
        quote = c;
      } else if (c == '>') {
        break;
      } else if (c == '<') {
        fail(fmt::format("<{}> is not ended by `>`", quoted(name)));
      }
    }
    if (i >= text_.size()) {
      fail(quote != 0 ? fmt::format("a quote in <{}> is not closed", quoted(name))
                      : fmt::format("<{}> is not ended by `>`", quoted(name)));
    }
    at_ = i + 1;
    count(name, here);
    if (text_[i - 1] == '/') return;
    open_.push_back({name, here});
    if (static_cast<int>(open_.size()) > limits_.xml_nesting) {
      fail_at(here, fmt::format("elements nested more than {} deep", limits_.xml_nesting));
    }
  }

  void close_element() {
    const std::string_view name = name_at(at_ + 2);
    if (open_.empty()) fail(fmt::format("</{}> closes nothing", quoted(name)));
    if (open_.back().name != name) {
      fail(fmt::format("</{}> where <{}> of line {} should be closed", quoted(name),
                       quoted(open_.back().name), open_.back().line));
    }
    open_.pop_back();
    if (!go_to('>')) fail("the file ends inside an element's end; was it copied completely?");
    ++at_;
  }

  void count(std::string_view name, int here) {
    for (Part& part : parts_) {
      if (name != part.name || ++part.found <= limits_.machine_parts) continue;
      fail_at(here, fmt::format("more than {} {}s (docs/limits.md)", limits_.machine_parts, name));
    }
  }

  struct Part {
    std::string_view name;
    int found = 0;
  };

  std::string_view text_;
  const std::string& file_;
  const DoorLimits limits_;
  std::array<Part, 2> parts_ = {{{"link"}, {"joint"}}};
  std::vector<Element> open_;
  std::size_t at_ = 0, counted_ = 0;
  int line_ = 1;
};

}  // namespace

void check_xml(const std::string& text, const std::string& file) { XmlOutline(text, file).check(); }

}  // namespace sparflow
