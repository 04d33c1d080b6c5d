#pragma once
/// Writes MCAP files and CDR messages for tests, from the text of the specifications and without the reader's code:
/// mcap.dev/spec (records), LZ4 frame format, RFC 8878 (Zstandard), and XCDR version 1 of DDS-XTypes 1.3, 7.4.1.
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace sparflow::test {

/// A number's bytes, the lowest first.
inline std::string low_first(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

/// A message in CDR: each number stands at a multiple of its size, counted from behind the first four bytes.
class CdrMessage {
 public:
  explicit CdrMessage(bool big = false) : big_(big) {
    bytes_ = big ? std::string("\0\0\0\0", 4) : std::string("\0\1\0\0", 4);
  }
  template <typename Number>
  CdrMessage& put(Number value) {
    while ((bytes_.size() - 4) % sizeof(Number) != 0) bytes_ += '\xAA';  // padding has any value
    char raw[sizeof(Number)];
    std::memcpy(raw, &value, sizeof(Number));  // of this machine, whose lowest byte comes first
    if (big_) std::reverse(std::begin(raw), std::end(raw));
    bytes_.append(raw, sizeof(Number));
    return *this;
  }
  CdrMessage& put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text + '\0';
    return *this;
  }
  template <typename Element>
  CdrMessage& put(const std::vector<Element>& sequence) {
    put(static_cast<std::uint32_t>(sequence.size()));
    for (const Element& element : sequence) put(element);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_;
  std::string bytes_;
};

struct McapCompression {
  std::string name;  ///< "", "lz4", "zstd"
  bool crc = true;
};

class McapWriter {
 public:
  McapWriter() : file_(magic()) { file_ += record(0x01, text("ros2") + text("test")); }

  static std::string magic() { return "\x89MCAP0\r\n"; }
  static std::string record(unsigned opcode, const std::string& content) {
    return static_cast<char>(opcode) + low_first(content.size(), 8) + content;
  }
  static std::string text(const std::string& t) { return low_first(t.size(), 4) + t; }
  static std::string schema(unsigned id, const std::string& name, const std::string& encoding,
                            const std::string& data) {
    return record(0x03, low_first(id, 2) + text(name) + text(encoding) + text(data));
  }
  static std::string channel(unsigned id, unsigned schema, const std::string& topic,
                             const std::string& encoding) {
    return record(0x04, low_first(id, 2) + low_first(schema, 2) + text(topic) + text(encoding) +
                            text(text("offered_qos_profiles") + text("")));
  }
  static std::string message(unsigned channel, std::uint64_t log_time, std::uint64_t publish_time,
                             const std::string& data) {
    return record(0x05, low_first(channel, 2) + low_first(7, 4) + low_first(log_time, 8) +
                            low_first(publish_time, 8) + data);
  }
  static std::string chunk(const std::string& records, const McapCompression& c) {
    std::string packed = records;
    if (c.name == "zstd") {
      packed.resize(ZSTD_compressBound(records.size()));
      packed.resize(ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), 3));
    } else if (c.name == "lz4") {
      packed.resize(LZ4F_compressFrameBound(records.size(), nullptr));
      packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), records.data(), records.size(),
                                       nullptr));
    }
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(records.data()), static_cast<uInt>(records.size()));
    return record(0x06, low_first(1, 8) + low_first(2, 8) + low_first(records.size(), 8) +
                            low_first(c.crc ? crc : 0, 4) + text(c.name) +
                            low_first(packed.size(), 8) + packed);
  }

  McapWriter& add(const std::string& records) {
    file_ += records;
    return *this;
  }
  /// Data End, a summary with the statistics, and the footer.
  std::string finished() const {
    const std::string data_end = record(0x0F, low_first(0, 4));
    const std::uint64_t summary = file_.size() + data_end.size();
    const std::string statistics = record(0x0B, std::string(42, '\0') + low_first(0, 4));
    return file_ + data_end + statistics +
           record(0x02, low_first(summary, 8) + low_first(0, 8) + low_first(0, 4)) + magic();
  }
  const std::string& unfinished() const { return file_; }

 private:
  std::string file_;
};

/// The description of sensor_msgs/JointState as rosbag2 stores it.
inline std::string joint_state_description() {
  const std::string line(80, '=');
  return "# positions in rad or m\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\n"
         "float64[] velocity\nfloat64[] effort\n" +
         line + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + line +
         "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

struct JointStates {
  double stamp = 0.0;  ///< [s]
  std::vector<std::string> names;
  std::vector<double> position, velocity, effort;
};

inline std::string joint_state(const JointStates& joints, bool big = false) {
  const auto seconds = static_cast<std::int32_t>(joints.stamp);
  const double rest = (joints.stamp - seconds) * 1e9;
  CdrMessage message(big);
  message.put(seconds).put(static_cast<std::uint32_t>(rest + 0.5)).put(std::string("base"));
  return message.put(joints.names)
      .put(joints.position)
      .put(joints.velocity)
      .put(joints.effort)
      .bytes();
}

}  // namespace sparflow::test
