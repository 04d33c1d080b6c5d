#include "identification/log/recordings/can/can_asc.h"

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

// no threshold: bytes of the longest frame, and lines within which a file's head stands
constexpr std::size_t kLongestFrame = 64, kHeadLines = 20;

/// Takes the next word of a line.
std::string_view word(std::string_view* rest) {
  const std::size_t begin = std::min(rest->find_first_not_of(" \t\r"), rest->size());
  const std::size_t end = std::min(rest->find_first_of(" \t\r", begin), rest->size());
  const std::string_view found = rest->substr(begin, end - begin);
  rest->remove_prefix(end);
  return found;
}

std::string_view line_of(std::string_view* rest) {
  const std::string_view line = rest->substr(0, rest->find('\n'));
  rest->remove_prefix(std::min(line.size() + 1, rest->size()));
  return line;
}

template <typename Number>
bool number(std::string_view text, Number* value, int base = 10) {
  const char* end = text.data() + text.size();
  if (text.empty()) return false;
  if constexpr (std::is_floating_point_v<Number>) {
    const auto [at, error] = std::from_chars(text.data(), end, *value);
    return error == std::errc{} && at == end;
  } else {
    const auto [at, error] = std::from_chars(text.data(), end, *value, base);
    return error == std::errc{} && at == end;
  }
}

/// What the head says of numbers and times.
struct Head {
  int base = 16;
  bool relative = false;  ///< a time counts from the event before
};

/// @return nothing where the line is not that of base and time stamps
std::optional<Head> head_of(std::string_view line) {
  if (word(&line) != "base") return std::nullopt;
  const std::string_view base = word(&line);
  if (base != "hex" && base != "dec") return std::nullopt;
  if (word(&line) != "timestamps") return std::nullopt;
  return Head{base == "hex" ? 16 : 10, word(&line) == "relative"};
}

enum class Found { kFrame, kOther, kDamaged };

class AscLine {
 public:
  /// @param rest the line behind its time
  Found read(std::string_view rest, int base) {
    base_ = base;
    std::string_view first = word(&rest);
    if (first == "CANFD") return fd_frame(rest);
    int bus = 0;
    if (!number(first, &bus)) return Found::kOther;
    const std::string_view id = word(&rest), direction = word(&rest), kind = word(&rest);
    if ((direction != "Rx" && direction != "Tx") || kind != "d") return Found::kOther;
    unsigned size = 0;
    if (!identifier(id) || !number(word(&rest), &size, base_)) return Found::kDamaged;
    return data(rest, std::min<std::size_t>(size, 8)) ? Found::kFrame : Found::kDamaged;
  }
  CanFrame frame(double time) const {
    return {time, id_, extended_, std::span(bytes_.data(), size_)};
  }

 private:
  Found fd_frame(std::string_view rest) {
    const std::string_view bus = word(&rest), direction = word(&rest), id = word(&rest);
    if ((direction != "Rx" && direction != "Tx") || bus.empty()) return Found::kOther;
    if (!identifier(id)) return Found::kOther;  // an error frame
    std::string_view flag = word(&rest);
    if (flag != "0" && flag != "1") flag = word(&rest);  // the message's name stood there
    word(&rest);                                         // ESI, then the code of the length
    word(&rest);
    unsigned size = 0;
    if (!number(word(&rest), &size) || size > kLongestFrame) return Found::kDamaged;
    base_ = 16;  // FD frames are written in hexadecimal digits
    return data(rest, size) ? Found::kFrame : Found::kDamaged;
  }
  bool identifier(std::string_view text) {
    extended_ = text.ends_with('x');
    if (extended_) text.remove_suffix(1);
    return number(text, &id_, base_);
  }
  bool data(std::string_view rest, std::size_t size) {
    size_ = size;
    for (std::size_t i = 0; i < size; ++i)
      if (!number(word(&rest), &bytes_[i], base_)) return false;
    return true;
  }

  int base_ = 16;
  std::uint32_t id_ = 0;
  bool extended_ = false;
  std::size_t size_ = 0;
  std::array<std::uint8_t, kLongestFrame> bytes_{};
};

}  // namespace

bool is_asc(std::string_view bytes) {
  std::string_view rest = bytes;
  for (std::size_t i = 0; i < kHeadLines && !rest.empty(); ++i)
    if (head_of(line_of(&rest))) return true;
  return false;
}

Recording read_asc(std::string_view bytes, const std::string& file,
                   const RecordingOptions& options) {
  CanDecoder decoder(file, options.dbc_files, options.limits);
  Head head;
  double now = 0.0;
  std::optional<double> start;
  std::size_t frames = 0, others = 0;
  int number_of_line = 0;
  const auto fail = [&](const std::string& message) {
    throw InputError({file, number_of_line, 0}, "", message);
  };
  for (std::string_view rest = bytes; !rest.empty();) {
    const std::string_view text = line_of(&rest);
    ++number_of_line;
    if (const auto found = head_of(text)) head = *found;
    std::string_view behind = text;
    double time = 0.0;
    if (!number(word(&behind), &time)) continue;  // head, comments, trigger blocks
    if (!(time >= 0.0 && time < 1e12)) fail("got a time of " + printable(text.substr(0, 40)));
    if (head.relative) time += now;
    AscLine line;
    const Found found = line.read(behind, head.base);
    if (found == Found::kDamaged)
      fail(fmt::format("got \"{}\", expected a frame as `2.501000 1  123  Rx  d 2 28 0A`",
                       printable(text.substr(0, 200))));
    if (found == Found::kFrame) {
      if (time < now) fail("time decreases; sort the trace by time");
      if (!start) start = time;
      ++frames;
      decoder.add(line.frame(time - *start));
    } else {
      ++others;
    }
    if (head.relative || found == Found::kFrame) now = time;
  }
  Recording recording;
  recording.format = fmt::format("ASC trace, {} frames", frames);
  if (others > 0)
    recording.warnings.push_back(fmt::format("{} lines that are no data frames left out", others));
  decoder.finish(&recording);
  return recording;
}

}  // namespace sparflow
