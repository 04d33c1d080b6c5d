#pragma once
/// Takes the numbers out of messages in the Common Data Representation (CDR), as ROS 2 records them.
/// Source: OMG, "DDS Interoperability Wire Protocol (DDSI-RTPS)" 2.5, ch. 10 (encapsulation, XCDR version 1); OMG,
///   "Extensible and Dynamic Topic Types for DDS" 1.3, 7.4.1.
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "identification/log/recordings/mcap/ros2_definition.h"
#include "identification/log/recordings/mcap/topic_samples.h"

namespace sparflow {

/// Whether a message is what its description says.
enum class MessageState : std::uint8_t {
  kRead,
  kLonger,     ///< read, but bytes follow
  kDamaged,    ///< it ends before its description does, or is no such text
  kOtherForm,  ///< not XCDR version 1
  kTooLong,    ///< JSON of more than TopicOptions::longest_json
};

/// Numbers of messages of one topic.
class CdrReader {
 public:
  CdrReader(std::shared_ptr<const Ros2Definition> definition, const TopicOptions& options);

  /// Adds the message's numbers to `samples`; whether they are kept is the caller's decision.
  MessageState read(std::string_view message, TopicSamples* samples);
  /// [ns] of the last message's header (a field of the type std_msgs/Header); nothing where it has none.
  std::optional<std::int64_t> stamp() const { return stamp_; }
  /// Sequences that were left out because they are longer than TopicOptions allows.
  const std::set<std::string>& too_long() const { return too_long_; }

 private:
  using Place = std::optional<TopicSamples::Place>;  ///< nothing: its numbers are not wanted
  struct ElementNames {
    std::vector<std::string_view> kept;  ///< at most TopicOptions::longest_sequence
    std::uint32_t count = 0;             ///< of the message
  };
  bool structure(std::size_t type, Place place, std::size_t depth);
  bool several(const Ros2Field& field, Place place, std::size_t depth);
  bool one(const Ros2Field& field, Place place, std::size_t depth);
  bool text(std::string_view* text);
  bool number(Ros2Field::Kind kind, double* value);
  bool count(std::uint32_t* value);
  bool align(std::size_t size);
  bool skip(std::uint64_t size);
  std::uint64_t bits(std::size_t size);
  bool can_matter(const Ros2Field& field) const;

  std::shared_ptr<const Ros2Definition> definition_;
  TopicOptions options_;
  std::string_view data_;  ///< behind the encapsulation
  std::size_t at_ = 0;
  bool big_ = false;
  TopicSamples* samples_ = nullptr;
  bool header_ = false;  ///< the next time is the header's
  std::optional<std::int64_t> stamp_;
  std::vector<ElementNames> names_;  ///< of elements, for each depth of structures
  std::set<std::string> too_long_;
};

}  // namespace sparflow
