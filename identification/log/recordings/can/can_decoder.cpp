#include "identification/log/recordings/can/can_decoder.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/math/error.h"

namespace sparflow {
namespace {

// no threshold: keeps standard and extended identifiers apart
constexpr std::uint64_t kExtendedKey = std::uint64_t{1} << 32U;

std::uint64_t key_of(std::uint32_t id, bool extended) { return id | (extended ? kExtendedKey : 0); }

bool is_there(const DbcMessage& message, const DbcSignal& signal,
              std::span<const std::uint8_t> data) {
  if (signal.parent < 0) return true;
  const DbcSignal& parent = message.signals[static_cast<std::size_t>(signal.parent)];
  if (!is_there(message, parent, data) || parent.bytes() > data.size()) return false;
  const std::uint64_t value = dbc_bits(parent, data);
  return std::any_of(signal.switches.begin(), signal.switches.end(), [&](const auto& range) {
    return value >= range.first && value <= range.second;
  });
}

}  // namespace

CanDecoder::CanDecoder(std::string file, const std::vector<std::string>& dbc_files,
                       const DoorLimits& limits)
    : file_(std::move(file)), limits_(limits) {
  databases_.reserve(dbc_files.size());
  for (const std::string& name : dbc_files) databases_.push_back(parse_dbc(name, read_text(name)));
  for (const Dbc& dbc : databases_) {
    for (const DbcMessage& message : dbc.messages) {
      messages_.try_emplace(key_of(message.id, message.extended),
                            Message{&message, std::vector<Samples>(message.signals.size())});
    }
  }
}

void CanDecoder::add(const CanFrame& frame) {
  const auto found = messages_.find(key_of(frame.id, frame.extended));
  if (found == messages_.end()) {
    ++unknown_[key_of(frame.id, frame.extended)];
    return;
  }
  const DbcMessage& message = *found->second.description;
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const DbcSignal& signal = message.signals[i];
    if (!is_there(message, signal, frame.data)) continue;
    if (signal.bytes() > frame.data.size()) {
      ++short_;
      continue;
    }
    if (++values_ > limits_.log_values) {
      throw InputError({file_, 0, 0}, "",
                       fmt::format("more than {:g} values, the limit of a log (docs/limits.md)",
                                   static_cast<double>(limits_.log_values)));
    }
    found->second.samples[i].time.push_back(frame.time);
    found->second.samples[i].values.push_back(dbc_value(signal, dbc_bits(signal, frame.data)));
  }
}

void CanDecoder::finish(Recording* recording) {
  std::string seen;
  for (const auto& [key, count] : unknown_) {
    if (seen.size() > 400) {
      seen += ", ...";
      break;
    }
    seen += fmt::format("{}{:X}{} ({} frames)", seen.empty() ? "" : ", ", key & 0xFFFFFFFFU,
                        key >= kExtendedKey ? "x" : "", count);
  }
  const std::size_t before = recording->channels.size();
  for (auto& [key, message] : messages_) {
    for (std::size_t i = 0; i < message.samples.size(); ++i) {
      Samples& samples = message.samples[i];
      if (samples.time.empty()) continue;
      const DbcSignal& signal = message.description->signals[i];
      recording->channels.push_back({signal.name, signal.unit, message.description->name,
                                     signal.comment, std::move(samples.time),
                                     std::move(samples.values)});
    }
  }
  if (recording->channels.size() == before) {
    throw InputError({file_, 0, 0}, "",
                     fmt::format("no CAN frame is described by a database: give one with `dbc: "
                                 "FILE.dbc` in a mapping file; identifiers seen: {}",
                                 seen.empty() ? "none" : seen));
  }
  if (!seen.empty()) {
    recording->warnings.push_back("frames without a description left out: " + seen);
  }
  if (short_ > 0) {
    recording->warnings.push_back(
        fmt::format("{} values left out: their frames are too short", short_));
  }
  for (const Dbc& dbc : databases_) {
    recording->warnings.insert(recording->warnings.end(), dbc.warnings.begin(), dbc.warnings.end());
  }
}

}  // namespace sparflow
