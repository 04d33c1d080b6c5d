#pragma once
/// The door of every input file: its limits, checked before work starts, and its text as UTF-8. docs/limits.md lists them.
#include <cstdint>
#include <functional>
#include <string>

namespace sparflow {

/// Limits of the inputs. They lie far above what a machine or a log needs; beyond them a file is damaged, hostile or not
/// what it was taken for, and reading it on would cost memory and time before anything could be said about it.
struct DoorLimits {
  /// Largest machine, problem, model, mapping, effect, plant or URDF file.
  /// @threshold [byte] 1e6..1e9; chosen: a model with fifty cylinders takes 5 MB
  std::int64_t text_bytes = 64'000'000;
  /// Largest log.
  /// @threshold [byte] 1e8..1e12; chosen: twenty hours of forty channels at 100 Hz
  std::int64_t log_bytes = 4'000'000'000;
  /// Largest number of columns of a log.
  /// @threshold [1] 100..1e6; chosen: ten times those of a whole vehicle bus
  std::int64_t log_columns = 10'000;
  /// Largest number of values of a log that are kept: rows times columns with a meaning.
  /// @threshold [1] 1e7..1e10; chosen: ten million rows of forty channels, 3.2 GB
  std::int64_t log_values = 400'000'000;
  /// Deepest nesting of a YAML or JSON file.
  /// @threshold [1] 20..400; chosen: the files of this program nest six deep; the readers call themselves at each level
  int nesting = 64;
  /// Largest number of values of a YAML file, repetitions by aliases included.
  /// @threshold [1] 1e4..1e7; chosen: a thousand obstacles take ten thousand
  std::int64_t yaml_values = 500'000;
  /// Deepest nesting of elements in a URDF file.
  /// @threshold [1] 20..400; chosen: URDF nests six deep; the XML library calls itself at each level
  int xml_nesting = 64;
  /// Largest number of joints, links, cylinders, pumps or valves of a machine, and of joints or links of a URDF.
  /// @threshold [1] 50..10000; chosen: ten times those of a large excavator
  int machine_parts = 256;
};

/// Whether there is a regular file of this name. A name that no file can have (too long, with a zero byte, without
/// permission to look) means no, since names come from files as well.
bool is_file(const std::string& path);

/// Where warnings of the doors go (a file that is not UTF-8); without a listener they are dropped.
void set_door_listener(std::function<void(const std::string&)> listener);

/// The whole file as bytes, from a regular file, a pipe or a device. @param limit [byte]
/// @throws InputError for a folder, a file that cannot be read, and one above `limit`
std::string read_bytes(const std::string& path, std::int64_t limit);

/// The text of a machine, problem, model, mapping, effect or URDF file as UTF-8.
/// @throws InputError as `read_bytes`, and for what is no text
std::string read_text(const std::string& path);

}  // namespace sparflow
