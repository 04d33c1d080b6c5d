#include "identification/log/recordings/mcap/mcap_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

// no threshold: layout and numbers of the specification
constexpr std::string_view kMcap = "\x89MCAP", kMagic = "\x89MCAP0\r\n";
constexpr std::size_t kRecordHead = 9, kFooterBytes = 20;
enum class Opcode : std::uint8_t {
  kNone,
  kHeader,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kDataEnd = 0x0F
};

const char* name_of(Opcode opcode) {
  // no threshold: the records in the order of their numbers
  constexpr const char* kNames[] = {
      "no record",   "Header",         "Footer",          "Schema",
      "Channel",     "Message",        "Chunk",           "Index",
      "Chunk Index", "Attachment",     "AttachmentIndex", "Statistics",
      "Metadata",    "Metadata Index", "Summary Offset",  "Data End"};
  return opcode <= Opcode::kDataEnd ? kNames[static_cast<std::size_t>(opcode)] : "private record";
}

std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;)
    value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

struct McapRecord {
  Opcode opcode = Opcode::kNone;
  std::uint64_t at = 0;  ///< [byte] of its first byte in the file or in its chunk
  std::string_view content;
};

class McapWalk {
 public:
  McapWalk(std::string_view bytes, const std::string& file, const DoorLimits& limits,
           McapVisitor* visitor)
      : bytes_(bytes), file_(file), limits_(limits), visitor_(visitor) {}

  McapSummary read() {
    if (!bytes_.starts_with(kMagic)) {
      fail("the file begins with another version of MCAP than 0, or is damaged; convert it");
    }
    summary_.finished = has_end();
    std::uint64_t at = kMagic.size();
    while (const auto record = record_at(bytes_, at)) {
      at += kRecordHead + record->content.size();
      summary_.read_to = at;
      if (record->opcode == Opcode::kFooter || record->opcode == Opcode::kDataEnd) {
        summary_.finished = true;  // all messages are read, whatever is missing behind them
        break;
      }
      visit(*record);
    }
    return summary_;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    std::string place = fmt::format("byte {}, {}", at_, name_of(opcode_));
    if (chunk_at_) place += fmt::format(" of the chunk at byte {}", *chunk_at_);
    throw InputError({file_, 0, 0}, place, message);
  }

  /// Whether a footer and the magic bytes are the last ones.
  bool has_end() const {
    constexpr std::size_t kEnd = kRecordHead + kFooterBytes + kMagic.size();
    return bytes_.size() >= kMagic.size() + kEnd && bytes_.ends_with(kMagic) &&
           bytes_[bytes_.size() - kEnd] == static_cast<char>(Opcode::kFooter) &&
           little_endian(bytes_.substr(bytes_.size() - kEnd + 1, 8)) == kFooterBytes;
  }

  /// @return nothing at the end, and where a file that was not finished has no whole record any more
  std::optional<McapRecord> record_at(std::string_view all, std::uint64_t at) {
    at_ = at;
    opcode_ = Opcode::kNone;
    const std::string_view rest = all.substr(std::min<std::uint64_t>(at, all.size()));
    // A chunk ends behind its last record; a file without an end may end anywhere, also in zeros that were never written.
    if (rest.empty() && (chunk_at_ || !summary_.finished)) return std::nullopt;
    const bool open = !chunk_at_ && !summary_.finished;
    if (rest.size() >= kRecordHead) {
      opcode_ = static_cast<Opcode>(static_cast<std::uint8_t>(rest[0]));
      const std::uint64_t length = little_endian(rest.substr(1, 8));
      if (opcode_ != Opcode::kNone && length <= rest.size() - kRecordHead)
        return McapRecord{opcode_, at, rest.substr(kRecordHead, length)};
      if (!open && opcode_ != Opcode::kNone) {
        fail(fmt::format("a record of {} bytes begins where {} are left; the file is damaged",
                         length, rest.size() - kRecordHead));
      }
    }
    if (open) return std::nullopt;
    fail("expected a record; the file is damaged");
  }

  /// Takes `size` bytes from the front of a record's content.
  std::string_view take(std::string_view* content, std::uint64_t size) const {
    if (size > content->size()) {
      fail(fmt::format("a field of {} bytes where {} are left of the record; the file is damaged",
                       size, content->size()));
    }
    const std::string_view field = content->substr(0, size);
    content->remove_prefix(size);
    return field;
  }
  template <typename Number>
  Number number(std::string_view* content) const {
    return static_cast<Number>(little_endian(take(content, sizeof(Number))));
  }
  std::string_view text(std::string_view* content) const {
    return take(content, number<std::uint32_t>(content));
  }

  void visit(const McapRecord& record) {
    std::string_view content = record.content;
    switch (record.opcode) {
      case Opcode::kHeader:
        summary_.profile = printable(text(&content));
        break;
      case Opcode::kSchema:
        read_schema(content);
        break;
      case Opcode::kChannel:
        read_channel(content);
        break;
      case Opcode::kMessage:
        read_message(content);
        break;
      case Opcode::kChunk:
        read_chunk(record);
        break;
      default:  // indices, attachments, metadata, and what later versions and private writers add
        break;
    }
  }

  void read_schema(std::string_view content) const {
    McapSchema schema;
    schema.id = number<std::uint16_t>(&content);
    schema.name = printable(text(&content));
    schema.encoding = printable(text(&content));
    const std::string_view data = text(&content);
    if (schema.id == 0) return;  // by the specification readers ignore it
    schema.data = data;
    visitor_->schema(schema);
  }

  void read_channel(std::string_view content) const {
    McapChannel channel;
    channel.id = number<std::uint16_t>(&content);
    channel.schema = number<std::uint16_t>(&content);
    channel.topic = printable(text(&content));
    channel.encoding = printable(text(&content));
    visitor_->channel(channel);
  }

  void read_message(std::string_view content) const {
    McapMessage message;
    message.channel = number<std::uint16_t>(&content);
    number<std::uint32_t>(&content);  // the publisher's counter
    message.log_time = number<std::uint64_t>(&content);
    message.publish_time = number<std::uint64_t>(&content);
    message.data = content;
    if (!visitor_->message(message)) {
      fail(
          fmt::format("a message of channel {}, which no record before it describes; the file is "
                      "damaged",
                      message.channel));
    }
  }

  void read_chunk(const McapRecord& record) {
    if (chunk_at_) fail("a chunk inside a chunk; the file is damaged");
    std::string_view content = record.content;
    take(&content, 2 * sizeof(std::uint64_t));  // times of its first and last message
    McapChunk chunk;
    chunk.size = number<std::uint64_t>(&content);
    chunk.crc = number<std::uint32_t>(&content);
    chunk.compression = text(&content);
    chunk.packed = take(&content, number<std::uint64_t>(&content));
    std::string_view records;
    const auto most = static_cast<std::uint64_t>(limits_.log_bytes) - unpacked_;
    const std::string problem = unpacker_.unpack(chunk, most, &records);
    if (!problem.empty()) fail(problem);
    unpacked_ += chunk.size;
    chunk_at_ = record.at;
    std::uint64_t at = 0;
    while (const auto inner = record_at(records, at)) {
      at += kRecordHead + inner->content.size();
      visit(*inner);
    }
    chunk_at_.reset();
  }

  std::string_view bytes_;
  const std::string& file_;
  const DoorLimits& limits_;
  McapVisitor* visitor_;
  McapUnpacker unpacker_;
  McapSummary summary_;
  std::uint64_t unpacked_ = 0;
  std::uint64_t at_ = 0;  ///< of the record that is being read, for messages
  Opcode opcode_ = Opcode::kNone;
  std::optional<std::uint64_t> chunk_at_;  ///< while the records of a chunk are read
};

}  // namespace

bool is_mcap(std::string_view bytes) { return bytes.starts_with(kMcap); }

McapSummary read_mcap_records(std::string_view bytes, const std::string& file,
                              const DoorLimits& limits, McapVisitor* visitor) {
  return McapWalk(bytes, file, limits, visitor).read();
}

}  // namespace sparflow
