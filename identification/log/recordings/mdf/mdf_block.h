#pragma once
/// Blocks of an MDF 4 file. Every length and link is compared with the file's size before anything is read.
/// Source: ASAM MDF 4.2.0 (2019), ch. 5 "Block structure"; public outline at asam.net/standards/detail/mdf/wiki.
#include <cstdint>
#include <string>
#include <string_view>

#include "models/math/door.h"

namespace sparflow {

/// Little-endian number of `size` bytes, at most eight.
std::uint64_t mdf_number(const char* at, std::size_t size);

/// A block whose header, links and data lie within the file.
struct MdfBlock {
  std::uint64_t at = 0;    ///< [byte] place in the file
  std::string_view id;     ///< two letters, e.g. "CG"
  std::string_view links;  ///< eight bytes each
  std::string_view data;   ///< behind the links
  std::size_t link_count() const { return links.size() / 8; }
  std::uint64_t link(std::size_t i) const {
    return i < link_count() ? mdf_number(links.data() + 8 * i, 8) : 0;
  }
};

class MdfFile {
 public:
  /// @throws InputError where the identification block is not that of a file of version 4
  MdfFile(std::string_view bytes, std::string file, const DoorLimits& limits);

  /// @param wanted two letters, or "" for any  @throws InputError for another block and one that leaves the file
  MdfBlock block(std::uint64_t at, std::string_view wanted) const;
  /// Number of `size` bytes at `offset` of a block's data. @throws InputError where the block is too short
  std::uint64_t number(const MdfBlock& block, std::size_t offset, std::size_t size) const;
  double real(const MdfBlock& block, std::size_t offset) const;  ///< as `number`, of eight bytes
  /// Text of a TX block, or the first element TX of an MD block; "" for a link of 0. Long texts are cut.
  std::string text(std::uint64_t at) const;
  [[noreturn]] void fail(std::uint64_t at, std::string_view id, const std::string& message) const;
  [[noreturn]] void fail(const MdfBlock& block, const std::string& message) const {
    fail(block.at, block.id, message);
  }

  std::string_view bytes() const { return bytes_; }
  const std::string& name() const { return file_; }
  const DoorLimits& limits() const { return limits_; }
  int version() const { return version_; }  ///< e.g. 410
  /// The writer was stopped: counts of records may be missing.
  bool unfinished() const { return unfinished_; }

 private:
  std::string_view bytes_;
  std::string file_;
  DoorLimits limits_;
  int version_ = 0;
  bool unfinished_ = false, last_block_open_ = false;
};

/// @return whether the first bytes are those of an MDF file, of any version
bool is_mdf(std::string_view bytes);

}  // namespace sparflow
