#include "models/files/machine_sketch.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "models/files/open_values.h"
#include "models/math/door.h"

namespace sparflow {
namespace {

constexpr const char* kOpenWord = "unknown";

/// A key that may be left open, and the number that stands there while it is.
struct OpenKey {
  const char* key;
  OpenKind kind;
  const char* placeholder;
};
constexpr OpenKey kLinkKeys[] = {{"mass", OpenKind::kMass, "0"},
                                 {"cog", OpenKind::kCog, "[0,0,0]"}};
// The placeholders' rod is thinner than any bore that is given, their bore thicker than any rod.
constexpr OpenKey kCylinderKeys[] = {{"bore", OpenKind::kBore, "2.9"},
                                     {"rod", OpenKind::kRod, "0"},
                                     {"length_at_zero_stroke", OpenKind::kZeroLength, "0"}};
constexpr OpenKey kLinkageKeys[] = {{"radius", OpenKind::kRadius, "1"}};
struct OpenBar {
  const char* bar;
  OpenKind pin;
};
constexpr OpenBar kPins[] = {{"barrel", OpenKind::kBarrelPin},
                             {"rod", OpenKind::kRodPin},
                             {"rocker", OpenKind::kRockerPin},
                             {"coupler", OpenKind::kCouplerPin}};

/// Lines of comment with these words, each indented so. Line breaks and control characters would end a comment.
std::string comment(std::string words, const std::string& indent) {
  for (char& c : words) {
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  }
  /// Width of a comment's lines.
  /// @threshold [1] 40..200; chosen: a terminal and a half
  constexpr std::size_t kWidth = 116;
  std::string text;
  while (!words.empty()) {
    std::size_t end = words.size();
    if (end > kWidth) {
      end = words.rfind(' ', kWidth);
      if (end == std::string::npos || end == 0) end = std::min(words.find(' ', 1), words.size());
    }
    text += indent + "# " + words.substr(0, end) + "\n";
    words.erase(0, std::min(words.find_first_not_of(' ', end), words.size()));
  }
  return text;
}

/// Begin of line `line` (from 1), npos when there is none.
std::size_t line_begin(const std::string& text, int line) {
  std::size_t at = 0;
  for (int k = 1; k < line; ++k) {
    at = text.find('\n', at);
    if (at == std::string::npos) return at;
    ++at;
  }
  return at;
}

/// Finds the open values of a file in its structure.
class OpenValues {
 public:
  explicit OpenValues(const std::string& text) : text_(text) {}

  void scan(const YamlValue& root) {
    if (!root.is_map()) return;
    for (const auto& [key, value] : root.map("a machine", {}).entries()) {
      if (!value.is_list()) continue;
      const std::vector<YamlValue> parts = value.list("parts");
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (!parts[i].is_map()) continue;
        const YamlMap map = parts[i].map("a part", {});
        if (key == "links") keys(map, kLinkKeys, static_cast<int>(i));
        if (key == "cylinders") cylinder(map, static_cast<int>(i));
      }
    }
    std::sort(found.begin(), found.end(),
              [](const Found& a, const Found& b) { return a.value.begin < b.value.begin; });
  }

  struct Found {
    OpenValue value;
    const char* placeholder;
  };
  std::vector<Found> found;

 private:
  template <std::size_t N>
  void keys(const YamlMap& map, const OpenKey (&known)[N], int part) {
    for (const auto& [key, value] : map.entries()) {
      for (const OpenKey& k : known) {
        if (key == k.key && value.word() == kOpenWord) add(value, k.kind, part, k.placeholder);
      }
    }
  }

  void cylinder(const YamlMap& map, int part) {
    keys(map, kCylinderKeys, part);
    for (const auto& [key, linkage] : map.entries()) {
      if (key != "linkage" || !linkage.is_map()) continue;
      const YamlMap parts = linkage.map("a linkage", {});
      keys(parts, kLinkageKeys, part);
      for (const auto& [bar_key, bar] : parts.entries()) {
        for (const OpenBar& known : kPins) {
          if (bar_key != known.bar) continue;
          if (bar.word() == kOpenWord) {
            bar.fail(fmt::format(
                "got \"{0}\", expected {{frame: FRAME, xyz: {0}}}: on which link a pin sits must "
                "be known",
                kOpenWord));
          }
          if (!bar.is_map()) continue;
          const YamlMap own = bar.map("a pin", {});
          const OpenKey pin[] = {{"xyz", known.pin, "[0,0,0]"}};
          keys(own, pin, part);
          const bool coupler = known.pin == OpenKind::kCouplerPin;
          if (!coupler && known.pin != OpenKind::kRockerPin) continue;
          const OpenKey length[] = {
              {"length", coupler ? OpenKind::kCouplerLength : OpenKind::kRockerLength, "1"}};
          keys(own, length, part);
        }
      }
    }
  }

  void add(const YamlValue& value, OpenKind kind, int part, const char* placeholder) {
    const FilePlace& place = value.place();
    OpenValue open{kind, part, value.path(), place, line_begin(text_, place.line), 0};
    if (open.begin != std::string::npos) {
      open.begin += static_cast<std::size_t>(std::max(place.column - 1, 0));
      for (const char* form : {"unknown", "\"unknown\"", "'unknown'"}) {
        const std::string word = form;
        if (open.begin <= text_.size() && text_.compare(open.begin, word.size(), word) == 0) {
          open.length = word.size();
        }
      }
    }
    if (open.length == 0) {
      value.fail(fmt::format(
          "the word {} must stand here by itself, without tag, anchor or alias, and without "
          "characters outside ASCII before it on its line",
          kOpenWord));
    }
    const bool repeated = std::any_of(found.begin(), found.end(),
                                      [&](const Found& f) { return f.value.begin == open.begin; });
    if (repeated) value.fail("an alias repeats an open value; write it out where it is used");
    found.push_back({std::move(open), placeholder});
  }

  const std::string& text_;
};

}  // namespace

const OpenValue* MachineSketch::find(OpenKind kind, int part) const {
  for (const OpenValue& v : open) {
    if (v.kind == kind && v.part == part) return &v;
  }
  return nullptr;
}

bool MachineSketch::linkage_open(int cylinder) const {
  return std::any_of(open.begin(), open.end(), [&](const OpenValue& v) {
    return v.part == cylinder && v.kind >= OpenKind::kZeroLength;
  });
}

MachineSketch parse_sketch(const std::string& text, const std::string& name,
                           const std::string& folder) {
  MachineSketch sketch;
  sketch.text = text;
  sketch.file = name;
  sketch.folder = folder;
  OpenValues values(text);
  values.scan(parse_yaml(text, name));
  std::string filled = text;
  for (auto f = values.found.rbegin(); f != values.found.rend(); ++f) {
    filled.replace(f->value.begin, f->value.length, f->placeholder);
  }
  sketch.open.reserve(values.found.size());
  for (OpenValues::Found& f : values.found) sketch.open.push_back(std::move(f.value));
  FileFrames frames;
  sketch.machine = parse_unchecked_machine(filled, name, folder, &frames);
  sketch.file_frames = std::move(frames.in_joint);
  return sketch;
}

MachineSketch load_sketch(const std::string& path) {
  return parse_sketch(read_file(path), path, std::filesystem::path(path).parent_path().string());
}

std::string completed_text(const MachineSketch& sketch, const std::vector<Completion>& completions,
                           const std::vector<std::string>& heading) {
  SPARFLOW_CHECK(completions.size() == sketch.open.size(), "a completion for each open value");
  std::string text = sketch.text;
  // From the end on, so that places before stay valid; remarks stand before the line of their values.
  std::string remarks;
  for (std::size_t k = completions.size(); k-- > 0;) {
    const OpenValue& open = sketch.open[k];
    const Completion& completion = completions[k];
    const std::size_t begin = line_begin(sketch.text, open.place.line);
    const std::size_t content = sketch.text.find_first_not_of(' ', begin);
    const std::string indent(content - begin, ' ');
    remarks = comment(completion.remark, indent) + remarks;
    if (!completion.value.empty()) text.replace(open.begin, open.length, completion.value);
    const bool first_of_line = k == 0 || sketch.open[k - 1].place.line != open.place.line;
    if (!first_of_line || remarks.empty()) continue;
    text.insert(begin, remarks);
    remarks.clear();
  }
  std::string head;
  for (const std::string& line : heading) head += comment(line, "");
  return head + text;
}

void refuse_open_values(const YamlValue& root, const std::string& text) {
  if (text.find(kOpenWord) == std::string::npos) return;
  OpenValues values(text);
  values.scan(root);
  if (values.found.empty()) return;
  std::string others;
  for (std::size_t k = 1; k < values.found.size(); ++k) {
    others += (k > 1 ? ", " : "; open too: ") + values.found[k].value.path;
  }
  const OpenValue& first = values.found.front().value;
  throw InputError(first.place, first.path,
                   fmt::format("is left open ({}); `sparflow machine FILE --from-log LOG -o "
                               "MACHINE.yaml` finds it from a log, or write its value{}",
                               kOpenWord, others));
}

}  // namespace sparflow
