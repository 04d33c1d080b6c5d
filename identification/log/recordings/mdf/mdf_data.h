#pragma once
/// Joins the data of a channel group or channel: one block, or lists of blocks, compressed or not.
/// Source: ASAM MDF 4.2.0, sections on DT, SD, DV, DI, DZ, DL, LD and HL blocks.
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "identification/log/recordings/mdf/mdf_block.h"

namespace sparflow {

/// Bytes in one piece.
struct MdfBytes {
  std::string_view data;
  std::string_view invalid;  ///< invalidation bytes that are stored apart from the data (LD lists)
  bool apart = false;        ///< whether they are
};

/// It owns what it unpacks or joins; a single block without compression stays in the file.
class MdfData {
 public:
  explicit MdfData(const MdfFile& file) : file_(file) {}
  MdfData(const MdfData&) = delete;
  MdfData& operator=(const MdfData&) = delete;

  /// @param at a block of `kind` (DT, SD or DV), DZ, HL, DL or LD; 0 is no data  @return valid until `forget()`
  /// @throws InputError for another block, a list that contains itself or a block twice, data that cannot be unpacked, and
  ///   where all together is larger than a log may be
  MdfBytes joined(std::uint64_t at, std::string_view kind);
  void forget() { kept_.clear(); }

 private:
  struct Part {
    std::string_view piece;  ///< the only block
    std::string all;         ///< more than one, or unpacked
    bool several = false;
    void add(std::string_view bytes);
    void add(std::string&& bytes);
    std::string_view take(std::deque<std::string>* kept);
  };
  void add_block(const MdfBlock& block, std::string_view kind, Part* part);
  void add_list(const MdfBlock& first, std::string_view kind, Part* data, Part* invalid);
  std::string unpacked(const MdfBlock& block, std::string_view kind);
  void visit(const MdfBlock& block);

  const MdfFile& file_;
  std::set<std::uint64_t> seen_;
  std::deque<std::string> kept_;
  std::uint64_t unpacked_ = 0;
};

}  // namespace sparflow
