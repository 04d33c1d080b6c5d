#include "identification/mapping_proposal/proposal_samples.h"

#include <algorithm>
#include <cmath>

#include "models/math/nan.h"
#include "models/math/robust.h"

namespace sparflow {
namespace {

/// First and last time of all channels.
Range extent(const Recording& recording) {
  Range all{kNaN, kNaN};
  for (const RecordedChannel& c : recording.channels) {
    if (c.time.empty()) continue;
    all.lo = std::isfinite(all.lo) ? std::min(all.lo, c.time.front()) : c.time.front();
    all.hi = std::isfinite(all.hi) ? std::max(all.hi, c.time.back()) : c.time.back();
  }
  return all;
}

void place_instants(const Recording& recording, const SampleOptions& o, ProposalSamples* s) {
  const Range all = extent(recording);
  const double duration = all.hi - all.lo;
  if (!(duration > 0.0)) return;
  // A recording of a few seconds is judged on finer instants, so that there are enough of them.
  s->step = std::min(o.step, duration / 100.0);
  const double wanted = std::floor(duration / s->step) + 1.0;
  const bool whole = wanted <= static_cast<double>(o.most_instants);
  const int stretches = whole ? 1 : o.stretches;
  const Eigen::Index each =
      whole ? static_cast<Eigen::Index>(wanted) : o.most_instants / o.stretches;
  s->time.resize(each * stretches);
  for (int k = 0; k < stretches; ++k) {
    const double spare = duration - static_cast<double>(each - 1) * s->step;
    const double begin =
        all.lo + (stretches == 1 ? 0.0 : spare * static_cast<double>(k) / (stretches - 1));
    for (Eigen::Index i = 0; i < each; ++i) {
      s->time[k * each + i] = begin + static_cast<double>(i) * s->step;
    }
    s->runs.push_back({k * each, (k + 1) * each});
  }
}

/// Mean of the samples around each instant, else the value before. @return share of instants with a value of their own or
/// within three of the channel's intervals of one
double fill(const RecordedChannel& c, const ProposalSamples& s, Eigen::Ref<Eigen::VectorXd> out) {
  const double interval =
      c.time.size() > 1 ? (c.time.back() - c.time.front()) / static_cast<double>(c.time.size() - 1)
                        : 0.0;
  const double half = 0.5 * s.step;
  Eigen::Index filled = 0;
  double held = kNaN, held_at = -1e300;
  for (Eigen::Index i = 0; i < s.instants(); ++i) {
    const double t = s.time[i];
    auto k = static_cast<std::size_t>(std::lower_bound(c.time.begin(), c.time.end(), t - half) -
                                      c.time.begin());
    double sum = 0.0;
    int n = 0;
    for (; k < c.time.size() && c.time[k] < t + half; ++k) {
      if (!std::isfinite(c.values[k])) continue;
      sum += c.values[k];
      held = c.values[k];
      held_at = c.time[k];
      ++n;
    }
    if (n == 0 && k > 0 && std::isfinite(c.values[k - 1]))
      held = c.values[k - 1], held_at = c.time[k - 1];
    out[i] = n > 0 ? sum / n : held;
    if (n > 0 || (std::isfinite(held) && t - held_at <= 3.0 * interval)) ++filled;
  }
  // What precedes the first value takes it.
  Eigen::Index first = 0;
  while (first < out.size() && !std::isfinite(out[first])) ++first;
  if (first < out.size()) out.head(first).setConstant(out[first]);
  return s.instants() == 0 ? 0.0 : static_cast<double>(filled) / static_cast<double>(s.instants());
}

ChannelShape shape_of(const Eigen::VectorXd& v, const std::vector<SampleRange>& runs) {
  ChannelShape shape;
  shape.usable = v.size() > 0 && v.allFinite();
  if (!shape.usable) return shape;
  shape.low = quantile(v, 0.005);
  shape.high = quantile(v, 0.995);
  const double range = v.maxCoeff() - v.minCoeff();
  shape.constant = range <= 1e-12 * std::max(1.0, v.cwiseAbs().maxCoeff());
  const double most = v.cwiseAbs().maxCoeff();
  shape.zero =
      static_cast<double>((v.array().abs() <= 0.01 * most).count()) / static_cast<double>(v.size());
  if (shape.constant) {
    shape.resting = 1.0;
    return shape;
  }
  const double mean = v.mean();
  const double spread = std::sqrt((v.array() - mean).square().mean());
  double squares = 0.0;
  Eigen::Index steps = 0, still = 0;
  for (const SampleRange& run : runs) {
    for (Eigen::Index i = run.begin + 1; i < run.end; ++i) {
      const double d = v[i] - v[i - 1];
      squares += d * d;
      ++steps;
      if (std::abs(d) <= 1e-3 * range) ++still;
    }
  }
  if (steps == 0) return shape;
  shape.roughness = std::sqrt(squares / static_cast<double>(steps)) / spread;
  shape.resting = static_cast<double>(still) / static_cast<double>(steps);
  return shape;
}

}  // namespace

ProposalSamples proposal_samples(const Recording& recording, const SampleOptions& o) {
  ProposalSamples s;
  place_instants(recording, o, &s);
  const auto channels = static_cast<Eigen::Index>(recording.channels.size());
  s.values.resize(s.instants(), channels);
  s.shapes.reserve(recording.channels.size());
  for (Eigen::Index m = 0; m < channels; ++m) {
    Eigen::VectorXd values(s.instants());
    const double filled = fill(recording.channels[static_cast<std::size_t>(m)], s, values);
    s.shapes.push_back(shape_of(values, s.runs));
    s.shapes.back().usable = s.shapes.back().usable && filled >= o.least_filled;
    s.values.col(m) = values;
  }
  return s;
}

Eigen::VectorXd rate_of_change(const ProposalSamples& s,
                               const Eigen::Ref<const Eigen::VectorXd>& v) {
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(v.size());
  for (const SampleRange& run : s.runs) {
    for (Eigen::Index i = run.begin; i < run.end; ++i) {
      const Eigen::Index before = std::max(run.begin, i - 1), after = std::min(run.end - 1, i + 1);
      if (after > before) rate[i] = (v[after] - v[before]) / (s.time[after] - s.time[before]);
    }
  }
  return rate;
}

}  // namespace sparflow
