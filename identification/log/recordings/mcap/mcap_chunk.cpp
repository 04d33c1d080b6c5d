#include "identification/log/recordings/mcap/mcap_chunk.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>

#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: the densest that the formats can be. Zstandard repeats one byte 128 KiB long in a block of four bytes
// (RFC 8878, 3.1.1.2), LZ4 lengthens a copy by 255 with each byte; and the frame of an empty content
constexpr std::uint64_t kDensestZstd = 32768, kDensestLz4 = 255, kFrame = 64;

std::uint32_t crc_of(std::string_view bytes) {
  uLong crc = crc32(0, nullptr, 0);
  // zlib counts in 32 bits: the bytes are given in pieces.
  constexpr std::size_t kCrcPiece = 1U << 30U;  // no threshold: below the counter's end
  for (std::size_t at = 0; at < bytes.size(); at += kCrcPiece) {
    const std::string_view piece = bytes.substr(at, kCrcPiece);
    crc = crc32(crc, reinterpret_cast<const Bytef*>(piece.data()), static_cast<uInt>(piece.size()));
  }
  return static_cast<std::uint32_t>(crc);
}

std::string wrong_size(const char* method, std::uint64_t got, std::uint64_t wanted) {
  return fmt::format("its {} data gives {} bytes of {}; the file is damaged", method, got, wanted);
}

}  // namespace

std::string McapUnpacker::unpack(const McapChunk& chunk, std::uint64_t most,
                                 std::string_view* records) {
  std::uint64_t densest = 1;
  if (chunk.compression == "zstd") densest = kDensestZstd;
  if (chunk.compression == "lz4") densest = kDensestLz4;
  if (densest == 1 && !chunk.compression.empty()) {
    return fmt::format("compression \"{}\", expected none, lz4 or zstd; convert the file",
                       printable(chunk.compression));
  }
  if (chunk.size > densest * (chunk.packed.size() + kFrame)) {
    return fmt::format("{} packed bytes cannot hold {}; the file is damaged", chunk.packed.size(),
                       chunk.size);
  }
  if (chunk.size > most) {
    return fmt::format(
        "its {} bytes are more than the {} that are left of the limit of a log "
        "(docs/limits.md); cut the recording into shorter files",
        chunk.size, most);
  }
  std::string problem;
  if (densest == 1) {
    *records = chunk.packed;
    if (chunk.size != chunk.packed.size())
      problem = wrong_size("stored", chunk.packed.size(), chunk.size);
  } else {
    buffer_.resize(chunk.size);
    problem = densest == kDensestZstd ? unpack_zstd(chunk) : unpack_lz4(chunk);
    *records = buffer_;
  }
  if (!problem.empty() || chunk.crc == 0) return problem;
  const std::uint32_t crc = crc_of(*records);
  if (crc == chunk.crc) return "";
  return fmt::format(
      "its records have the checksum {:08X}, expected {:08X}; the file is damaged, copy it again",
      crc, chunk.crc);
}

std::string McapUnpacker::unpack_zstd(const McapChunk& chunk) {
  const std::size_t got =
      ZSTD_decompress(buffer_.data(), buffer_.size(), chunk.packed.data(), chunk.packed.size());
  if (ZSTD_isError(got) != 0) {
    return fmt::format("its zstd data cannot be unpacked ({}); the file is damaged",
                       ZSTD_getErrorName(got));
  }
  return got == buffer_.size() ? "" : wrong_size("zstd", got, chunk.size);
}

std::string McapUnpacker::unpack_lz4(const McapChunk& chunk) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0)
    throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, LZ4F_freeDecompressionContext);
  std::size_t in = 0, out = 0, wanted = 1;
  while (in < chunk.packed.size()) {
    std::size_t taken = chunk.packed.size() - in, given = buffer_.size() - out;
    wanted = LZ4F_decompress(context.get(), buffer_.data() + out, &given, chunk.packed.data() + in,
                             &taken, nullptr);
    if (LZ4F_isError(wanted) != 0) {
      return fmt::format("its lz4 data cannot be unpacked ({}); the file is damaged",
                         LZ4F_getErrorName(wanted));
    }
    in += taken;
    out += given;
    if (taken == 0 && given == 0) break;  // the buffer is full and more would come
  }
  const bool whole = wanted == 0 && in == chunk.packed.size() && out == buffer_.size();
  return whole ? "" : wrong_size("lz4", out, chunk.size);
}

}  // namespace sparflow
