#include "identification/log/recordings/mdf/mdf_can.h"

#include <fmt/format.h>

#include <algorithm>

#include "identification/log/recordings/can/can_decoder.h"

namespace sparflow {
namespace {

// no threshold: the mark of an extended identifier, and bytes that a code of 9 to 15 stands for (CAN FD, ISO 11898-1)
constexpr std::uint32_t kExtendedMark = 0x80000000U, kIdentifier = 0x1FFFFFFFU;
constexpr std::array<std::uint8_t, 16> kBytesOfCode = {0, 1,  2,  3,  4,  5,  6,  7,
                                                       8, 12, 16, 20, 24, 32, 48, 64};

const MdfChannel* part(const MdfGroup& group, std::string_view name) {
  for (const char* prefix : {"CAN_DataFrame.", ""}) {
    for (const MdfChannel& channel : group.channels) {
      if (channel.name == std::string(prefix) + std::string(name)) return &channel;
    }
  }
  return nullptr;
}

/// Bytes of a frame in its record. @throws InputError where they reach beyond it
std::string_view in_record(const MdfFile& file, const MdfRecords& records,
                           const MdfChannel& channel, std::size_t record) {
  const std::size_t size = channel.bit_count / 8;
  if (channel.byte_offset + size > records.group->data_bytes) {
    file.fail(channel.at, "CN",
              fmt::format("its {} bytes from byte {} reach beyond the record of {} bytes", size,
                          channel.byte_offset, records.group->data_bytes));
  }
  return records.data.substr(record * records.stride + channel.byte_offset, size);
}

/// The channel that says how many bytes of a field of limited length (MLSD) are used; null for other fields.
/// @throws InputError where the group has no such channel of numbers
const MdfChannel* length_of(const MdfFile& file, const MdfGroup& group, const MdfChannel& field) {
  if (field.type != MdfChannel::kLimited) return nullptr;
  for (const MdfChannel& channel : group.channels)
    if (channel.at == field.content && channel.is_number() && !channel.is_virtual())
      return &channel;
  file.fail(field.at, "CN",
            "no channel of its group holds the length of its data (MLSD); the file is damaged");
}

/// Bytes of a frame that stand apart: four bytes of length, then the data.
std::string_view apart(const MdfFile& file, const MdfChannel& channel, std::string_view variable,
                       std::uint64_t at) {
  constexpr std::size_t kLengthBytes = 4;
  if (at > variable.size() || variable.size() - at < kLengthBytes) {
    file.fail(channel.at, "CN",
              fmt::format("a record points to byte {} of its data of variable length, which has {}",
                          at, variable.size()));
  }
  const std::uint64_t size = mdf_number(variable.data() + at, kLengthBytes);
  if (size > variable.size() - at - kLengthBytes) {
    file.fail(
        channel.at, "CN",
        fmt::format("its value at byte {} claims {} bytes and the data ends before", at, size));
  }
  return variable.substr(at + kLengthBytes, size);
}

}  // namespace

std::optional<MdfFrameChannels> frame_channels(const MdfGroup& group) {
  const bool frames =
      std::any_of(group.channels.begin(), group.channels.end(), [](const MdfChannel& c) {
        return c.name == "CAN_DataFrame" || c.name.starts_with("CAN_DataFrame.");
      });
  if (!frames) return std::nullopt;
  MdfFrameChannels found;
  found.id = part(group, "ID");
  found.extended = part(group, "IDE");
  found.length = part(group, "DataLength");
  found.code = part(group, "DLC");
  found.bytes = part(group, "DataBytes");
  const bool whole = found.id != nullptr && found.id->is_number() && found.bytes != nullptr &&
                     found.bytes->data >= MdfChannel::kBytes;
  return whole ? std::optional(found) : std::nullopt;
}

void MdfFrames::add(const MdfFile& file, const MdfRecords& records,
                    const MdfFrameChannels& channels, const std::vector<double>& time,
                    std::string_view variable) {
  for (const MdfChannel* c : {channels.id, channels.extended, channels.length, channels.code})
    if (c != nullptr) check_bits(file, records, *c);
  const bool elsewhere = channels.bytes->type == MdfChannel::kVariable;
  const MdfChannel* own_length = length_of(file, *records.group, *channels.bytes);
  if (own_length != nullptr) check_bits(file, records, *own_length);
  if (elsewhere) check_bits(file, records, *channels.bytes);
  if (static_cast<std::int64_t>(frames_.size() + records.count) > file.limits().log_values) {
    file.fail(records.group->at, "CG",
              fmt::format("more than {:g} frames in the file, the limit of a log (docs/limits.md)",
                          static_cast<double>(file.limits().log_values)));
  }
  frames_.reserve(frames_.size() + records.count);
  for (std::size_t i = 0; i < records.count; ++i) {
    if (!mdf_valid(records, *channels.bytes, i)) continue;
    const std::string_view data =
        elsewhere ? apart(file, *channels.bytes, variable, mdf_bits(records, *channels.bytes, i))
                  : in_record(file, records, *channels.bytes, i);
    std::uint64_t size = data.size();
    if (own_length != nullptr) size = std::min(size, mdf_bits(records, *own_length, i));
    if (channels.length != nullptr) {
      size = std::min(size, mdf_bits(records, *channels.length, i));
    } else if (channels.code != nullptr) {
      const std::uint64_t code = mdf_bits(records, *channels.code, i);
      size = std::min<std::uint64_t>(
          size, kBytesOfCode[std::min<std::uint64_t>(code, kBytesOfCode.size() - 1)]);
    }
    size = std::min<std::uint64_t>(size, kFrameBytes);
    const auto id = static_cast<std::uint32_t>(mdf_bits(records, *channels.id, i));
    const bool marked = (id & kExtendedMark) != 0;
    const bool extended =
        marked || (channels.extended != nullptr && mdf_bits(records, *channels.extended, i) != 0);
    frames_.push_back(
        {time[i], id & kIdentifier, extended, static_cast<std::uint8_t>(size), data_.size()});
    data_.insert(data_.end(), data.begin(), data.begin() + static_cast<std::ptrdiff_t>(size));
  }
}

void MdfFrames::decode(const std::string& file, const RecordingOptions& options,
                       Recording* recording) {
  std::stable_sort(frames_.begin(), frames_.end(),
                   [](const Frame& a, const Frame& b) { return a.time < b.time; });
  CanDecoder decoder(file, options.dbc_files, options.limits);
  for (const Frame& f : frames_)
    decoder.add({f.time, f.id, f.extended, std::span(data_.data() + f.at, f.size)});
  decoder.finish(recording);
}

}  // namespace sparflow
