#pragma once
/// Makes channels of CAN frames by the databases that describe them.
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "identification/log/recordings/can/dbc.h"
#include "identification/log/recordings/recording.h"
#include "models/math/door.h"

namespace sparflow {

struct CanFrame {
  double time = 0.0;  ///< [s]
  std::uint32_t id = 0;
  bool extended = false;
  std::span<const std::uint8_t> data;
};

class CanDecoder {
 public:
  /// @throws InputError as parse_dbc
  CanDecoder(std::string file, const std::vector<std::string>& dbc_files, const DoorLimits& limits);
  /// @throws InputError where a log would have too many values
  void add(const CanFrame& frame);
  /// Appends the channels, one a signal; its group is its message.
  /// @throws InputError when no frame is described by a database, with the identifiers seen
  void finish(Recording* recording);

 private:
  struct Samples {
    std::vector<double> time, values;
  };
  struct Message {
    const DbcMessage* description = nullptr;
    std::vector<Samples> samples;
  };
  std::string file_;
  DoorLimits limits_;
  std::vector<Dbc> databases_;
  std::map<std::uint64_t, Message> messages_;
  std::map<std::uint64_t, std::int64_t>
      unknown_;  ///< frames of each identifier without description
  std::int64_t values_ = 0, short_ = 0;
};

}  // namespace sparflow
