#pragma once
/// The description of a ROS 2 message as text (.msg), followed by those of all types that it contains.
/// Source: MCAP registry (mcap.dev/spec/registry), "ros2msg"; ROS 2 documentation, "Interfaces", section on messages.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sparflow {

struct Ros2Field {
  enum class Kind : std::uint8_t {
    kBool,
    kInt8,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kInt64,
    kUint64,
    kFloat32,
    kFloat64,
    kTime,  ///< seconds and nanoseconds (builtin_interfaces/Time and Duration): one number [s]
    kString,
    kStruct
  };
  enum class Repeat : std::uint8_t { kOne, kArray, kSequence };
  std::string name;
  Kind kind = Kind::kBool;
  Repeat repeat = Repeat::kOne;
  std::uint32_t count = 1;  ///< of an array
  std::size_t type = 0;     ///< of kStruct: index of its type
  /// A sequence of texts whose name says that they name the elements of the sequences beside it.
  bool names = false;
};

struct Ros2Type {
  std::string name;  ///< package/Type
  std::vector<Ros2Field> fields;
  std::uint64_t least_bytes = 0;  ///< no value takes fewer bytes in a message, padding apart
  bool has_numbers = false;       ///< it or what it contains
};

/// Types by index; the message is the first.
struct Ros2Definition {
  std::vector<Ros2Type> types;
};

/// Bytes of a number, and its alignment in CDR; 0 for texts and structures.
std::size_t ros2_bytes(Ros2Field::Kind kind);

/// @param name of the message, package/msg/Type or package/Type  @param deepest nesting of types in types
/// @throws TextError with the line as its column, for what is not understood and types that are not described or contain themselves
Ros2Definition parse_ros2_definition(const std::string& name, std::string_view text, int deepest);

}  // namespace sparflow
