#include "identification/log/recordings/mdf/mdf_data.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <new>
#include <utility>

#include "models/math/error.h"

namespace sparflow {
namespace {

// no threshold: the densest that deflate can be (zlib, "Technical Details": 1030 to 1), and the size of a header
constexpr std::uint64_t kDensest = 1032, kZlibHeader = 64;
// no threshold: layout of the standard
constexpr std::size_t kZippedAt = 24;

/// The data of `columns` bytes a row, which was stored column by column; what is left behind the last whole row follows as it was.
std::string rows_of_columns(const std::string& in, std::size_t columns) {
  std::string out(in.size(), '\0');
  const std::size_t rows = in.size() / columns;
  for (std::size_t c = 0; c < columns; ++c) {
    const char* from = in.data() + c * rows;
    for (std::size_t r = 0; r < rows; ++r) out[r * columns + c] = from[r];
  }
  std::copy(in.begin() + static_cast<std::ptrdiff_t>(rows * columns), in.end(),
            out.begin() + static_cast<std::ptrdiff_t>(rows * columns));
  return out;
}

}  // namespace

void MdfData::Part::add(std::string_view bytes) {
  if (!several && piece.empty()) {
    piece = bytes;
    return;
  }
  if (!several) all = piece;
  several = true;
  all += bytes;
}

void MdfData::Part::add(std::string&& bytes) {
  if (piece.empty() && !several) {
    all = std::move(bytes);
    several = true;
  } else {
    add(std::string_view(bytes));
  }
}

std::string_view MdfData::Part::take(std::deque<std::string>* kept) {
  if (!several) return piece;
  kept->push_back(std::move(all));
  return kept->back();
}

MdfBytes MdfData::joined(std::uint64_t at, std::string_view kind) {
  MdfBytes bytes;
  if (at == 0) return bytes;
  MdfBlock block = file_.block(at, "");
  visit(block);
  if (block.id == "HL") {
    block = file_.block(block.link(0), "");
    visit(block);
    if (block.id != "DL" && block.id != "LD") file_.fail(block, "expected a list (##DL or ##LD)");
  }
  Part data, invalid;
  if (block.id == "DL" || block.id == "LD") {
    bytes.apart =
        block.id == "LD" && (file_.number(block, 0, 4) & 0x80000000U) != 0;  // no threshold: bit 31
    add_list(block, kind, &data, &invalid);
  } else {
    add_block(block, kind, &data);
  }
  bytes.data = data.take(&kept_);
  bytes.invalid = invalid.take(&kept_);
  return bytes;
}

void MdfData::visit(const MdfBlock& block) {
  if (seen_.insert(block.at).second) return;
  file_.fail(block, "links lead to this block twice; the file is damaged");
}

void MdfData::add_list(const MdfBlock& first, std::string_view kind, Part* data, Part* invalid) {
  MdfBlock list = first;
  for (;;) {
    const bool columns = list.id == "LD";
    const std::uint64_t flags = file_.number(list, 0, columns ? 4 : 1);
    const std::uint64_t count = file_.number(list, 4, 4);
    const bool apart = columns && (flags & 0x80000000U) != 0;  // no threshold: bit 31
    if (count > list.link_count() || 1 + count * (apart ? 2 : 1) > list.link_count()) {
      file_.fail(list, fmt::format("{} data blocks and {} links; the file is damaged", count,
                                   list.link_count()));
    }
    for (std::size_t i = 0; i < count; ++i) {
      for (Part* part : {data, invalid}) {
        if (part == invalid && !apart) continue;
        const std::uint64_t at = list.link(1 + i + (part == invalid ? count : 0));
        if (at == 0) continue;
        const MdfBlock block = file_.block(at, "");
        visit(block);
        add_block(block, part == invalid ? "DI" : kind, part);
      }
    }
    if (list.link(0) == 0) return;
    list = file_.block(list.link(0), first.id);
    visit(list);
  }
}

void MdfData::add_block(const MdfBlock& block, std::string_view kind, Part* part) {
  if (block.id == "DZ") {
    part->add(unpacked(block, kind));
  } else if (block.id == kind) {
    part->add(block.data);
  } else {
    file_.fail(block, fmt::format("expected data of the kind ##{}; the file is damaged", kind));
  }
}

std::string MdfData::unpacked(const MdfBlock& block, std::string_view kind) {
  const std::uint64_t method = file_.number(block, 2, 1), columns = file_.number(block, 4, 4);
  const std::uint64_t size = file_.number(block, 8, 8), packed = file_.number(block, 16, 8);
  if (block.data.substr(0, 2) != kind) {
    file_.fail(block, fmt::format("its content is ##{}, expected ##{}; the file is damaged",
                                  block.data.substr(0, 2) == "SD" ? "SD" : "another", kind));
  }
  if (method > 1) {
    file_.fail(block, fmt::format("compression {}, expected 0 (deflate) or 1 (transposed, "
                                  "deflate); save the file as version 4.20",
                                  method));
  }
  if (packed > block.data.size() - kZippedAt) {
    file_.fail(block, fmt::format("{} compressed bytes in a block with {}; was the file copied "
                                  "completely?",
                                  packed, block.data.size() - kZippedAt));
  }
  if (size > kDensest * (packed + kZlibHeader)) {
    file_.fail(block, fmt::format("{} compressed bytes cannot hold {}; the file is damaged", packed,
                                  size));
  }
  if (size > static_cast<std::uint64_t>(file_.limits().log_bytes) - unpacked_) {
    file_.fail(block, fmt::format("the file unpacks to more than {:g} MB, the limit of a log "
                                  "(docs/limits.md)",
                                  static_cast<double>(file_.limits().log_bytes) / 1e6));
  }
  unpacked_ += size;
  std::string out(size, '\0');
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  struct End {
    z_stream* stream;
    ~End() { inflateEnd(stream); }
  } const end{&stream};
  // zlib counts in 32 bits: both sides are given in pieces.
  const char* in = block.data.data() + kZippedAt;
  std::uint64_t left = packed, done = 0;
  int state = Z_OK;
  while (state == Z_OK) {
    constexpr std::uint64_t kPiece = 1U << 30U;  // no threshold: below the counter's end
    const auto give = static_cast<uInt>(std::min(left, kPiece));
    const auto room = static_cast<uInt>(std::min(size - done, kPiece));
    // zlib does not write to its input
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in));
    stream.avail_in = give;
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    stream.avail_out = room;
    state = inflate(&stream, Z_NO_FLUSH);
    in += give - stream.avail_in;
    left -= give - stream.avail_in;
    done += room - stream.avail_out;
    if (give == stream.avail_in && room == stream.avail_out) break;  // nothing moves any more
  }
  if (state == Z_MEM_ERROR) throw std::bad_alloc();
  if (state != Z_STREAM_END || done != size) {
    file_.fail(block, fmt::format("its compressed data gives {} bytes of {}; the file is damaged",
                                  done, size));
  }
  return method == 1 && columns > 1 ? rows_of_columns(out, columns) : out;
}

}  // namespace sparflow
