#include "diagnosis/residual/residual_oscillation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/math/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
/// Ratio of the standard deviation to the median absolute value of a normal distribution.
constexpr double kNormalDeviation = 1.4826;

/// Power of a series at the frequencies k f for k below `count`, by the sums of its products with sine and cosine.
/// The phases of one sample at successive frequencies follow from each other by one rotation, so that sine and cosine are
/// computed once a sample and not once a sample and frequency; thousands of rotations lose less than 1e-8
/// of the phase in a log of a day.
/// @param time [samples] [s]  @param value [samples]  @param frequency f [Hz]
/// @return [count], the first of them zero
VectorXd power_at_multiples(const VectorXd& time, const VectorXd& value, double frequency,
                            int count) {
  VectorXd c = VectorXd::Zero(count), d = VectorXd::Zero(count);
  /// Samples that are rotated together.
  /// @threshold [1] 8..4096; numerical: their phases stay in the processor's first cache
  constexpr Index kTogether = 256;
  for (Index first = 0; first < time.size(); first += kTogether) {
    const Index n = std::min(kTogether, time.size() - first);
    const Eigen::ArrayXd step = 2.0 * std::numbers::pi * frequency * time.segment(first, n).array();
    const Eigen::ArrayXd turn_cos = step.cos(), turn_sin = step.sin();
    Eigen::ArrayXd along = value.segment(first, n).array(), across = Eigen::ArrayXd::Zero(n),
                   next(n);
    for (int k = 1; k < count; ++k) {
      next = along * turn_cos - across * turn_sin;
      across = along * turn_sin + across * turn_cos;
      along.swap(next);
      c[k] += along.sum();
      d[k] += across.sum();
    }
  }
  return 2.0 * (c.cwiseAbs2() + d.cwiseAbs2()) / static_cast<double>(time.size());
}

}  // namespace

Oscillation strongest_oscillation(const Evidence& evidence, const EvidenceChannel& channel,
                                  const ResidualModelOptions& options) {
  Oscillation best;
  for (std::size_t log = 0; log < std::min(evidence.suspects, channel.raw.size()); ++log) {
    if (channel.raw[log].size() == 0) continue;  // not measured there
    const MachineSeries& s = evidence.series[log];
    const auto half = static_cast<Index>(std::lround(options.oscillation_half_width / s.step));
    const auto longest = static_cast<Index>(std::lround(options.longest_lag / s.step)),
               shortest = std::max<Index>(
                   2, static_cast<Index>(std::lround(options.shortest_lag / s.step)));
    VectorXd c = VectorXd::Zero(longest + 1);
    double n = 0.0, white = 0.0, differences = 0.0;
    for (const auto& [first, last] : s.runs) {
      const Index length = last - first;
      if (length < options.shortest_run * half) continue;
      const VectorXd x = channel.raw[log].segment(first, length);
      VectorXd h = VectorXd::Constant(length, std::numeric_limits<double>::quiet_NaN());
      for (Index i = half; i + half < length; ++i)
        h[i] = x[i] - x.segment(i - half, 2 * half + 1).mean();
      // starts and stops of motions are steps, not oscillations: large values are left out
      std::vector<double> sizes;
      for (const double v : h) {
        if (std::isfinite(v)) sizes.push_back(std::abs(v));
      }
      if (std::ssize(sizes) < options.fewest_samples) continue;
      const double usual = kNormalDeviation * median(Eigen::Map<VectorXd>(
                                                  sizes.data(), static_cast<Index>(sizes.size())));
      const double largest = options.outlier * usual;
      for (Index i = 0; i + longest < length; ++i) {
        if (!(std::abs(h[i]) < largest)) continue;
        bool whole = true;
        for (Index l = 0; l <= longest && whole; ++l) whole = std::abs(h[i + l]) < largest;
        if (!whole) continue;
        for (Index l = 0; l <= longest; ++l) c[l] += h[i] * h[i + l];
        n += 1.0;
      }
      for (const double d : third_differences(x, 0, length)) {
        const double noise = d / kThirdDifferenceNoise;
        white += std::min(noise * noise, options.outlier * options.outlier * usual * usual);
        differences += 1.0;
      }
    }
    if (n < options.fewest_samples) continue;
    c /= n;
    white /= differences;
    const double coloured = c[0] - white;
    if (coloured < options.least_oscillation * white) continue;  // no larger than the noise
    for (Index l = shortest; l < longest; ++l) {
      if (c[l] / coloured < best.dip && c[l] <= c[l - 1] && c[l] <= c[l + 1]) {
        best = {c[l] / coloured, 0.5 / (static_cast<double>(l) * s.step), std::sqrt(coloured),
                std::sqrt(white)};
      }
    }
  }
  return best;
}

std::vector<Index> suspect_rows(const Evidence& evidence, const EvidenceChannel& channel) {
  std::vector<Index> rows;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (static_cast<std::size_t>(channel.log[b]) >= evidence.suspects) continue;
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) rows.push_back(i);
  }
  return rows;
}

Line strongest_line(const Evidence& evidence, const EvidenceChannel& channel,
                    const VectorXd& residual, const ResidualModelOptions& options) {
  const std::vector<Index> rows = suspect_rows(evidence, channel);
  const auto n = static_cast<double>(rows.size());
  if (n < options.fewest_rows_line) return {};
  // phases differ between logs, so power is summed over logs
  const double step = evidence.stride * evidence.series[0].step;
  const double span = n * step;
  const double highest = options.highest_frequency / step;
  const auto count =
      static_cast<int>(std::min(options.most_frequencies, options.oversampling * highest * span));
  VectorXd power = VectorXd::Zero(std::max(count, 0));
  std::vector<std::vector<Index>> by_log(evidence.suspects);
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (static_cast<std::size_t>(channel.log[b]) >= evidence.suspects) continue;
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      by_log[static_cast<std::size_t>(channel.log[b])].push_back(i);
    }
  }
  const double mean = residual(rows).mean();
  const double total = (residual(rows).array() - mean).square().sum();
  if (total <= 0.0) return {};
  for (std::size_t log = 0; log < by_log.size(); ++log) {
    if (by_log[log].size() < options.fewest_rows_of_log) continue;
    const auto m = static_cast<Index>(by_log[log].size());
    VectorXd time(m), value(m);
    for (Index r = 0; r < m; ++r) {
      const Index i = by_log[log][static_cast<std::size_t>(r)];
      time[r] = evidence.series[log].time[channel.sample[static_cast<std::size_t>(i)]];
      value[r] = residual[i] - mean;
    }
    power += power_at_multiples(time, value, highest / count, count);
  }
  Line best;
  for (int k = 1; k < count; ++k) {
    const int half = std::max(options.fewest_around, count / options.surroundings);
    const int lo = std::max(1, k - half), hi = std::min(count, k + half);
    std::vector<double> around(power.data() + lo, power.data() + hi);
    std::nth_element(around.begin(),
                     around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2), around.end());
    const double median = around[around.size() / 2];
    const double share = power[k] / total;
    // lines with few periods in the log are slow drifts, which are left to the flexible model
    if (highest * k / count * span > options.fewest_periods &&
        power[k] > options.line_ratio * median && share > best.share) {
      best = {highest * k / count, share};
    }
  }
  return best;
}

Event strongest_event(const Evidence& evidence, const EvidenceChannel& channel,
                      const VectorXd& residual, const ResidualModelOptions& options) {
  struct Second {
    std::size_t block;
    Index first, last;
    double power;
  };
  const auto length = std::max<Index>(
      2, static_cast<Index>(
             std::lround(options.event_length / (evidence.stride * evidence.series[0].step))));
  std::vector<Second> seconds;
  double total = 0.0, rows = 0.0;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (static_cast<std::size_t>(channel.log[b]) >= evidence.suspects) continue;
    const NoiseBlock& block = channel.blocks[b];
    total += residual.segment(block.first, block.last - block.first).squaredNorm();
    rows += static_cast<double>(block.last - block.first);
    for (Index i = block.first; i + length <= block.last; i += length) {
      const double power = residual.segment(i, length).squaredNorm() / static_cast<double>(length);
      seconds.push_back({b, i, i + length, power});
    }
  }
  if (seconds.size() < options.fewest_seconds) return {};
  std::vector<double> powers;
  powers.reserve(seconds.size());
  for (const Second& s : seconds) powers.push_back(s.power);
  const double noise = std::isfinite(channel.noise_floor) ? channel.noise_floor : 0.0;
  const double usual = std::max(
      {std::sqrt(median(Eigen::Map<VectorXd>(powers.data(), static_cast<Index>(powers.size())))),
       noise, 1e-300});
  auto from = std::max_element(seconds.begin(), seconds.end(),
                               [](const Second& a, const Second& b) { return a.power < b.power; });
  Event event;
  event.times = std::sqrt(from->power) / usual;
  // neighbouring seconds of large RMS belong to the event
  const double beside = options.event_beside * options.event_beside * usual * usual;
  const auto out = [&](const Second& s) { return s.power > beside; };
  auto to = from;
  while (from != seconds.begin() && (from - 1)->block == from->block && out(*(from - 1))) --from;
  while (to + 1 != seconds.end() && (to + 1)->block == to->block && out(*(to + 1))) ++to;
  if (from == to) return {};  // a short impact: an end stop, a sudden command
  const double inside = residual.segment(from->first, to->last - from->first).squaredNorm();
  event.rms = std::sqrt(inside / rows);
  event.rest = std::sqrt(std::max(0.0, total - inside) / rows);
  event.log = static_cast<std::size_t>(channel.log[from->block]);
  const VectorXd& time = evidence.series[event.log].time;
  event.from = time[channel.sample[static_cast<std::size_t>(from->first)]];
  event.to = time[channel.sample[static_cast<std::size_t>(to->last - 1)]];
  return event;
}

}  // namespace sparflow
