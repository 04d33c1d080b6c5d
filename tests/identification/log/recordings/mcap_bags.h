#pragma once
/// MCAP files that tests read: a bag of two joints and a pressure, and a message with every kind of field.
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "identification/log/recordings/mcap/mcap.h"
#include "tests/identification/log/recordings/mcap_writer.h"

namespace sparflow::test {

inline constexpr std::uint64_t kSecond = 1'000'000'000, kEpoch = 1'700'000'000 * kSecond;
inline constexpr std::uint64_t kDelay = 3'000'000;  // from the stamp to the recorder [ns]

inline std::uint64_t ns_at(double seconds) {
  return kEpoch + static_cast<std::uint64_t>(std::llround(seconds * 1e9));
}

inline const RecordedChannel* find_channel(const Recording& r, const std::string& name) {
  for (const RecordedChannel& c : r.channels)
    if (c.name == name) return &c;
  return nullptr;
}

/// 40 messages of two joints at 100 Hz whose order is turned in every second one, and a pressure at 10 Hz without header.
inline std::string bag_records(bool big = false) {
  std::string all =
      McapWriter::schema(1, "sensor_msgs/msg/JointState", "ros2msg", joint_state_description()) +
      McapWriter::channel(1, 1, "/joint_states", "cdr") +
      McapWriter::schema(2, "std_msgs/msg/Float64", "ros2msg", "float64 data\n") +
      McapWriter::channel(2, 2, "/pump", "cdr");
  for (int i = 0; i < 40; ++i) {
    const double t = 0.01 * i;
    JointStates joints{1.7e9 + t, {"boom", "arm"}, {0.1 * i, -0.2 * i}, {1.0, 2.0 + i}, {}};
    if (i % 2 == 1) {
      std::swap(joints.names[0], joints.names[1]);
      std::swap(joints.position[0], joints.position[1]);
      std::swap(joints.velocity[0], joints.velocity[1]);
    }
    all += McapWriter::message(1, ns_at(t) + kDelay, ns_at(t) + kDelay, joint_state(joints, big));
    if (i % 10 == 0) {
      all += McapWriter::message(2, ns_at(t) + kDelay, ns_at(t),
                                 CdrMessage(big).put(200.0 + i).bytes());
    }
  }
  return all;
}

/// A type with every kind of field; the alignment of each is that of its number.
inline const char* const kMixed =
    "uint8 MODE_OFF=0\nstring NAME = \"a # b\"\nbool on\nfloat64 wide   # [bar]\nbyte raw\n"
    "int16[3] three\nstring<=10 label \"none\"\nint32[<=4] few\nfloat32 half -0.5\n"
    "other_msgs/Point[] path\nPart part\nint64 big\nchar letter\nuint64[2] counts\n"
    "builtin_interfaces/Duration span\nuint16[] pixels\n"
    "=========================\nMSG: other_msgs/msg/Point\nint8 x\nfloat64 y\n"
    "=========================\nMSG: my_msgs/Part\nEmpty nothing\nuint32 u\nuint16 v\n"
    "=========================\nMSG: my_msgs/Empty\n";

/// A message of that type. @param path and pixels numbers of elements of its sequences
inline std::string mixed(bool big, std::size_t path, std::size_t pixels) {
  CdrMessage m(big);
  m.put(std::uint8_t{1}).put(-12.5).put(std::uint8_t{255});
  for (const int v : {-1, 2, -3}) m.put(static_cast<std::int16_t>(v));
  m.put(std::string("odd")).put(std::vector<std::int32_t>{7, -8}).put(-0.25F);
  m.put(static_cast<std::uint32_t>(path));
  for (std::size_t i = 0; i < path; ++i)
    m.put(static_cast<std::int8_t>(-5 - static_cast<int>(i))).put(1.5 * static_cast<double>(i));
  m.put(std::uint8_t{0}).put(std::uint32_t{4'000'000'000}).put(std::uint16_t{65535});
  m.put(std::int64_t{-9'000'000'000}).put(std::uint8_t{'z'});
  m.put(std::uint64_t{1} << 40U).put(std::uint64_t{3});
  m.put(std::int32_t{-2}).put(std::uint32_t{500'000'000});
  return m.put(std::vector<std::uint16_t>(pixels, 9)).bytes();
}

}  // namespace sparflow::test
