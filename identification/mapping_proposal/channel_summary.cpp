#include "identification/mapping_proposal/channel_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

void summarise_times(const std::vector<double>& time, const SummaryOptions& o, ChannelSummary* s) {
  if (time.size() < 2) return;
  s->duration = time.back() - time.front();
  std::vector<double> steps(time.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = time[i + 1] - time[i];
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double step = sorted[sorted.size() / 2];
  s->rate = step > 0.0 ? 1.0 / step : 0.0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] <= o.gap_steps * step || steps[i] <= o.gap_s) continue;
    ++s->gaps;
    if (steps[i] > s->longest_gap) s->longest_gap = steps[i], s->longest_gap_at = time[i];
  }
}

/// The step between values that were digitised, 0 where they lie on no grid.
double resolution_of(std::vector<double> values, const SummaryOptions& o) {
  if (values.size() > o.sorted_values) {
    const std::size_t keep = std::max<std::size_t>(1, values.size() / o.sorted_values);
    std::vector<double> some;
    some.reserve(o.sorted_values + 1);
    for (std::size_t i = 0; i < values.size(); i += keep) some.push_back(values[i]);
    values = std::move(some);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (values.size() < 3) return 0.0;
  const double range = values.back() - values.front();
  double least = range;
  std::vector<double> distances;
  distances.reserve(values.size());
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double d = values[i] - values[i - 1];
    if (d < 1e-9 * range) continue;  // rounding of the same number
    distances.push_back(d);
    least = std::min(least, d);
  }
  const auto fits = std::count_if(distances.begin(), distances.end(), [&](double d) {
    const double k = d / least;
    return std::abs(k - std::round(k)) < 0.02 * std::max(1.0, std::sqrt(k));
  });
  const bool grid =
      static_cast<double>(fits) >= o.on_the_grid * static_cast<double>(distances.size());
  return grid && distances.size() > 1 ? least : 0.0;
}

}  // namespace

ChannelSummary summarise(const RecordedChannel& channel, const SummaryOptions& o) {
  ChannelSummary s;
  s.name = channel.name;
  s.unit = channel.unit;
  s.group = channel.group;
  s.comment = channel.comment;
  s.samples = channel.values.size();
  summarise_times(channel.time, o, &s);
  std::vector<double> finite;
  finite.reserve(channel.values.size());
  double sum = 0.0;
  for (const double v : channel.values) {
    if (!std::isfinite(v)) continue;
    finite.push_back(v);
    sum += v;
  }
  s.missing_share = s.samples == 0
                        ? 0.0
                        : 1.0 - static_cast<double>(finite.size()) / static_cast<double>(s.samples);
  if (finite.empty()) {
    s.smallest = s.largest = s.mean = kNaN;
    return s;
  }
  const auto [least, most] = std::minmax_element(finite.begin(), finite.end());
  s.smallest = *least;
  s.largest = *most;
  s.mean = sum / static_cast<double>(finite.size());
  s.constant = s.smallest == s.largest;
  if (s.constant) return s;
  const Eigen::Map<const Eigen::VectorXd> values(channel.values.data(),
                                                 static_cast<Eigen::Index>(channel.values.size()));
  const std::vector<double> third = third_differences(values, 0, values.size());
  if (!third.empty()) {
    const Eigen::Map<const Eigen::VectorXd> d(third.data(),
                                              static_cast<Eigen::Index>(third.size()));
    s.noise = robust_std(d) / kThirdDifferenceNoise;
  }
  s.resolution = resolution_of(std::move(finite), o);
  return s;
}

std::string summary_table(const std::vector<ChannelSummary>& channels) {
  std::size_t width = 7;
  for (const ChannelSummary& c : channels)
    width = std::max(width, std::min<std::size_t>(c.name.size(), 40));
  std::string text = fmt::format(
      "  {:<{}} {:<8} {:>8} {:>11} {:>11} {:>11} {:>5} {:>8} {:>11} {:>9}\n", "channel", width,
      "unit", "rate Hz", "smallest", "largest", "mean", "gaps", "missing", "resolution", "noise");
  // A channel without any value has neither range nor noise.
  const auto value = [](double v) { return std::isfinite(v) ? fmt::format("{:.5g}", v) : "-"; };
  for (const ChannelSummary& c : channels) {
    const std::string missing =
        c.missing_share > 0.0 ? fmt::format("{:.3g} %", 100.0 * c.missing_share) : "-";
    const std::string resolution = c.resolution > 0.0 ? fmt::format("{:.3g}", c.resolution) : "-";
    const std::string noise = c.constant                  ? "constant"
                              : std::isfinite(c.smallest) ? fmt::format("{:.2g}", c.noise)
                                                          : "-";
    text += fmt::format("  {:<{}} {:<8} {:>8.4g} {:>11} {:>11} {:>11} {:>5} {:>8} {:>11} {:>9}\n",
                        c.name, width, c.unit.empty() ? "-" : c.unit, c.rate, value(c.smallest),
                        value(c.largest), value(c.mean), c.gaps, missing, resolution, noise);
  }
  return text;
}

}  // namespace sparflow
