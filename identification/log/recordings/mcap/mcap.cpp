#include "identification/log/recordings/mcap/mcap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "identification/log/recordings/mcap/cdr_message.h"
#include "identification/log/recordings/mcap/json_message.h"
#include "identification/log/recordings/mcap/mcap_record.h"
#include "identification/log/recordings/mcap/ros2_definition.h"
#include "identification/log/recordings/mcap/topic_samples.h"
#include "identification/log/recordings/mcap/topic_time.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

/// A topic, of one or several publishers that send the same messages.
struct Topic {
  std::string name;
  std::string type;                ///< name of its schema
  std::string refusal;             ///< a sentence's end: why its messages are not read
  std::unique_ptr<CdrReader> cdr;  ///< null for JSON
  std::unique_ptr<TopicSamples> samples;
  TopicTimes times;
  std::size_t messages = 0;
  std::size_t damaged = 0, longer = 0, other_form = 0, too_long = 0;
};

class McapReader : public McapVisitor {
 public:
  McapReader(const std::string& file, const RecordingOptions& options)
      : file_(file), options_(options), budget_(file, options.limits) {}

  void schema(const McapSchema& schema) override { schemas_.try_emplace(schema.id, schema); }

  void channel(const McapChannel& channel) override {
    if (channels_.count(channel.id) > 0) return;  // repeated, by the specification the same
    const auto key = std::make_tuple(channel.topic, channel.encoding, channel.schema);
    const auto [found, is_new] = topics_of_key_.try_emplace(key, topics_.size());
    if (is_new) topics_.push_back(make_topic(channel));
    channels_[channel.id] = found->second;
  }

  bool message(const McapMessage& message) override {
    const auto found = channels_.find(message.channel);
    if (found == channels_.end()) return false;
    Topic& topic = topics_[found->second];
    ++topic.messages;
    if (topic.refusal.empty()) read_message(message, &topic);
    return true;
  }

  Recording recording(const McapSummary& summary, std::size_t bytes) {
    std::vector<const TopicTimes*> times;
    std::vector<Topic*> read;
    std::size_t messages = 0;
    for (Topic& topic : topics_) {
      messages += topic.messages;
      note_messages(topic);
      if (!topic.samples || !topic.samples->has_channels()) continue;
      read.push_back(&topic);
      times.push_back(&topic.times);
    }
    recording_.format = fmt::format("MCAP{}, {} topic{}, {} messages",
                                    summary.profile.empty() ? "" : " (" + summary.profile + ")",
                                    topics_.size(), topics_.size() == 1 ? "" : "s", messages);
    if (!summary.finished) {
      recording_.warnings.push_back(
          fmt::format("the file was not finished by its writer; it is read up to its last whole "
                      "record, and {} bytes behind that are left out",
                      bytes - summary.read_to));
    }
    if (!read.empty()) add_channels(read, choose_times(times));
    for (const auto& [why, names] : left_out_)
      recording_.warnings.push_back(fmt::format("left out, {}: {}", why, names));
    if (recording_.channels.empty()) {
      std::string found;
      for (const std::string& warning : recording_.warnings) found += "; " + warning;
      throw InputError({file_, 0, 0}, "", "no channel of numbers with messages" + found);
    }
    return std::move(recording_);
  }

 private:
  void leave_out(const std::string& why, const std::string& name) {
    constexpr std::size_t kLongestList = 300;  // no threshold: the length of a list in a message
    constexpr std::size_t kMostReasons = 50;  // no threshold: more than the formats' own words give
    const bool known = left_out_.size() < kMostReasons || left_out_.count(why) > 0;
    std::string& names = left_out_[known ? why : "for other reasons"];
    if (names.size() > kLongestList) return;
    names += (names.empty() ? "" : ", ") + name;
    if (names.size() > kLongestList) names += ", ...";
  }

  Topic make_topic(const McapChannel& channel) {
    Topic topic;
    topic.name = channel.topic;
    const auto schema = schemas_.find(channel.schema);
    if (schema != schemas_.end()) topic.type = schema->second.name;
    if (channel.encoding == "cdr") {
      topic.refusal = describe(schema == schemas_.end() ? nullptr : &schema->second, &topic);
    } else if (channel.encoding != "json") {
      topic.refusal =
          fmt::format("messages in the encoding \"{}\", expected cdr or json", channel.encoding);
    }
    if (topic.refusal.empty())
      topic.samples = std::make_unique<TopicSamples>(topic.name, topic_options_, &budget_);
    return topic;
  }

  /// @return "" or a sentence's end: why messages of this schema are not read
  std::string describe(const McapSchema* schema, Topic* topic) {
    if (schema == nullptr) return "messages without a description (schema)";
    if (schema->encoding != "ros2msg") {
      return fmt::format("messages described by \"{}\", expected ros2msg", schema->encoding);
    }
    auto known = definitions_.find(schema->id);
    if (known == definitions_.end()) {
      Described described;
      try {
        described.definition = std::make_shared<Ros2Definition>(
            parse_ros2_definition(schema->name, schema->data, options_.limits.nesting));
        if (!described.definition->types.front().has_numbers)
          described.refusal = "messages without numbers";
      } catch (const TextError& error) {
        described.refusal = fmt::format("the description of {} is not understood (line {}: {})",
                                        schema->name, error.column, error.what());
      }
      known = definitions_.emplace(schema->id, std::move(described)).first;
    }
    if (known->second.refusal.empty())
      topic->cdr = std::make_unique<CdrReader>(known->second.definition, topic_options_);
    return known->second.refusal;
  }

  void read_message(const McapMessage& message, Topic* topic) {
    TopicSamples& samples = *topic->samples;
    if (samples.overfull()) return;
    std::optional<std::int64_t> stamp;
    MessageState state = MessageState::kRead;
    if (topic->cdr != nullptr) {
      state = topic->cdr->read(message.data, &samples);
      stamp = topic->cdr->stamp();
    } else {
      state = read_json_message(message.data, topic_options_, options_.limits.nesting, &samples,
                                &stamp);
    }
    if (state == MessageState::kDamaged) ++topic->damaged;
    if (state == MessageState::kOtherForm) ++topic->other_form;
    if (state == MessageState::kLonger) ++topic->longer;
    if (state == MessageState::kTooLong) ++topic->too_long;
    if (state != MessageState::kRead && state != MessageState::kLonger) {
      samples.drop();
      return;
    }
    budget_.add_values(kTimesOfMessage);
    samples.keep();
    topic->times.add(stamp.value_or(TopicTimes::kNoStamp), message.publish_time, message.log_time);
  }

  /// Says what of a topic is not read.
  void note_messages(const Topic& topic) {
    const std::string name = fmt::format("{} ({} messages)", topic.name, topic.messages);
    if (!topic.refusal.empty()) {
      leave_out(topic.refusal, name);
      return;
    }
    if (topic.messages == 0) leave_out("topics without messages", topic.name);
    if (topic.samples->overfull()) {
      leave_out(fmt::format("messages with more than {} numbers", topic_options_.most_channels),
                name);
    }
    const auto part = [&](std::size_t count) { return fmt::format("{} of {}", count, name); };
    if (topic.damaged > 0) {
      leave_out(
          topic.cdr != nullptr
              ? "messages that end before their description does"
              : fmt::format("messages that are no JSON object, or one nested more than {} deep",
                            options_.limits.nesting),
          part(topic.damaged));
    }
    if (topic.too_long > 0) {
      leave_out(fmt::format("JSON messages of more than {} bytes", topic_options_.longest_json),
                part(topic.too_long));
    }
    if (topic.other_form > 0)
      leave_out("messages that are not CDR of version 1", part(topic.other_form));
    if (topic.longer > 0) {
      recording_.warnings.push_back(fmt::format(
          "{}: {} messages are longer than their description; check the values, the description "
          "may be that of another version",
          topic.name, topic.longer));
    }
    if (topic.samples->repeated() > 0) {
      leave_out("values of a name that a message has twice",
                fmt::format("{} of {}", topic.samples->repeated(), topic.name));
    }
    if (topic.cdr != nullptr) {
      for (const std::string& field : topic.cdr->too_long()) {
        leave_out(
            fmt::format("sequences of more than {} elements", topic_options_.longest_sequence),
            fmt::format("{}.{}", topic.name, field));
      }
    }
  }

  void add_channels(const std::vector<Topic*>& topics, const std::vector<ChosenTime>& chosen) {
    std::int64_t start = INT64_MAX;
    for (std::size_t i = 0; i < topics.size(); ++i) {
      const auto& times = topics[i]->times.of(chosen[i].source);
      start = std::min(start, *std::min_element(times.begin(), times.end()));
    }
    std::array<std::size_t, 3> of_source{};
    for (std::size_t i = 0; i < topics.size(); ++i) {
      Topic& topic = *topics[i];
      ++of_source[static_cast<std::size_t>(chosen[i].source)];
      std::vector<double> time;
      time.reserve(topic.times.logged.size());
      for (const std::int64_t t : topic.times.of(chosen[i].source)) {
        // no threshold: nanoseconds; the difference of two times since an epoch may leave 63 bits
        time.push_back(1e-9 * static_cast<double>(static_cast<std::uint64_t>(t) -
                                                  static_cast<std::uint64_t>(start)));
      }
      topic.times = {};
      RecordedChannel like;
      like.group = topic.name;
      like.comment = fmt::format("{}{}time: {}", topic.type, topic.type.empty() ? "" : ", ",
                                 words_of(chosen[i].source));
      topic.samples->finish(time, like, &recording_);
      topic.samples.reset();
      if (!chosen[i].why_not_header.empty()) {
        recording_.warnings.push_back(fmt::format("{}: {} is taken, {}", topic.name,
                                                  words_of(chosen[i].source),
                                                  chosen[i].why_not_header));
      }
    }
    recording_.format += "; time:";
    const char* separator = " ";
    for (std::size_t s = 0; s < of_source.size(); ++s) {
      if (of_source[s] == 0) continue;
      recording_.format +=
          fmt::format("{}{} of {} topic{}", separator, words_of(static_cast<TimeSource>(s)),
                      of_source[s], of_source[s] == 1 ? "" : "s");
      separator = ", ";
    }
  }

  struct Described {
    std::shared_ptr<const Ros2Definition> definition;
    std::string refusal;
  };
  static constexpr std::int64_t kTimesOfMessage = 3;  // no threshold: see TopicTimes
  const std::string& file_;
  const RecordingOptions& options_;
  TopicOptions topic_options_;
  SampleBudget budget_;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, Described> definitions_;
  std::map<std::uint16_t, std::size_t> channels_;  ///< to topics
  std::map<std::tuple<std::string, std::string, std::uint16_t>, std::size_t> topics_of_key_;
  std::vector<Topic> topics_;
  std::map<std::string, std::string> left_out_;  ///< reason -> names
  Recording recording_;
};

}  // namespace

Recording read_mcap(std::string_view bytes, const std::string& file,
                    const RecordingOptions& options) {
  McapReader reader(file, options);
  const McapSummary summary = read_mcap_records(bytes, file, options.limits, &reader);
  return reader.recording(summary, bytes.size());
}

}  // namespace sparflow
