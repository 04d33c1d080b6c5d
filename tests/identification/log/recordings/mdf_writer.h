#pragma once
/// Writes MDF 4 files for tests block by block, with the offsets of the standard (ASAM MDF 4.2.0) and without the reader's code.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace sparflow::test {

inline std::string le(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}
inline std::string real(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, 8);
  return le(bits, 8);
}

/// Appends blocks; a link is the place of a block that was appended before.
struct MdfWriter {
  std::string file;
  MdfWriter() {
    file = std::string("MDF     4.10    test    ") + le(0, 4) + le(410, 2) + std::string(34, '\0');
    file += "##HD" + le(0, 4) + le(104, 8) + le(6, 8) + std::string(80, '\0');
  }
  std::uint64_t block(const std::string& id, const std::vector<std::uint64_t>& links,
                      const std::string& data) {
    file.resize((file.size() + 7) / 8 * 8);
    const std::uint64_t at = file.size();
    file += "##" + id + le(0, 4) + le(24 + 8 * links.size() + data.size(), 8) + le(links.size(), 8);
    for (const std::uint64_t link : links) file += le(link, 8);
    file += data;
    return at;
  }
  void first(std::uint64_t data_group) { file.replace(64 + 24, 8, le(data_group, 8)); }
  std::uint64_t text(const std::string& t) { return block("TX", {}, t + '\0'); }
};

struct Field {
  std::string name;
  unsigned type, sync, data, bit, byte, bits;
  std::uint64_t conversion = 0;
  unsigned flags = 0, invalid = 0;
  std::uint64_t content = 0;
};

inline std::uint64_t channels(MdfWriter& w, const std::vector<Field>& fields,
                              std::uint64_t next = 0) {
  for (std::size_t i = fields.size(); i-- > 0;) {
    const Field& f = fields[i];
    const std::uint64_t name = w.text(f.name);
    next = w.block("CN", {next, 0, name, 0, f.conversion, f.content, 0, 0},
                   le(f.type, 1) + le(f.sync, 1) + le(f.data, 1) + le(f.bit, 1) + le(f.byte, 4) +
                       le(f.bits, 4) + le(f.flags, 4) + le(f.invalid, 4) + std::string(52, '\0'));
  }
  return next;
}

/// @param master link to the group whose master of time it shares; 0: it has its own
inline std::uint64_t group(MdfWriter& w, std::uint64_t next, std::uint64_t first_channel,
                           const std::vector<unsigned>& id_cycles_data_invalid,
                           std::uint64_t master = 0) {
  const auto& n = id_cycles_data_invalid;
  std::vector<std::uint64_t> links = {next, first_channel, w.text("g"), 0, 0, 0};
  if (master != 0) links.push_back(master);
  return w.block("CG", links,
                 le(n[0], 8) + le(n[1], 8) + le(master == 0 ? 0 : 8, 2) + le(0, 6) + le(n[2], 4) +
                     le(n[3], 4));
}

inline std::uint64_t conversion(MdfWriter& w, unsigned type, const std::vector<double>& numbers,
                                const std::vector<std::uint64_t>& references = {}) {
  std::string data =
      le(type, 1) + le(0, 3) + le(references.size(), 2) + le(numbers.size(), 2) + real(0) + real(0);
  for (const double n : numbers) data += real(n);
  std::vector<std::uint64_t> links = {0, 0, 0, 0};
  links.insert(links.end(), references.begin(), references.end());
  return w.block("CC", links, data);
}

}  // namespace sparflow::test
