#include "diagnosis/residual/isolated_event.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "identification/comparison/report_numbers.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

struct Window {
  std::size_t block;
  Index first, last;
  double gain;  // decrease of the sum of squares
};

std::vector<Window> windows_of(const Evidence& evidence, const EvidenceChannel& channel,
                               const VectorXd& before, const VectorXd& after,
                               const IsolatedEventOptions& options) {
  const auto length = std::max<Index>(
      2, static_cast<Index>(
             std::lround(options.window / (evidence.stride * evidence.series[0].step))));
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

IsolatedEvent in_channel(const Evidence& evidence, std::size_t index, const VectorXd& before,
                         const VectorXd& after, const IsolatedEventOptions& options,
                         double& inside) {
  const EvidenceChannel& channel = evidence.channels[index];
  const std::vector<Window> windows = windows_of(evidence, channel, before, after, options);
  inside = 0.0;
  if (windows.empty()) return {};
  double all = 0.0;  // decreases only: a wrong effect may increase the error elsewhere
  for (const Window& w : windows) all += std::max(0.0, w.gain);
  auto from = std::max_element(windows.begin(), windows.end(),
                               [](const Window& a, const Window& b) { return a.gain < b.gain; });
  const double least = options.beside * from->gain;
  auto to = from;
  while (from != windows.begin() && (from - 1)->block == from->block && (from - 1)->gain > least)
    --from;
  while (to + 1 != windows.end() && (to + 1)->block == to->block && (to + 1)->gain > least) ++to;
  for (auto w = from; w <= to; ++w) inside += w->gain;
  const Index n = to->last - from->first;
  IsolatedEvent isolated_event;
  isolated_event.channel = index;
  isolated_event.log = static_cast<std::size_t>(channel.log[from->block]);
  const VectorXd& time = evidence.series[isolated_event.log].time;
  isolated_event.from = time[channel.sample[static_cast<std::size_t>(from->first)]];
  isolated_event.to = time[channel.sample[static_cast<std::size_t>(to->last - 1)]];
  isolated_event.before = before.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
  isolated_event.after = after.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
  isolated_event.share = all > 0.0 ? inside / all : 0.0;
  return isolated_event;
}

}  // namespace

IsolatedEvent locate_isolated_event(const Evidence& evidence, const EffectFit& null,
                                    const EffectFit& with, const IsolatedEventOptions& options) {
  IsolatedEvent best;
  double most = 0.0;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    double inside = 0.0;
    const IsolatedEvent here =
        in_channel(evidence, c, null.residual[c], with.residual[c], options, inside);
    const double floor = evidence.channels[c].noise_floor;
    const double noises = inside / (floor > 0.0 ? floor * floor : 1.0);
    if (!(noises > most)) continue;
    most = noises;
    best = here;
  }
  return best;
}

std::string isolated_event_sentence(const Evidence& evidence, const IsolatedEvent& isolated_event,
                                    const std::string& key) {
  const EvidenceChannel& c = evidence.channels[isolated_event.channel];
  return fmt::format(
      "{}: residual of {} {} (RMS) from {:.1f} to {:.1f} s{}, where {:.0f} % of what {} would "
      "explain lies; it would leave {} {} there. Repeat that motion",
      c.text, plain_number(isolated_event.before / c.unit.si, 2), c.unit.name, isolated_event.from,
      isolated_event.to,
      evidence.suspects > 1 ? fmt::format(" of log {}", isolated_event.log + 1) : "",
      100.0 * isolated_event.share, key, plain_number(isolated_event.after / c.unit.si, 2),
      c.unit.name);
}

}  // namespace sparflow
