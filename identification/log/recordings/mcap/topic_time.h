#pragma once
/// Chooses the time of each topic: the stamp in its messages' header, the time of publication or that of recording.
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace sparflow {

enum class TimeSource : std::uint8_t { kHeader, kPublished, kLogged };
const char* words_of(TimeSource source);

struct TopicTimeOptions {
  /// Farthest that the stamps of a topic may on average lie from the times of recording, to count as the same clock.
  /// @threshold [s] 0.05..60; chosen: messages arrive within tenths of a second, clocks of two computers differ by more
  double same_clock = 1.0;
};

/// The three times of the messages of a topic [ns], from any epoch.
struct TopicTimes {
  std::vector<std::int64_t> header;  ///< kNoStamp where a message has none
  std::vector<std::int64_t> published, logged;
  static constexpr std::int64_t kNoStamp = INT64_MIN;
  void add(std::int64_t stamp, std::uint64_t publish_time, std::uint64_t log_time);
  const std::vector<std::int64_t>& of(TimeSource source) const;
};

struct ChosenTime {
  TimeSource source = TimeSource::kLogged;
  std::string why_not_header;  ///< a sentence's end where messages have stamps that are not taken
};

/// Stamps of headers are taken where all messages of a topic have one that is not zero, and their clock is that of the
/// recorder; or where all topics have such stamps and these have one clock. Times of publication likewise.
/// @param topics at least one message each  @return one for each topic
std::vector<ChosenTime> choose_times(const std::vector<const TopicTimes*>& topics,
                                     const TopicTimeOptions& options = {});

}  // namespace sparflow
