#pragma once
/// Takes numbers and bytes of channels out of records.
/// Source: ASAM MDF 4.2.0, sections "Reading the signal value" and "Invalidation bits".
#include <cstdint>
#include <string_view>
#include <vector>

#include "identification/log/recordings/mdf/mdf_channel.h"

namespace sparflow {

/// The records of a channel group, one after another.
struct MdfRecords {
  const MdfGroup* group = nullptr;
  std::string_view data;  ///< records of `stride` bytes
  std::string_view
      invalid;  ///< bytes of `invalid_stride` a record: behind the data or apart from it
  std::size_t count = 0, stride = 0, invalid_stride = 0;
};

/// @throws InputError where the channel reaches beyond its record, or has bits that no number has
void check_place(const MdfFile& file, const MdfRecords& records, const MdfChannel& channel);
/// The same for a channel of any type whose bits are read as an integer (`mdf_bits`).
void check_bits(const MdfFile& file, const MdfRecords& records, const MdfChannel& channel);

/// The stored number, before its conversion; of a virtual channel the record's number. `check_place` holds.
double mdf_raw(const MdfRecords& records, const MdfChannel& channel, std::size_t record);
/// The same without the loss of digits, of an integer of at most 64 bits.
std::uint64_t mdf_bits(const MdfRecords& records, const MdfChannel& channel, std::size_t record);
bool mdf_valid(const MdfRecords& records, const MdfChannel& channel, std::size_t record);

/// @return physical values, one a record, NaN where invalid
std::vector<double> mdf_values(const MdfRecords& records, const MdfChannel& channel);

}  // namespace sparflow
