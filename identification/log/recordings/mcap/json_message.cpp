#include "identification/log/recordings/mcap/json_message.h"

#include <nlohmann/json.hpp>

namespace sparflow {
namespace {

using nlohmann::json;

bool walk(const json& value, const TopicOptions& options, int deepest, TopicSamples::Place place,
          TopicSamples* samples) {
  if (samples->crowded()) return true;  // the topic is left out
  if (value.is_number()) {
    samples->add(place, value.get<double>());
  } else if (value.is_boolean()) {
    samples->add(place, value.get<bool>() ? 1.0 : 0.0);
  } else if (value.is_structured() && deepest == 0) {
    return false;
  } else if (value.is_object()) {
    std::size_t index = 0;
    for (const auto& [name, member] : value.items()) {
      if (member.is_number() || member.is_boolean() || member.is_structured()) {
        if (!walk(member, options, deepest - 1, samples->field(place, index, name), samples))
          return false;
      }
      ++index;
    }
  } else if (value.is_array() && value.size() <= options.longest_sequence) {
    for (std::size_t i = 0; i < value.size(); ++i)
      if (!walk(value[i], options, deepest - 1, samples->element(place, i), samples)) return false;
  }
  return true;
}

/// A whole number of a member, or nothing.
std::optional<std::int64_t> whole(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number_integer()) return std::nullopt;
  return found->get<std::int64_t>();
}

std::optional<std::int64_t> stamp_of(const json& message) {
  const auto header = message.find("header");
  if (header == message.end() || !header->is_object()) return std::nullopt;
  const auto stamp = header->find("stamp");
  if (stamp == header->end() || !stamp->is_object()) return std::nullopt;
  const auto seconds = whole(*stamp, "sec");
  auto part = whole(*stamp, "nanosec");
  if (!part) part = whole(*stamp, "nsec");
  // no threshold: a stamp has 32 bits for seconds, and a second 1e9 nanoseconds
  constexpr std::int64_t kMostSeconds = std::int64_t{1} << 32U, kNanosecondsOfOne = 1'000'000'000;
  if (!seconds || !part || *seconds < 0 || *seconds > kMostSeconds || *part < 0 ||
      *part >= kNanosecondsOfOne)
    return std::nullopt;
  return kNanosecondsOfOne * *seconds + *part;
}

}  // namespace

MessageState read_json_message(std::string_view message, const TopicOptions& options, int deepest,
                               TopicSamples* samples, std::optional<std::int64_t>* stamp) {
  if (message.size() > options.longest_json) return MessageState::kTooLong;
  json parsed = json::parse(message, nullptr, false);
  if (!parsed.is_object()) return MessageState::kDamaged;
  *stamp = stamp_of(parsed);
  if (*stamp) parsed["header"].erase("stamp");
  const bool read = walk(parsed, options, deepest, TopicSamples::kMessage, samples);
  return read ? MessageState::kRead : MessageState::kDamaged;
}

}  // namespace sparflow
