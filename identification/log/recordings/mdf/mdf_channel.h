#pragma once
/// The description of an MDF file: data groups, channel groups and channels.
/// Source: ASAM MDF 4.2.0, sections on the HD, DG, CG, CN and SI blocks.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "identification/log/recordings/mdf/mdf_block.h"
#include "identification/log/recordings/mdf/mdf_conversion.h"

namespace sparflow {

struct MdfChannel {
  /// Numbers of the standard (cn_type).
  enum Type : std::uint8_t {
    kFixed,
    kVariable,
    kMaster,
    kVirtualMaster,
    kSynchronisation,
    kLimited,
    kVirtual
  };
  /// Numbers of the standard (cn_data_type); later ones are texts, bytes, dates and complex numbers.
  enum Data : std::uint8_t {
    kUnsignedLittle,
    kUnsignedBig,
    kSignedLittle,
    kSignedBig,
    kRealLittle,
    kRealBig,
    kLatin1,
    kUtf8,
    kUtf16Little,
    kUtf16Big,
    kBytes
  };
  std::uint64_t at = 0;  ///< [byte] place of its block
  std::string name, unit, comment;
  std::uint8_t type = kFixed, sync = 0, data = kUnsignedLittle;
  std::uint32_t bit_offset = 0, byte_offset = 0, bit_count = 0, flags = 0, invalid_bit = 0;
  std::uint64_t content = 0;  ///< link to signal data, or to the channel that holds the length
  std::shared_ptr<const MdfConversion> conversion;
  bool structure = false;  ///< its parts follow as channels of their own
  bool array = false;
  bool is_number() const { return data <= kRealBig; }
  bool is_virtual() const { return type == kVirtualMaster || type == kVirtual; }
};

struct MdfGroup {
  std::uint64_t at = 0;  ///< [byte] place of its block
  std::string name;
  std::uint64_t record_id = 0, cycles = 0, flags = 0, data_bytes = 0, invalid_bytes = 0;
  std::uint64_t master_group = 0;  ///< link to the group whose master it shares; 0 = its own
  std::vector<MdfChannel> channels;
  bool signal_data() const { return (flags & 1U) != 0; }  ///< records of variable length
  std::uint64_t record_bytes() const { return data_bytes + invalid_bytes; }
  /// @return its master of time, or null
  const MdfChannel* master() const;
};

struct MdfDataGroup {
  std::uint64_t at = 0, data = 0;
  std::uint64_t record_id_bytes = 0;
  std::vector<MdfGroup> groups;
};

/// @throws InputError for damaged blocks, circles of links, and more channels than a log has columns
std::vector<MdfDataGroup> mdf_outline(const MdfFile& file, MdfConversions* conversions);

}  // namespace sparflow
