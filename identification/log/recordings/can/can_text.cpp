#include "identification/log/recordings/can/can_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "identification/log/recordings/can/can_decoder.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: bytes of the longest frame, and the marks of candump
constexpr std::size_t kFrameBytes = 64, kStandardDigits = 3;
constexpr std::uint32_t kErrorFrame = 0x20000000U;

struct Line {
  CanFrame frame;
  std::array<std::uint8_t, kFrameBytes> bytes{};
  bool skip = false;     ///< a remote or error frame
  bool no_time = false;  ///< a frame as `candump` shows it without -l and -t
};

bool hex(std::string_view text, std::uint32_t* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value, 16);
  return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

std::string_view next_word(std::string_view* rest) {
  rest->remove_prefix(std::min(rest->find_first_not_of(" \t\r"), rest->size()));
  const std::string_view found =
      rest->substr(0, std::min(rest->find_first_of(" \t\r"), rest->size()));
  rest->remove_prefix(found.size());
  return found;
}

bool read_identifier(std::string_view text, Line* line) {
  if (!hex(text, &line->frame.id)) return false;
  line->frame.extended = text.size() > kStandardDigits;
  line->skip = (line->frame.id & kErrorFrame) != 0;
  return true;
}

/// `can0 044#2A366C2BBA`, of `candump -l`.
bool read_compact(std::string_view text, Line* line) {
  const std::size_t hash = text.find('#');
  const std::size_t blank = text.rfind(' ', hash);
  if (blank == text.npos || !read_identifier(text.substr(blank + 1, hash - blank - 1), line))
    return false;
  std::string_view data = text.substr(hash + 1);
  data = data.substr(0, data.find_first_of(" \t\r"));
  line->skip = line->skip || data.starts_with('R');
  if (line->skip) return true;
  if (data.starts_with('#')) data.remove_prefix(std::min<std::size_t>(2, data.size()));  // CAN FD
  if (data.size() % 2 != 0 || data.size() > 2 * kFrameBytes) return false;
  for (std::size_t i = 0; i < data.size() / 2; ++i) {
    std::uint32_t byte = 0;
    if (!hex(data.substr(2 * i, 2), &byte)) return false;
    line->bytes[i] = static_cast<std::uint8_t>(byte);
  }
  line->frame.data = std::span(line->bytes.data(), data.size() / 2);
  return true;
}

/// `can0  044   [5]  2A 36 6C 2B BA`, of `candump -ta`; with -x direction and flags precede the identifier.
bool read_columns(std::string_view text, Line* line) {
  // no threshold: the interface, direction, two flags and the identifier
  constexpr int kMostWords = 5;
  std::string_view id, word;
  for (int i = 0; i <= kMostWords && !word.starts_with('['); ++i) {
    id = word;
    word = next_word(&text);
  }
  if (!word.starts_with('[') || !word.ends_with(']') || !read_identifier(id, line)) return false;
  const std::string_view count = word.substr(1, word.size() - 2);
  std::size_t size = 0;
  const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), size);
  if (error != std::errc{} || end != count.data() + count.size() || size > kFrameBytes)
    return false;
  std::string_view rest = text;
  if (next_word(&rest) == "remote") line->skip = true;
  if (line->skip) return true;
  for (std::size_t i = 0; i < size; ++i) {
    const std::string_view digits = next_word(&text);
    std::uint32_t byte = 0;
    if (digits.size() != 2 || !hex(digits, &byte)) return false;
    line->bytes[i] = static_cast<std::uint8_t>(byte);
  }
  line->frame.data = std::span(line->bytes.data(), size);
  return true;
}

bool read_line(std::string_view text, Line* line) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  if (!text.starts_with('(')) {
    line->no_time = read_columns(text, line);
    return line->no_time;
  }
  const std::size_t close = text.find(')');
  if (close == text.npos) return false;
  double time = 0.0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + close, time);
  if (error != std::errc{} || end != text.data() + close || !(time >= 0.0 && time < 1e12))
    return false;
  line->frame.time = time;
  text.remove_prefix(close + 1);
  // The letters that `candump -a` shows beside the bytes may be a # as well.
  if (text.find('[') != text.npos && read_columns(text, line)) return true;
  return text.find('#') != text.npos && read_compact(text, line);
}

}  // namespace

bool is_candump(std::string_view bytes) {
  Line line;
  return read_line(bytes.substr(0, bytes.substr(0, 300).find('\n')), &line);
}

Recording read_candump(std::string_view bytes, const std::string& file,
                       const RecordingOptions& options) {
  CanDecoder decoder(file, options.dbc_files, options.limits);
  std::optional<double> start;
  double last = 0.0;
  std::size_t frames = 0, skipped = 0;
  int number = 0;
  for (std::string_view rest = bytes; !rest.empty();) {
    const std::string_view text = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(text.size() + 1, rest.size()));
    ++number;
    if (text.find_first_not_of(" \t\r") == text.npos) continue;
    Line line;
    if (!read_line(text, &line)) {
      throw InputError({file, number, 0}, "",
                       fmt::format("got \"{}\", expected a frame as (1436509052.249713) can0 "
                                   "044#2A366C2BBA",
                                   printable(text)));
    }
    if (line.no_time) {
      throw InputError({file, number, 0}, "",
                       "the frames have no time stamps; record the trace with `candump -l`, or "
                       "with `candump -ta`");
    }
    if (!start) start = line.frame.time;
    if (line.frame.time < last) {
      throw InputError({file, number, 0}, "",
                       "time decreases; sort the trace by time, or record it "
                       "with absolute times (`candump -l`, `candump -ta`)");
    }
    last = line.frame.time;
    line.frame.time -= *start;
    line.skip ? ++skipped : ++frames;
    if (!line.skip) decoder.add(line.frame);
  }
  Recording recording;
  recording.format = fmt::format("candump trace, {} frames", frames);
  if (skipped > 0) {
    recording.warnings.push_back(fmt::format("{} remote and error frames left out", skipped));
  }
  decoder.finish(&recording);
  return recording;
}

}  // namespace sparflow
