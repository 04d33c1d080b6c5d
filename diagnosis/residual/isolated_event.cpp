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

/// Residuals of one channel without an effect and with it. [rows, SI]
struct ResidualChange {
  std::size_t channel;
  const VectorXd& before;
  const VectorXd& after;
};

std::vector<Window> windows_of(const Evidence& evidence, const ResidualChange& change,
                               const IsolatedEventOptions& options) {
  const EvidenceChannel& channel = evidence.channels[change.channel];
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
          {b, i, i + n,
           change.before.segment(i, n).squaredNorm() - change.after.segment(i, n).squaredNorm()});
    }
  }
  return windows;
}

/// @param inside gets the decrease of the sum of squares within the event [SI squared]
IsolatedEvent in_channel(const Evidence& evidence, const ResidualChange& change,
                         const IsolatedEventOptions& options, double& inside) {
  const EvidenceChannel& channel = evidence.channels[change.channel];
  const std::vector<Window> windows = windows_of(evidence, change, options);
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
  isolated_event.channel = change.channel;
  isolated_event.log = static_cast<std::size_t>(channel.log[from->block]);
  const VectorXd& time = evidence.series[isolated_event.log].time;
  isolated_event.from = time[channel.sample[static_cast<std::size_t>(from->first)]];
  isolated_event.to = time[channel.sample[static_cast<std::size_t>(to->last - 1)]];
  isolated_event.before =
      change.before.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
  isolated_event.after =
      change.after.segment(from->first, n).norm() / std::sqrt(static_cast<double>(n));
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
        in_channel(evidence, {c, null.residual[c], with.residual[c]}, options, inside);
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
