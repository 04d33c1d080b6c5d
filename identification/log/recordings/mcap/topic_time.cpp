#include "identification/log/recordings/mcap/topic_time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace sparflow {
namespace {

constexpr double kNanosecond = 1e-9;  // no threshold: a unit

/// Times beyond the year 2262 are held there.
std::int64_t signed_time(std::uint64_t time) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(time, INT64_MAX));
}

bool all_there(const std::vector<std::int64_t>& times) {
  return std::all_of(times.begin(), times.end(),
                     [](std::int64_t t) { return t != TopicTimes::kNoStamp && t != 0; });
}

/// Median of what the times lie behind those of recording [s].
double offset_of(const std::vector<std::int64_t>& times, const std::vector<std::int64_t>& logged) {
  std::vector<double> offsets;
  offsets.reserve(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    offsets.push_back(kNanosecond *
                      (static_cast<double>(times[i]) - static_cast<double>(logged[i])));
  }
  const auto middle = offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2);
  std::nth_element(offsets.begin(), middle, offsets.end());
  return *middle;
}

}  // namespace

const char* words_of(TimeSource source) {
  return source == TimeSource::kHeader      ? "header.stamp"
         : source == TimeSource::kPublished ? "the time of publication"
                                            : "the time of recording";
}

void TopicTimes::add(std::int64_t stamp, std::uint64_t publish_time, std::uint64_t log_time) {
  header.push_back(stamp);
  published.push_back(signed_time(publish_time));
  logged.push_back(signed_time(log_time));
}

const std::vector<std::int64_t>& TopicTimes::of(TimeSource source) const {
  return source == TimeSource::kHeader      ? header
         : source == TimeSource::kPublished ? published
                                            : logged;
}

std::vector<ChosenTime> choose_times(const std::vector<const TopicTimes*>& topics,
                                     const TopicTimeOptions& options) {
  std::vector<double> offsets;  // of headers; NaN where stamps are missing
  offsets.reserve(topics.size());
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  bool all = true;
  for (const TopicTimes* times : topics) {
    const bool there = all_there(times->header);
    offsets.push_back(there ? offset_of(times->header, times->logged)
                            : std::numeric_limits<double>::quiet_NaN());
    all = all && there;
    if (!there) continue;
    lowest = std::min(lowest, offsets.back());
    highest = std::max(highest, offsets.back());
  }
  const bool own_clock = all && highest - lowest <= options.same_clock;
  std::vector<ChosenTime> chosen(topics.size());
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const TopicTimes& times = *topics[i];
    if (own_clock || std::abs(offsets[i]) <= options.same_clock) {
      chosen[i].source = TimeSource::kHeader;
      continue;
    }
    const auto no_stamp = [](std::int64_t t) { return t == TopicTimes::kNoStamp; };
    if (!std::isnan(offsets[i])) {
      chosen[i].why_not_header = fmt::format(
          "their stamps lie {:.3g} s from the times of recording, on another clock", offsets[i]);
    } else if (!std::all_of(times.header.begin(), times.header.end(), no_stamp)) {
      chosen[i].why_not_header = "some of their stamps are zero or missing";
    }
    if (all_there(times.published) &&
        std::abs(offset_of(times.published, times.logged)) <= options.same_clock)
      chosen[i].source = TimeSource::kPublished;
  }
  return chosen;
}

}  // namespace sparflow
