#include "identification/data_checks/set_aside.h"

#include <algorithm>

#include "identification/log/log_time.h"
#include "models/math/nan.h"

namespace sparflow {

Log without_bad_data(Log log, const std::vector<BadChannel>& bad) {
  for (const BadChannel& b : bad) {
    const auto channel = std::find_if(log.channels.begin(), log.channels.end(),
                                      [&](const Channel& c) { return c.signal == b.channel; });
    if (channel == log.channels.end()) continue;
    std::vector<std::pair<double, double>> stretches = b.stretches;
    if (stretches.empty()) stretches.emplace_back(b.from_s, b.to_s);
    for (Eigen::Index i = 0; i < log.samples(); ++i) {
      const double t = log.time[i];
      const bool faulty = std::any_of(stretches.begin(), stretches.end(),
                                      [t](const auto& s) { return t >= s.first && t <= s.second; });
      if (!faulty) continue;
      channel->values[i] = kNaN;
      channel->valid[i] = false;
    }
    // The reader would hold a payload or a temperature over any hole; what a check refuses is not held.
    if (channel->role != Role::kPayload && channel->role != Role::kOilTemperature)
      fill_holes(log.time, log.runs, {}, &*channel);
  }
  return log;
}

bool stays(const BadChannel& bad, Staying staying) {
  return staying == Staying::kAll ||
         (bad.kind == BadDataKind::kJumping && staying != Staying::kNothing) ||
         (bad.kind == BadDataKind::kRippling && staying == Staying::kJumpsAndRipples);
}

CheckedSignals checked_signals(const Machine& machine, const Log& log, const SignalOptions& signals,
                               const BadDataOptions& bad_data, Staying staying) {
  CheckedSignals out;
  out.signals = make_signals(machine, log, signals);
  if (staying == Staying::kAll) return out;
  out.bad = find_bad_channels(machine, log, out.signals, bad_data);
  std::vector<BadChannel> aside = out.bad;
  std::erase_if(aside, [&](const BadChannel& b) { return stays(b, staying); });
  if (!aside.empty()) out.signals = make_signals(machine, without_bad_data(log, aside), signals);
  return out;
}

}  // namespace sparflow
