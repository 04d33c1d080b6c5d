#pragma once
/// Unpacks the chunks of an MCAP file.
/// Source: MCAP specification (mcap.dev/spec), "Chunk"; registry, "Well-known compression formats".
#include <cstdint>
#include <string>
#include <string_view>

namespace sparflow {

/// A chunk as the file says it is; nothing of it is checked yet.
struct McapChunk {
  std::string_view compression;  ///< "", "lz4" or "zstd"
  std::string_view packed;
  std::uint64_t size = 0;  ///< [byte] of the records when they are unpacked
  std::uint32_t crc = 0;   ///< of the unpacked records; 0: the writer gave none
};

/// Keeps its memory from one chunk to the next.
class McapUnpacker {
 public:
  /// @param most largest size that is unpacked [byte]
  /// @param records the unpacked records, valid until the next call or until the file's bytes end
  /// @return "" or the end of a sentence: what is wrong with the chunk and what to do
  std::string unpack(const McapChunk& chunk, std::uint64_t most, std::string_view* records);

 private:
  std::string unpack_zstd(const McapChunk& chunk);
  std::string unpack_lz4(const McapChunk& chunk);
  std::string buffer_;
};

}  // namespace sparflow
