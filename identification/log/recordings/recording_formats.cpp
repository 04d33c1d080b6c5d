#include "identification/log/recordings/recording_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "identification/log/recordings/can/can_asc.h"
#include "identification/log/recordings/can/can_text.h"
#include "identification/log/recordings/mcap/mcap.h"
#include "identification/log/recordings/mcap/mcap_record.h"
#include "identification/log/recordings/mdf/mdf.h"
#include "identification/log/recordings/mdf/mdf_block.h"
#include "models/math/error.h"

namespace sparflow {
namespace {

const RecordingFormat* format_of(std::string_view bytes) {
  const auto& formats = recording_formats();
  const auto found = std::find_if(formats.begin(), formats.end(),
                                  [&](const RecordingFormat& f) { return f.recognises(bytes); });
  return found == formats.end() ? nullptr : &*found;
}

void make_names_unique(Recording* recording) {
  std::map<std::string, int> count;
  for (const RecordedChannel& channel : recording->channels) ++count[channel.name];
  std::set<std::string> taken;
  std::map<std::string, int> next;
  for (RecordedChannel& channel : recording->channels) {
    if (count[channel.name] > 1 && !channel.group.empty()) {
      channel.name = channel.group + "." + channel.name;
    }
    if (!taken.insert(channel.name).second) {
      const std::string name = channel.name;
      int& number = next.try_emplace(name, 1).first->second;
      do {
        channel.name = fmt::format("{}_{}", name, ++number);
      } while (!taken.insert(channel.name).second);
    }
  }
}

}  // namespace

const std::vector<RecordingFormat>& recording_formats() {
  static const std::vector<RecordingFormat> formats = {
      {"MDF 4", is_mdf, read_mdf},
      {"MCAP", is_mcap, read_mcap},
      {"candump", is_candump, read_candump},
      {"ASC", is_asc, read_asc},
  };
  return formats;
}

bool is_recording(std::string_view bytes) { return format_of(bytes) != nullptr; }

Recording read_recording(std::string_view bytes, const std::string& file,
                         const RecordingOptions& options) {
  const RecordingFormat* format = format_of(bytes);
  if (format == nullptr) {
    std::string names;
    for (const RecordingFormat& known : recording_formats()) {
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    }
    throw InputError(
        {file, 0, 0}, "",
        fmt::format("its first bytes are those of no known format; expected {}", names));
  }
  Recording recording = format->read(bytes, file, options);
  recording.file = file;
  make_names_unique(&recording);
  return recording;
}

}  // namespace sparflow
