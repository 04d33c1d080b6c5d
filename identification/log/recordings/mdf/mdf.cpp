#include "identification/log/recordings/mdf/mdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "identification/log/recordings/mdf/mdf_block.h"
#include "identification/log/recordings/mdf/mdf_can.h"
#include "identification/log/recordings/mdf/mdf_channel.h"
#include "identification/log/recordings/mdf/mdf_conversion.h"
#include "identification/log/recordings/mdf/mdf_data.h"
#include "identification/log/recordings/mdf/mdf_value.h"
#include "models/math/error.h"
#include "models/math/text_encoding.h"

namespace sparflow {
namespace {

class MdfReader {
 public:
  MdfReader(std::string_view bytes, const std::string& file, const RecordingOptions& options)
      : file_(bytes, file, options.limits), options_(options), conversions_(file_) {}

  Recording read() {
    const std::vector<MdfDataGroup> outline = mdf_outline(file_, &conversions_);
    std::size_t groups = 0;
    for (const MdfDataGroup& data : outline) {
      groups += data.groups.size();
      for (const MdfGroup& group : data.groups) {
        if (group.master_group != 0) times_.try_emplace(group.master_group);
      }
    }
    // Groups that share another group's master come after it.
    for (const bool shared : {false, true}) {
      for (const MdfDataGroup& data : outline) {
        const bool any =
            std::any_of(data.groups.begin(), data.groups.end(),
                        [&](const MdfGroup& group) { return (group.master_group != 0) == shared; });
        if (any) read_data_group(data, shared);
      }
    }
    if (!frames_.empty()) {
      if (options_.dbc_files.empty() && !recording_.channels.empty()) {
        recording_.warnings.push_back(
            "CAN frames are left out; a mapping file with `dbc: FILE.dbc` decodes them");
      } else {
        frames_.decode(file_.name(), options_, &recording_);
      }
    }
    recording_.format = fmt::format("MDF {:.2f}, {} channel group{}", file_.version() / 100.0,
                                    groups, groups == 1 ? "" : "s");
    if (file_.unfinished()) {
      recording_.warnings.push_back(
          "the file was not finished by its writer; the records that it holds are read");
    }
    for (const auto& [why, names] : left_out_) {
      recording_.warnings.push_back(fmt::format("left out, {}: {}", why, names));
    }
    if (recording_.channels.empty()) {
      std::string found;
      for (const std::string& warning : recording_.warnings) found += "; " + warning;
      file_.fail(64, "HD", "no channel of numbers with time and samples" + found);
    }
    return std::move(recording_);
  }

 private:
  struct Buffers {
    std::string records;
    std::size_t count = 0;
  };

  void leave_out(const std::string& why, const std::string& name) {
    std::string& names = left_out_[why];
    if (names.size() > 300) return;
    names += (names.empty() ? "" : ", ") + printable(name);
    if (names.size() > 300) names += ", ...";
  }

  void read_data_group(const MdfDataGroup& data, bool shared) {
    if (data.record_id_bytes == 0 && data.groups.size() > 1) {
      file_.fail(data.at, "DG",
                 "several channel groups and no record numbers; the file is damaged");
    }
    MdfData blocks(file_);
    const bool columns = data.data != 0 && is_column(data.data);
    const MdfBytes bytes = blocks.joined(data.data, columns ? "DV" : "DT");
    if (data.record_id_bytes == 0) {
      if (!data.groups.empty()) read_sorted(data.groups.front(), bytes, columns);
      return;
    }
    const std::map<std::uint64_t, Buffers> sorted = sort_records(data, bytes.data);
    variable_.clear();
    for (const MdfGroup& group : data.groups)
      if (group.signal_data()) variable_[group.at] = sorted.find(group.record_id)->second.records;
    for (const MdfGroup& group : data.groups) {
      if (group.signal_data() || (group.master_group != 0) != shared) continue;
      const auto found = sorted.find(group.record_id);
      MdfRecords records = described(group, found->second.records, "", false);
      records.count = found->second.count;
      check_cycles(group, records.count);
      if (!file_.unfinished()) {
        records.count = std::min<std::size_t>(records.count, group.cycles);
      }
      read_group(records);
    }
  }

  /// Whether the data behind a link is stored channel by channel (DV blocks, LD lists).
  bool is_column(std::uint64_t at) const {
    MdfBlock block = file_.block(at, "");
    if (block.id == "HL") block = file_.block(block.link(0), "");
    return block.id == "DV" || block.id == "LD" ||
           (block.id == "DZ" && block.data.substr(0, 2) == "DV");
  }

  static MdfRecords described(const MdfGroup& group, std::string_view data,
                              std::string_view invalid, bool apart) {
    MdfRecords records;
    records.group = &group;
    records.data = data;
    records.stride = apart ? group.data_bytes : group.record_bytes();
    records.invalid =
        apart ? invalid : data.substr(std::min<std::size_t>(group.data_bytes, data.size()));
    records.invalid_stride = apart ? group.invalid_bytes : records.stride;
    return records;
  }

  void check_cycles(const MdfGroup& group, std::uint64_t found) const {
    if (file_.unfinished() || group.cycles <= found) return;
    file_.fail(group.at, "CG",
               fmt::format("{} records by its count, but the data holds {}; was the file copied "
                           "completely?",
                           group.cycles, found));
  }

  void read_sorted(const MdfGroup& group, const MdfBytes& bytes, bool columns) {
    MdfRecords records = described(group, bytes.data, bytes.invalid, columns);
    std::uint64_t found = 0;
    if (records.stride > 0) {
      found = bytes.data.size() / records.stride;
    } else if (group.invalid_bytes == 0) {
      // Virtual channels alone have no bytes; only the limit of a log bounds their number.
      found = static_cast<std::uint64_t>(file_.limits().log_values);
    }
    if (columns && group.invalid_bytes > 0) {
      found = std::min<std::uint64_t>(found, bytes.invalid.size() / group.invalid_bytes);
    }
    check_cycles(group, found);
    const bool open = file_.unfinished() && records.stride > 0;
    records.count = open ? found : std::min(found, group.cycles);
    read_group(records);
  }

  std::map<std::uint64_t, Buffers> sort_records(const MdfDataGroup& data,
                                                std::string_view bytes) const {
    std::map<std::uint64_t, const MdfGroup*> groups;
    std::map<std::uint64_t, Buffers> sorted;
    for (const MdfGroup& group : data.groups) {
      if (!groups.try_emplace(group.record_id, &group).second) {
        file_.fail(group.at, "CG",
                   fmt::format("record number {} belongs to two groups", group.record_id));
      }
      sorted[group.record_id];
    }
    const std::size_t id_bytes = data.record_id_bytes;
    for (std::size_t at = 0; at < bytes.size();) {
      const auto cut = [&](std::size_t wanted) {
        if (wanted <= bytes.size() - at) return false;
        if (file_.unfinished()) return true;
        file_.fail(
            data.at, "DG",
            fmt::format("its data ends inside a record, at byte {} of {}", at, bytes.size()));
      };
      if (cut(id_bytes)) break;
      const std::uint64_t id = mdf_number(bytes.data() + at, id_bytes);
      const auto group = groups.find(id);
      if (group == groups.end()) {
        file_.fail(data.at, "DG",
                   fmt::format("a record has number {}, which no channel group has, "
                               "at byte {} of its data",
                               id, at));
      }
      at += id_bytes;
      std::size_t size = group->second->record_bytes();
      if (group->second->signal_data()) {
        if (cut(4)) break;
        size = 4 + mdf_number(bytes.data() + at, 4);
      }
      if (cut(size)) break;
      Buffers& buffer = sorted[id];
      ++buffer.count;
      buffer.records.append(bytes.substr(at, size));
      at += size;
    }
    return sorted;
  }

  void read_group(const MdfRecords& records) {
    const MdfGroup& group = *records.group;
    if (records.count == 0) {
      leave_out("groups without records", group.name);
      return;
    }
    const std::vector<double> time = times_of(records);
    if (time.empty()) return;
    if (const auto wanted = times_.find(group.at); wanted != times_.end()) wanted->second = time;
    if (const auto frames = frame_channels(group)) {
      add_frames(records, *frames, time);
      return;
    }
    for (const MdfChannel& channel : group.channels) {
      if (!readable(channel)) continue;
      check_place(file_, records, channel);
      values_ += 2 * static_cast<std::int64_t>(records.count);
      if (values_ > file_.limits().log_values) {
        file_.fail(channel.at, "CN",
                   fmt::format("more than {:g} values and times in the file, the limit of a log "
                               "(docs/limits.md)",
                               static_cast<double>(file_.limits().log_values)));
      }
      if (channel.conversion->has_texts()) {
        leave_out("only the texts that name states", channel.name);
      }
      recording_.channels.push_back({channel.name, channel.unit, group.name, channel.comment, time,
                                     mdf_values(records, channel)});
    }
  }

  void add_frames(const MdfRecords& records, const MdfFrameChannels& channels,
                  const std::vector<double>& time) {
    if (channels.bytes->type != MdfChannel::kVariable) {
      frames_.add(file_, records, channels, time, "");
      return;
    }
    const std::uint64_t content = channels.bytes->content;
    if (const auto found = variable_.find(content); found != variable_.end()) {
      frames_.add(file_, records, channels, time, found->second);
      return;
    }
    MdfData blocks(file_);
    frames_.add(file_, records, channels, time, blocks.joined(content, "SD").data);
  }

  /// @return one time for each record; empty, with a sentence, where the group has none that can be used
  std::vector<double> times_of(const MdfRecords& records) {
    const MdfGroup& group = *records.group;
    std::vector<double> time;
    if (group.master_group != 0) {
      time = times_[group.master_group];
      if (time.size() != records.count) {
        leave_out("groups that share another's time and have another number of records",
                  group.name);
        return {};
      }
      return time;
    }
    const MdfChannel* master = group.master();
    if (master == nullptr) {
      leave_out("groups without a master channel of time", group.name);
      return {};
    }
    check_place(file_, records, *master);
    if (static_cast<std::int64_t>(records.count) > file_.limits().log_values) {
      file_.fail(group.at, "CG",
                 fmt::format("{} records, more than a log may have", records.count));
    }
    time = mdf_values(records, *master);
    const bool ordered =
        std::isfinite(time.front()) && std::is_sorted(time.begin(), time.end()) &&
        std::none_of(time.begin(), time.end(), [](double t) { return !std::isfinite(t); });
    if (!ordered) {
      leave_out("groups whose time decreases or is not a number", group.name);
      return {};
    }
    return time;
  }

  bool readable(const MdfChannel& channel) {
    if (channel.structure || channel.type == MdfChannel::kMaster ||
        channel.type == MdfChannel::kVirtualMaster) {
      return false;
    }
    std::string why;
    if (channel.array) {
      why = "arrays";
    } else if (channel.type != MdfChannel::kFixed && channel.type != MdfChannel::kVirtual) {
      why = "channels of variable length and of synchronisation";
    } else if (!channel.is_number()) {
      why = "texts, bytes, dates and complex numbers";
    } else if (!channel.conversion->refusal().empty()) {
      why = channel.conversion->refusal();
    }
    if (why.empty()) return true;
    leave_out(why, channel.name);
    return false;
  }

  MdfFile file_;
  const RecordingOptions& options_;
  MdfConversions conversions_;
  MdfFrames frames_;
  /// Records of variable length of the data group that is being read, by the place of their channel group.
  std::map<std::uint64_t, std::string_view> variable_;
  Recording recording_;
  std::map<std::uint64_t, std::vector<double>> times_;  ///< of the groups whose master others share
  std::map<std::string, std::string> left_out_;         ///< reason -> names
  std::int64_t values_ = 0;
};

}  // namespace

Recording read_mdf(std::string_view bytes, const std::string& file,
                   const RecordingOptions& options) {
  return MdfReader(bytes, file, options).read();
}

}  // namespace sparflow
