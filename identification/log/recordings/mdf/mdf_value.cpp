#include "identification/log/recordings/mdf/mdf_value.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "models/math/nan.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: flags of the standard (cn_flags)
constexpr std::uint32_t kAllInvalid = 1, kHasInvalidBit = 2;

std::size_t bytes_of(const MdfChannel& channel) {
  return (static_cast<std::size_t>(channel.bit_offset) + channel.bit_count + 7) / 8;
}

bool big(const MdfChannel& channel) {
  return channel.data <= MdfChannel::kRealBig && channel.data % 2 == 1;
}

/// The number of IEEE 754 binary16 with these bits.
double half(std::uint64_t bits) {
  const auto exponent = static_cast<int>(bits >> 10U & 0x1FU);
  const auto fraction = static_cast<double>(bits & 0x3FFU);
  // no threshold: exponent and fraction of the format
  double value = std::ldexp(fraction, -24);
  if (exponent == 31) {
    value = fraction == 0.0 ? std::numeric_limits<double>::infinity() : kNaN;
  } else if (exponent > 0) {
    value = std::ldexp(fraction + 1024.0, exponent - 25);
  }
  return (bits & 0x8000U) != 0 ? -value : value;
}

std::uint64_t bits_at(const char* at, const MdfChannel& channel) {
  const std::size_t size = bytes_of(channel);
  // The lowest bits come first; a ninth byte holds bits that eight cannot when the first bit is not the byte's first.
  std::uint64_t low = 0, ninth = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const auto byte = static_cast<unsigned char>(at[big(channel) ? size - 1 - i : i]);
    if (i < 8) {
      low |= static_cast<std::uint64_t>(byte) << (8 * i);
    } else {
      ninth = byte;
    }
  }
  std::uint64_t bits = low >> channel.bit_offset;
  if (size > 8) bits |= ninth << (64 - channel.bit_offset);
  if (channel.bit_count < 64) bits &= (std::uint64_t{1} << channel.bit_count) - 1;
  return bits;
}

double number(std::uint64_t bits, const MdfChannel& channel) {
  switch (channel.data) {
    case MdfChannel::kSignedLittle:
    case MdfChannel::kSignedBig: {
      const std::uint64_t sign = std::uint64_t{1} << (channel.bit_count - 1);
      return static_cast<double>(static_cast<std::int64_t>((bits ^ sign) - sign));
    }
    case MdfChannel::kRealLittle:
    case MdfChannel::kRealBig: {
      if (channel.bit_count == 16) return half(bits);
      if (channel.bit_count == 32) {
        const auto word = static_cast<std::uint32_t>(bits);
        float value = 0.0F;
        std::memcpy(&value, &word, 4);
        return static_cast<double>(value);
      }
      double value = 0.0;
      std::memcpy(&value, &bits, 8);
      return value;
    }
    default:
      return static_cast<double>(bits);
  }
}

}  // namespace

void check_place(const MdfFile& file, const MdfRecords& records, const MdfChannel& channel) {
  const auto fail = [&](const std::string& message) {
    file.fail(channel.at, "CN",
              fmt::format("channel {}: {}; the file is damaged", printable(channel.name), message));
  };
  if ((channel.flags & kHasInvalidBit) != 0 &&
      channel.invalid_bit / 8 >= records.group->invalid_bytes) {
    fail(fmt::format("its invalidation bit {} lies beyond the {} bytes of its record for them",
                     channel.invalid_bit, records.group->invalid_bytes));
  }
  if (channel.is_virtual()) return;
  if (channel.is_number()) {
    const bool real = channel.data >= MdfChannel::kRealLittle;
    if (channel.bit_offset > 7 || channel.bit_count == 0 || channel.bit_count > 64 ||
        (real && channel.bit_count != 16 && channel.bit_count != 32 && channel.bit_count != 64)) {
      fail(fmt::format("{} {} bits from bit {}, expected {}",
                       real ? "a real number of" : "an integer of", channel.bit_count,
                       channel.bit_offset, real ? "16, 32 or 64" : "1 to 64"));
    }
  }
  if (channel.byte_offset > records.group->data_bytes ||
      bytes_of(channel) > records.group->data_bytes - channel.byte_offset) {
    fail(fmt::format("bytes {} to {} lie beyond its record of {} bytes", channel.byte_offset,
                     channel.byte_offset + bytes_of(channel), records.group->data_bytes));
  }
}

void check_bits(const MdfFile& file, const MdfRecords& records, const MdfChannel& channel) {
  if (channel.is_virtual() || channel.bit_offset > 7 || channel.bit_count == 0 ||
      channel.bit_count > 64) {
    file.fail(channel.at, "CN",
              fmt::format("channel {}: an integer of {} bits from bit {}, expected 1 to 64; the "
                          "file is damaged",
                          printable(channel.name), channel.bit_count, channel.bit_offset));
  }
  check_place(file, records, channel);
}

std::uint64_t mdf_bits(const MdfRecords& records, const MdfChannel& channel, std::size_t record) {
  return bits_at(records.data.data() + record * records.stride + channel.byte_offset, channel);
}

double mdf_raw(const MdfRecords& records, const MdfChannel& channel, std::size_t record) {
  if (channel.is_virtual()) return static_cast<double>(record);
  return number(mdf_bits(records, channel, record), channel);
}

bool mdf_valid(const MdfRecords& records, const MdfChannel& channel, std::size_t record) {
  if ((channel.flags & kAllInvalid) != 0) return false;
  if ((channel.flags & kHasInvalidBit) == 0) return true;
  const std::size_t byte = record * records.invalid_stride + channel.invalid_bit / 8;
  return (static_cast<unsigned char>(records.invalid[byte]) >> (channel.invalid_bit % 8) & 1U) == 0;
}

std::vector<double> mdf_values(const MdfRecords& records, const MdfChannel& channel) {
  std::vector<double> values(records.count);
  const bool whole = channel.data < MdfChannel::kRealLittle;
  const bool maybe_invalid = (channel.flags & (kAllInvalid | kHasInvalidBit)) != 0;
  const MdfConversion& rule = *channel.conversion;
  for (std::size_t i = 0; i < records.count; ++i) {
    double value = mdf_raw(records, channel, i);
    if (!rule.identity()) value = rule.value(value, whole);
    if (!std::isfinite(value) || (maybe_invalid && !mdf_valid(records, channel, i))) value = kNaN;
    values[i] = value;
  }
  return values;
}

}  // namespace sparflow
