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
  bool skip = false;  ///< a remote or error frame
};

bool hex(std::string_view text, std::uint32_t* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value, 16);
  return error == std::errc{} && end == text.data() + text.size() && !text.empty();
}

bool read_line(std::string_view text, Line* line) {
  const std::size_t close = text.find(')');
  if (!text.starts_with('(') || close == text.npos) return false;
  double time = 0.0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + close, time);
  if (error != std::errc{} || end != text.data() + close || !(time >= 0.0 && time < 1e12))
    return false;
  const std::size_t hash = text.find('#', close);
  if (hash == text.npos) return false;
  const std::size_t blank = text.rfind(' ', hash);
  if (blank == text.npos || blank < close) return false;
  const std::string_view id = text.substr(blank + 1, hash - blank - 1);
  if (!hex(id, &line->frame.id)) return false;
  line->frame.time = time;
  line->frame.extended = id.size() > kStandardDigits;
  std::string_view data = text.substr(hash + 1);
  data = data.substr(0, data.find_first_of(" \t\r"));
  line->skip = (line->frame.id & kErrorFrame) != 0 || data.starts_with('R');
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
    if (!start) start = line.frame.time;
    if (line.frame.time < last) {
      throw InputError({file, number, 0}, "", "time decreases; sort the trace by time");
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
