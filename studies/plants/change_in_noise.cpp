#include "studies/plants/change_in_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulator/sensors/sensors.h"

namespace sparflow::bench {
namespace {

using plant::PlantParameters;
using plant::Record;

/// Time between the begins of two stretches, and length of each.
/// @threshold [s] 1..60; chosen: a stroke takes some seconds, and later the two runs are at different postures
constexpr double kEvery_s = 6.0, kStretch_s = 4.0;

PlantParameters without_noise(PlantParameters p) {
  p.sensors.position_noise = p.sensors.pressure_noise = p.sensors.force_noise = 0.0;
  return p;
}

/// One plant from rest with the commands of a stretch. Empty where the run or the payload's steadiness ends before the stretch.
std::vector<Record> replayed(const Machine& machine, const PlantParameters& p,
                             std::span<const Record> stretch, double payload_factor) {
  const double payload = stretch.front().payload;
  const bool steady = std::all_of(stretch.begin(), stretch.end(),
                                  [&](const Record& r) { return r.payload == payload; });
  if (!steady) return {};
  plant::PlantRun run(machine, p, stretch.front().q, payload_factor * payload);
  std::vector<Record> records;
  for (const Record& row : stretch) {
    records.push_back(run.record());
    if (run.advance(row.command) != plant::RunStatus::kRunning) return {};
  }
  return records;
}

/// Root mean square of what two sensors tell apart, by channel.
std::vector<double> difference(plant::Sensors one, std::span<const Record> first,
                               plant::Sensors other, std::span<const Record> second) {
  std::vector<double> sum(one.channels().size(), 0.0), count(sum.size(), 0.0);
  for (std::size_t k = 0; k < first.size(); ++k) {
    const std::vector<double> a = one.sense(first[k]), b = other.sense(second[k]);
    for (std::size_t c = 0; c < sum.size(); ++c) {
      if (!std::isfinite(a[c] - b[c])) continue;
      sum[c] += (a[c] - b[c]) * (a[c] - b[c]);
      count[c] += 1.0;
    }
  }
  for (std::size_t c = 0; c < sum.size(); ++c) sum[c] = std::sqrt(sum[c] / std::max(1.0, count[c]));
  return sum;
}

}  // namespace

ChangeInNoise change_in_noise(const Machine& machine, const PlantChange& change,
                              std::span<const Record> records, std::uint64_t seed) {
  ChangeInNoise most;
  if (records.size() < 2) return most;
  const PlantParameters quiet_built = without_noise(change.as_built),
                        quiet = without_noise(change.changed);
  const plant::Sensors noisy(machine, change.as_built, seed), exact(machine, quiet_built, seed);
  const std::vector<double> noise = difference(noisy, records, exact, records);
  const double step = records[1].t - records[0].t;
  const auto every = static_cast<std::size_t>(std::lround(kEvery_s / step));
  const auto length = static_cast<std::size_t>(std::lround(kStretch_s / step));
  for (std::size_t begin = 0; begin + length <= records.size(); begin += every) {
    const std::span<const Record> stretch = records.subspan(begin, length);
    const std::vector<Record> before = replayed(machine, quiet_built, stretch, change.told);
    const std::vector<Record> after = replayed(machine, quiet, stretch, 1.0);
    if (before.empty() || after.empty()) continue;
    const std::vector<double> apart =
        difference(exact, before, plant::Sensors(machine, quiet, seed), after);
    for (std::size_t c = 0; c < apart.size(); ++c) {
      const plant::SensedChannel& channel = exact.channels()[c];
      if (channel.kind == plant::SensedKind::kExact || !(noise[c] > 0.0)) continue;
      if (apart[c] / noise[c] > most.ratio) most = {channel.name, apart[c] / noise[c]};
    }
  }
  return most;
}

}  // namespace sparflow::bench
