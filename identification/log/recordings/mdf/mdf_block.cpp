#include "identification/log/recordings/mdf/mdf_block.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: layout of the standard
constexpr std::size_t kIdBlock = 64, kHeader = 24, kFlagsOffset = 60;
constexpr std::uint64_t kLastLengthMissing = 4;
/// Longest name or comment that is kept.
/// @threshold [byte] 200..100000; chosen: what a person reads; links may lead to one text a million times
constexpr std::size_t kLongestText = 1000;

/// The content of the first <TX> element of an XML comment, or all text where there is none.
std::string_view text_of_xml(std::string_view xml) {
  const std::size_t open = xml.find("<TX");
  if (open == xml.npos) return {};
  const std::size_t begin = xml.find('>', open);
  if (begin == xml.npos) return {};
  const std::size_t end = xml.find("</TX>", begin);
  return end == xml.npos ? std::string_view{} : xml.substr(begin + 1, end - begin - 1);
}

}  // namespace

std::uint64_t mdf_number(const char* at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) {
    value = value << 8U | static_cast<unsigned char>(at[i]);
  }
  return value;
}

MdfFile::MdfFile(std::string_view bytes, std::string file, const DoorLimits& limits)
    : bytes_(bytes), file_(std::move(file)), limits_(limits) {
  if (bytes.size() < kIdBlock || !is_mdf(bytes)) {
    fail(0, "ID", "the file does not begin as an MDF file; was it copied completely?");
  }
  version_ = static_cast<int>(mdf_number(bytes.data() + 28, 2));
  if (version_ < 400 || version_ >= 500) {
    fail(0, "ID",
         fmt::format("version {:.2f} of MDF, expected 4.00 to 4.20; convert the file",
                     version_ / 100.0));
  }
  unfinished_ = bytes.starts_with("UnFinMF");
  last_block_open_ =
      unfinished_ && (mdf_number(bytes.data() + kFlagsOffset, 2) & kLastLengthMissing) != 0;
}

MdfBlock MdfFile::block(std::uint64_t at, std::string_view wanted) const {
  const auto said = [&] { return wanted.empty() ? std::string_view("data") : wanted; };
  if (at > bytes_.size() || bytes_.size() - at < kHeader) {
    fail(at, said(),
         fmt::format("a link leads here, beyond the end of the file ({} bytes); was it copied "
                     "completely?",
                     bytes_.size()));
  }
  MdfBlock block;
  block.at = at;
  const std::string_view here = bytes_.substr(at);
  const std::string_view found = here.substr(0, 4);
  if (!found.starts_with("##") || (!wanted.empty() && found.substr(2) != wanted)) {
    fail(at, said(),
         fmt::format("expected a block ##{}, found \"{}\"; the file is damaged",
                     wanted.empty() ? "DT, DL or the like" : wanted, printable(found)));
  }
  block.id = here.substr(2, 2);
  std::uint64_t length = mdf_number(here.data() + 8, 8);
  const std::uint64_t links = mdf_number(here.data() + 16, 8);
  if (last_block_open_ && block.id == "DT" && (length <= kHeader || length > here.size())) {
    length = here.size();
  }
  if (length > here.size()) {
    fail(block, fmt::format("its length of {} bytes leads beyond the end of the file ({} bytes); "
                            "was it copied completely?",
                            length, bytes_.size()));
  }
  if (length < kHeader || links > (length - kHeader) / 8) {
    fail(block, fmt::format("{} links do not fit its length of {} bytes; the file is damaged",
                            links, length));
  }
  block.links = here.substr(kHeader, 8 * links);
  block.data = here.substr(kHeader + 8 * links, length - kHeader - 8 * links);
  return block;
}

std::uint64_t MdfFile::number(const MdfBlock& block, std::size_t offset, std::size_t size) const {
  if (offset > block.data.size() || size > block.data.size() - offset) {
    fail(block, fmt::format("too short: {} bytes behind its links, expected at least {}",
                            block.data.size(), offset + size));
  }
  return mdf_number(block.data.data() + offset, size);
}

double MdfFile::real(const MdfBlock& block, std::size_t offset) const {
  const std::uint64_t bits = number(block, offset, 8);
  double value = 0.0;
  std::memcpy(&value, &bits, 8);
  return value;
}

std::string MdfFile::text(std::uint64_t at) const {
  if (at == 0) return "";
  const MdfBlock found = block(at, "");
  if (found.id != "TX" && found.id != "MD") {
    fail(found, "expected a text (##TX or ##MD); the file is damaged");
  }
  std::string_view text = found.data.substr(0, std::min(found.data.find('\0'), 8 * kLongestText));
  if (found.id == "MD") text = text_of_xml(text);
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == text.npos) return "";
  text = text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  return printable(text, kLongestText);
}

void MdfFile::fail(std::uint64_t at, std::string_view id, const std::string& message) const {
  throw InputError({file_, 0, 0}, fmt::format("byte {}, block {}", at, printable(id)), message);
}

bool is_mdf(std::string_view bytes) {
  return bytes.starts_with("MDF     ") || bytes.starts_with("UnFinMF ");
}

}  // namespace sparflow
