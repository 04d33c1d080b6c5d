#pragma once
/// Reads DBC files: which signal stands where in which CAN message. Read are BO_, SG_, SG_MUL_VAL_, SIG_VALTYPE_ and the
/// comments of signals (CM_ SG_); all other statements are skipped.
/// Source: Vector Informatik, "DBC File Format Documentation", version 1.0/5 (2007), and its extended multiplexing.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sparflow {

struct DbcSignal {
  enum class Kind { kUnsigned, kSigned, kFloat, kDouble };
  std::string name, unit, comment;
  int line = 0;  ///< 1-based, in the file
  std::uint32_t start =
      0;  ///< bit 8 * byte + bit of the byte: the lowest bit of an Intel signal, the highest of a Motorola one
  std::uint32_t length = 0;  ///< [bit] 1 to 64
  bool big_endian = false;  ///< Motorola: from the highest bit down, then to bit 7 of the next byte
  Kind kind = Kind::kUnsigned;
  double factor = 1.0, offset = 0.0;  ///< value = factor * number + offset
  bool multiplexor = false;
  int parent =
      -1;  ///< the multiplexor that switches it, as index in the message; -1 = always there
  std::vector<std::pair<std::uint64_t, std::uint64_t>> switches;  ///< values of it, ends included
  std::uint32_t bytes() const;                                    ///< that a frame must have
};

struct DbcMessage {
  std::uint32_t id = 0;  ///< without the bit that marks it as extended
  bool extended = false;
  std::string name;
  int line = 0;
  std::vector<DbcSignal> signals;
};

struct Dbc {
  std::string file;
  std::vector<DbcMessage> messages;
  std::vector<std::string> warnings;  ///< whole sentences
};

struct DbcOptions {
  /// Deepest chain of multiplexors that switch each other.
  /// @threshold [1] 2..50; chosen: extended multiplexing in use nests two or three deep
  int deepest = 8;
};

/// @param text UTF-8  @throws InputError with the line of what is wrong
Dbc parse_dbc(const std::string& file, std::string_view text, const DbcOptions& options = {});

/// The bits of a signal as they stand in a frame. @param data at least `signal.bytes()` long
std::uint64_t dbc_bits(const DbcSignal& signal, std::span<const std::uint8_t> data);
/// The physical value of these bits.
double dbc_value(const DbcSignal& signal, std::uint64_t bits);

}  // namespace sparflow
