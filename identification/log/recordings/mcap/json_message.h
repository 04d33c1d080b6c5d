#pragma once
/// Takes the numbers out of messages that are JSON objects.
#include <cstdint>
#include <optional>
#include <string_view>

#include "identification/log/recordings/mcap/cdr_message.h"
#include "identification/log/recordings/mcap/topic_samples.h"

namespace sparflow {

/// Numbers, and true and false as 1 and 0, become channels by the names of their members; texts and null do not.
/// @param deepest nesting of objects and lists  @param stamp [ns] of header.stamp with its members sec and nanosec (or nsec)
MessageState read_json_message(std::string_view message, const TopicOptions& options, int deepest,
                               TopicSamples* samples, std::optional<std::int64_t>* stamp);

}  // namespace sparflow
