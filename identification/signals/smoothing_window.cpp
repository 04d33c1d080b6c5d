/// Chooses the smoothing window; declared in smoothing.h.
#include <algorithm>
#include <cmath>

#include "identification/log/log_time.h"
#include "identification/signals/smoothing.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

// The grid of windows starts at ten samples, limited to 0.1 .. 0.2 s, and ends at 0.42 s. In shorter windows real noise
// (digits, vibration) is not white as the risk assumes; longer ones smooth starts, stops and a pump's lag (0.1-0.4 s).
constexpr double kSamples = 10.0;
constexpr double kShortestLow = 0.1, kShortestHigh = 0.2;  // [s]
constexpr double kLongest = 0.42;                          // [s]
constexpr double kRatio = 1.2;             // between neighbouring windows of the grid
constexpr Eigen::Index kEnough = 40000;    // samples evaluated, in blocks spread over the log
constexpr double kLargestDilution = 1e-3;  // share of noise in the variance of an acceleration
constexpr double kWhenUnknown = 0.25;      // [s] without positions or noise

/// Standard deviation of white noise on a channel. Third differences have 20 times its variance and contain hardly any
/// motion; the median of their magnitude (0.6745 sigma) is robust to starts and stops.
double noise_of(const Eigen::VectorXd& values, const std::vector<SampleRange>& runs) {
  std::vector<double> size;
  double lo = INFINITY, hi = -INFINITY;
  for (const SampleRange& run : runs) {
    for (Eigen::Index i = run.begin; i < run.end; ++i) {
      if (!std::isfinite(values[i])) continue;
      lo = std::min(lo, values[i]);
      hi = std::max(hi, values[i]);
    }
    for (const double d : third_differences(values, run.begin, run.end)) {
      // Exact zeros occur when a sensor rests within one digit; they carry no information about its noise.
      if (d != 0.0) size.push_back(std::abs(d));
    }
  }
  if (size.empty()) return 0.0;
  const auto middle = size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2);
  std::nth_element(size.begin(), middle, size.end());
  return std::max(*middle / (0.6745 * kThirdDifferenceNoise), 1e-9 * (hi - lo));
}

/// @return evenly spread blocks of the runs with about kEnough samples in total; the runs themselves if they have fewer
std::vector<SampleRange> spread_blocks(const std::vector<SampleRange>& runs) {
  Eigen::Index total = 0;
  for (const SampleRange& run : runs) total += run.size();
  if (total <= kEnough) return runs;
  constexpr Eigen::Index kBlock = 4000;
  const Eigen::Index stride = total / (kEnough / kBlock);
  std::vector<SampleRange> blocks;
  for (const SampleRange& run : runs) {
    for (Eigen::Index at = run.begin; at < run.end; at += stride) {
      blocks.push_back({at, std::min(at + kBlock, run.end)});
    }
  }
  return blocks;
}

/// Closed form of the filter's centred first-derivative weights on even sampling, of the cubic for order 3 and above; for
/// orders 1 and 2 they are those of the linear fit.
/// @return [2 padded + 1] weights, zero beyond `half` samples on either side
Eigen::VectorXd slope_weights(int half, int padded, int order) {
  Eigen::VectorXd w = Eigen::VectorXd::Zero(2 * padded + 1);
  double s2 = 0.0, s4 = 0.0, s6 = 0.0;
  for (int k = -half; k <= half; ++k) {
    const double q = static_cast<double>(k) * k;
    s2 += q, s4 += q * q, s6 += q * q * q;
  }
  const double det = s2 * s6 - s4 * s4;
  for (int k = -half; k <= half; ++k) {
    const double x = k;
    w[k + padded] = order < 3 ? x / s2 : (s6 * x - s4 * x * x * x) / det;
  }
  return w;
}

}  // namespace

double choose_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& all_runs,
                     const Eigen::MatrixXd& positions, int order) {
  const std::vector<SampleRange> runs = spread_blocks(all_runs);
  const double step = median_step(time);
  if (!(step > 0.0) || positions.cols() == 0) return kWhenUnknown;
  const int fewest_half = (order + 2) / 2;  // least samples on either side in the filter
  const double shortest =
      std::max(std::clamp(kSamples * step, kShortestLow, kShortestHigh), 2.0 * fewest_half * step);
  std::vector<double> grid;
  for (double w = shortest; w < std::max(kLongest, 1.01 * shortest); w *= kRatio) grid.push_back(w);

  std::vector<Eigen::VectorXd> weights;  // of the first derivative, per step
  const auto half = [&](double w) { return static_cast<int>(std::floor(0.5 * w / step + 1e-6)); };
  const int widest = half(grid.back());
  weights.reserve(grid.size());
  for (const double w : grid) weights.push_back(slope_weights(half(w), widest, order));

  Eigen::VectorXd risk = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(grid.size()));
  bool any = false;
  for (Eigen::Index c = 0; c < positions.cols(); ++c) {
    const double sigma =
        noise_of(positions.col(c), runs) / step;  // of a velocity whose weights have norm 1
    if (!(sigma > 0.0)) continue;
    const double reference = sigma * sigma * weights[0].squaredNorm();
    Eigen::VectorXd first;
    for (std::size_t g = 0; g < grid.size(); ++g) {
      const Eigen::VectorXd v =
          SavitzkyGolay(time, runs, grid[g], order).apply(positions.col(c), 1);
      if (g == 0) first = v;
      const Eigen::ArrayXd d = (v - first).array();
      const double count = static_cast<double>(d.isFinite().count());
      if (count == 0.0) break;
      any = true;
      const double apart = d.isFinite().select(d.square(), 0.0).sum() / count;
      const double bias =
          std::max(0.0, apart - sigma * sigma * (weights[g] - weights[0]).squaredNorm());
      risk[static_cast<Eigen::Index>(g)] +=
          (sigma * sigma * weights[g].squaredNorm() + bias) / reference;
    }
  }
  if (!any) return std::max(kWhenUnknown, shortest);
  Eigen::Index best = 0;
  risk.minCoeff(&best);
  return grid[static_cast<std::size_t>(best)];
}

double sharpest_window(const Eigen::VectorXd& time, const std::vector<SampleRange>& all_runs,
                       const Eigen::MatrixXd& positions, double longest, int order) {
  const std::vector<SampleRange> runs = spread_blocks(all_runs);
  const double step = median_step(time);
  if (!(step > 0.0)) return longest;
  for (double w = kSamples * step; w < longest; w *= kRatio) {
    const SavitzkyGolay filter(time, runs, w, order);
    bool sharp = positions.cols() > 0;
    for (Eigen::Index c = 0; c < positions.cols() && sharp; ++c) {
      const Eigen::ArrayXd a = filter.apply(positions.col(c), 2).array();
      const double count = static_cast<double>(a.isFinite().count());
      const double whole = a.isFinite().select(a.square(), 0.0).sum() / std::max(1.0, count);
      const double noise = std::pow(noise_of(positions.col(c), runs) * filter.noise_gain(2), 2);
      sharp = noise <= kLargestDilution * (whole - noise);
    }
    if (sharp) return w;
  }
  return longest;
}

SavitzkyGolay make_filter(const Log& log, const SmoothingOptions& options) {
  double window = options.window_s;
  if (!(window > 0.0)) {
    std::vector<const Channel*> moving;
    for (const Channel& channel : log.channels) {
      if (channel.role == Role::kJointPosition || channel.role == Role::kStroke) {
        moving.push_back(&channel);
      }
    }
    Eigen::MatrixXd positions(log.samples(), static_cast<Eigen::Index>(moving.size()));
    for (std::size_t i = 0; i < moving.size(); ++i) {
      positions.col(static_cast<Eigen::Index>(i)) = moving[i]->values;
    }
    window = choose_window(log.time, log.runs, positions, options.order);
  }
  return {log.time, log.runs, window, options.order};
}

void quieten_acceleration(const Eigen::VectorXd& time, const std::vector<SampleRange>& runs,
                          const Eigen::VectorXd& positions, const SavitzkyGolay& filter,
                          Eigen::Ref<Eigen::VectorXd> second) {
  constexpr double kNoise = 3.0;  // standard deviations
  const Eigen::VectorXd narrow = second;
  const double noise = noise_of(positions, runs) * filter.noise_gain(2);
  for (const double wider : {1.4, 2.0, 3.0}) {
    const SavitzkyGolay wide(time, runs, wider * filter.window(), filter.order());
    const Eigen::VectorXd quiet = wide.apply(positions, 2);
    const double reach = 0.5 * wide.window();
    const auto differs = [&](Eigen::Index i) {
      return !(std::abs(narrow[i] - quiet[i]) < kNoise * noise);
    };
    for (const SampleRange& run : runs) {
      double last = -INFINITY;        // time of the last sample in which the windows differ
      Eigen::Index next = run.begin;  // and the next such sample
      for (Eigen::Index i = run.begin; i < run.end; ++i) {
        if (differs(i)) last = time[i];
        next = std::max(next, i);
        while (next < run.end && !differs(next)) ++next;
        const double ahead = next < run.end ? time[next] : INFINITY;
        if (std::min(time[i] - last, ahead - time[i]) > reach) second[i] = quiet[i];
      }
    }
  }
}

}  // namespace sparflow
