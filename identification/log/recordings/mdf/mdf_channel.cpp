#include "identification/log/recordings/mdf/mdf_channel.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "models/math/error.h"

namespace sparflow {
namespace {

// no threshold: layout of the standard
constexpr std::uint64_t kHeaderAt = 64, kRemoteMaster = 8;
constexpr std::size_t kMasterLink = 6;
constexpr std::uint8_t kTime = 1;

class Outline {
 public:
  Outline(const MdfFile& file, MdfConversions* conversions)
      : file_(file), conversions_(conversions) {}

  std::vector<MdfDataGroup> read() {
    const MdfBlock header = file_.block(kHeaderAt, "HD");
    std::vector<MdfDataGroup> all;
    for (std::uint64_t at = header.link(0); at != 0;) {
      const MdfBlock block = visited(at, "DG");
      MdfDataGroup data;
      data.at = at;
      data.data = block.link(2);
      data.record_id_bytes = file_.number(block, 0, 1);
      if (data.record_id_bytes > 8 || data.record_id_bytes % 2 > (data.record_id_bytes == 1)) {
        file_.fail(block, fmt::format("record numbers of {} bytes, expected 0, 1, 2, 4 or 8",
                                      data.record_id_bytes));
      }
      for (std::uint64_t next = block.link(1); next != 0;) next = read_group(next, &data);
      all.push_back(std::move(data));
      at = block.link(0);
    }
    return all;
  }

 private:
  MdfBlock visited(std::uint64_t at, std::string_view id) {
    const MdfBlock block = file_.block(at, id);
    if (!seen_.insert(at).second) {
      file_.fail(block, "links lead to this block twice; the file is damaged");
    }
    return block;
  }

  std::uint64_t read_group(std::uint64_t at, MdfDataGroup* data) {
    const MdfBlock block = visited(at, "CG");
    MdfGroup group;
    group.at = at;
    group.record_id = file_.number(block, 0, 8);
    group.cycles = file_.number(block, 8, 8);
    group.flags = file_.number(block, 16, 2);
    if (!group.signal_data()) {
      group.data_bytes = file_.number(block, 24, 4);
      group.invalid_bytes = file_.number(block, 28, 4);
    }
    if ((group.flags & kRemoteMaster) != 0) group.master_group = block.link(kMasterLink);
    group.name = file_.text(block.link(2));
    if (group.name.empty() && block.link(3) != 0) {
      group.name = file_.text(file_.block(block.link(3), "SI").link(0));
    }
    if (group.name.empty()) group.name = fmt::format("group {}", ++unnamed_);
    for (std::uint64_t next = block.link(1); next != 0;) next = read_channel(next, 0, &group);
    const std::uint64_t following = block.link(0);
    data->groups.push_back(std::move(group));
    return following;
  }

  std::uint64_t read_channel(std::uint64_t at, int depth, MdfGroup* group) {
    const MdfBlock block = visited(at, "CN");
    if (depth > file_.limits().nesting) {
      file_.fail(block, "structures contain each other too deeply; the file is damaged");
    }
    if (++channels_ > file_.limits().log_columns) {
      file_.fail(block, fmt::format("more than {} channels, the limit of a log (docs/limits.md)",
                                    file_.limits().log_columns));
    }
    MdfChannel channel;
    channel.at = at;
    channel.type = static_cast<std::uint8_t>(file_.number(block, 0, 1));
    channel.sync = static_cast<std::uint8_t>(file_.number(block, 1, 1));
    channel.data = static_cast<std::uint8_t>(file_.number(block, 2, 1));
    channel.bit_offset = static_cast<std::uint32_t>(file_.number(block, 3, 1));
    channel.byte_offset = static_cast<std::uint32_t>(file_.number(block, 4, 4));
    channel.bit_count = static_cast<std::uint32_t>(file_.number(block, 8, 4));
    channel.flags = static_cast<std::uint32_t>(file_.number(block, 12, 4));
    channel.invalid_bit = static_cast<std::uint32_t>(file_.number(block, 16, 4));
    channel.name = file_.text(block.link(2));
    channel.conversion = conversions_->read(block.link(4));
    channel.content = block.link(5);
    channel.unit = file_.text(block.link(6));
    if (channel.unit.empty()) channel.unit = channel.conversion->unit();
    channel.comment = file_.text(block.link(7));
    const std::uint64_t part = block.link(1);
    const std::string_view composition = part == 0 ? std::string_view{} : file_.block(part, "").id;
    channel.array = composition == "CA";
    channel.structure = composition == "CN";
    group->channels.push_back(std::move(channel));
    if (composition == "CN") {
      for (std::uint64_t next = part; next != 0;) next = read_channel(next, depth + 1, group);
    }
    return block.link(0);
  }

  const MdfFile& file_;
  MdfConversions* conversions_;
  std::set<std::uint64_t> seen_;
  std::int64_t channels_ = 0;
  int unnamed_ = 0;
};

}  // namespace

const MdfChannel* MdfGroup::master() const {
  const auto found = std::find_if(channels.begin(), channels.end(), [](const MdfChannel& c) {
    return (c.type == MdfChannel::kMaster || c.type == MdfChannel::kVirtualMaster) &&
           c.sync == kTime && !c.structure && !c.array && c.is_number();
  });
  return found == channels.end() ? nullptr : &*found;
}

std::vector<MdfDataGroup> mdf_outline(const MdfFile& file, MdfConversions* conversions) {
  return Outline(file, conversions).read();
}

}  // namespace sparflow
