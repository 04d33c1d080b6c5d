#include "diagnosis/residual/incident.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kWindow_s = 0.5;
constexpr double kBeside = 0.1;  // of the largest window's: neighbours that belong to it

struct Window {
  std::size_t block;
  Index first, last;
  double gain;  // squares less
};

std::vector<Window> windows_of(const Evidence& evidence, const EvidenceChannel& channel,
                               const VectorXd& before, const VectorXd& after) {
  const auto length = std::max<Index>(
      2, static_cast<Index>(std::lround(kWindow_s / (evidence.stride * evidence.series[0].step))));
  std::vector<Window> windows;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (static_cast<std::size_t>(channel.log[b]) >= evidence.suspects) continue;
    const NoiseBlock& block = channel.blocks[b];
    for (Index i = block.first; i < block.last; i += length) {
      const Index n = std::min(length, block.last - i);
      windows.push_back(
          {b, i, i + n, before.segment(i, n).squaredNorm() - after.segment(i, n).squaredNorm()});
    }
  }
  return windows;
}

Incident in_channel(const Evidence& evidence, std::size_t index, const VectorXd& before,
                    const VectorXd& after, double& inside) {
  const EvidenceChannel& channel = evidence.channels[index];
  const std::vector<Window> windows = windows_of(evidence, channel, before, after);
  inside = 0.0;
  if (windows.empty()) return {};
  double all = 0.0;  // that fell; what a wrong effect adds elsewhere is no reason to look elsewhere
  for (const Window& w : windows) all += std::max(0.0, w.gain);
  auto from = std::max_element(windows.begin(), windows.end(),
                               [](const Window& a, const Window& b) { return a.gain < b.gain; });
  const double least = kBeside * from->gain;
  auto to = from;
  while (from != windows.begin() && (from - 1)->block == from->block && (from - 1)->gain > least)
    --from;
  while (to + 1 != windows.end() && (to + 1)->block == to->block && (to + 1)->gain > least) ++to;
  for (auto w = from; w <= to; ++w) inside += w->gain;
  const Index n = to->last - from->first;
  Incident incident;
  incident.channel = index;
  incident.log = static_cast<std::size_t>(channel.log[from->block]);
  const VectorXd& time = evidence.series[incident.log].time;
  incident.from = time[channel.sample[static_cast<std::size_t>(from->first)]];
  incident.to = time[channel.sample[static_cast<std::size_t>(to->last - 1)]];
  incident.before = before.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
  incident.after = after.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
  incident.share = all > 0.0 ? inside / all : 0.0;
  return incident;
}

}  // namespace

Incident where_it_shows(const Evidence& evidence, const EffectFit& null, const EffectFit& with) {
  Incident best;
  double most = 0.0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    double inside = 0.0;
    const Incident here = in_channel(evidence, c, null.residual[c], with.residual[c], inside);
    const double floor = evidence.channels[c].noise_floor;
    const double noises = inside / (floor > 0.0 ? floor * floor : 1.0);
    if (!(noises > most)) continue;
    most = noises;
    best = here;
  }
  return best;
}

std::string incident_sentence(const Evidence& evidence, const Incident& incident,
                              const std::string& key) {
  const EvidenceChannel& c = evidence.channels[incident.channel];
  return fmt::format(
      "{}: {} {} (RMS) from {:.1f} to {:.1f} s{}, where {:.0f} % of it is; {} would leave {} {}. "
      "Drive that motion again",
      c.text, plain_number(incident.before / c.unit.si, 2), c.unit.name, incident.from, incident.to,
      evidence.suspects > 1 ? fmt::format(" of log {}", incident.log + 1) : "",
      100.0 * incident.share, key, plain_number(incident.after / c.unit.si, 2), c.unit.name);
}

}  // namespace sparflow
