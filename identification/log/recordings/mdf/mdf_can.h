#pragma once
/// CAN frames that a bus logger kept in an MDF file: groups with the channels CAN_DataFrame.ID, .DataBytes and so on.
/// Source: ASAM MDF bus logging 1.0 (2017), ch. 3 "CAN"; MDF 4.2.0, sections on variable length data (VLSD, MLSD).
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "identification/log/recordings/mdf/mdf_value.h"
#include "identification/log/recordings/recording_formats.h"

namespace sparflow {

/// The channels of a group of frames; null where it has none.
struct MdfFrameChannels {
  const MdfChannel* id = nullptr;  ///< identifier, 11 or 29 bits; bit 31 marks an extended one
  const MdfChannel* extended = nullptr;  ///< 1 for an identifier of 29 bits (IDE)
  const MdfChannel* length = nullptr;    ///< number of bytes (DataLength)
  const MdfChannel* code = nullptr;      ///< code of the length (DLC), where `length` is not there
  const MdfChannel* bytes =
      nullptr;  ///< the frame's data: in the record, or of variable length apart from it
};

/// @return nothing for a group that holds no data frames
std::optional<MdfFrameChannels> frame_channels(const MdfGroup& group);

/// Frames of all groups of a file, decoded in the order of time.
class MdfFrames {
 public:
  /// @param variable data of variable length that the records point into; "" where the data stands in the records
  /// @throws InputError where a channel reaches beyond its record or its data, and beyond the limits of a log
  void add(const MdfFile& file, const MdfRecords& records, const MdfFrameChannels& channels,
           const std::vector<double>& time, std::string_view variable);
  bool empty() const { return frames_.empty(); }
  /// Appends the channels that the databases describe. @throws InputError as CanDecoder
  void decode(const std::string& file, const RecordingOptions& options, Recording* recording);

 private:
  // no threshold: bytes of the longest frame (CAN FD)
  static constexpr std::size_t kFrameBytes = 64;
  struct Frame {
    double time = 0.0;
    std::uint32_t id = 0;
    bool extended = false;
    std::uint8_t size = 0;
    std::uint64_t at = 0;  ///< of its first byte in data_
  };
  std::vector<Frame> frames_;
  std::vector<std::uint8_t> data_;
};

}  // namespace sparflow
