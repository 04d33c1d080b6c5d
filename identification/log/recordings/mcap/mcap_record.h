#pragma once
/// Walks through the records of an MCAP file in their order, inside and outside of chunks. Every length is compared with
/// what is left of its record before anything is read.
/// Source: MCAP specification, version 0 (mcap.dev/spec).
#include <cstdint>
#include <string>
#include <string_view>

#include "identification/log/recordings/mcap/mcap_chunk.h"
#include "models/math/door.h"

namespace sparflow {

struct McapSchema {
  std::uint16_t id = 0;
  std::string name, encoding, data;
};

struct McapChannel {
  std::uint16_t id = 0, schema = 0;  ///< schema 0: it has none
  std::string topic, encoding;
};

/// The data points into the file or into a chunk, until the next message.
struct McapMessage {
  std::uint16_t channel = 0;
  std::uint64_t log_time = 0, publish_time = 0;  ///< [ns]
  std::string_view data;
};

/// Gets what the file holds, in its order.
class McapVisitor {
 public:
  virtual ~McapVisitor() = default;
  virtual void schema(const McapSchema& schema) = 0;
  virtual void channel(const McapChannel& channel) = 0;
  /// @return false where no channel of this number was given before: the file is damaged
  virtual bool message(const McapMessage& message) = 0;
};

struct McapSummary {
  std::string profile;   ///< "ros2", "ros1", "" or another
  bool finished = true;  ///< the writer wrote the end of the file
  std::uint64_t read_to =
      0;  ///< [byte] behind the last whole record of a file that was not finished
};

/// @return whether the first bytes are those of an MCAP file, of any version
bool is_mcap(std::string_view bytes);

/// @param visitor gets all schemas, channels and messages up to the end of the data section
/// @throws InputError with the byte of what is damaged, where all chunks together are larger than a log may be, and for
///   another version than 0. Of a file without an end, what follows the last whole record is left out.
McapSummary read_mcap_records(std::string_view bytes, const std::string& file,
                              const DoorLimits& limits, McapVisitor* visitor);

}  // namespace sparflow
