#include "identification/comparison/compare_regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Totals of a pool, the denominators of all shares.
struct Pool {
  double error = 0.0;
  double samples = 0.0;
};

/// A signal divided into bins at its quantiles.
struct BinnedSignal {
  const RegimeSignal* signal = nullptr;
  std::vector<double> edges;  ///< bins + 1, SI
  std::vector<int> bin;       ///< [samples] bin, -1 = none
  int bins() const { return static_cast<int>(edges.size()) - 1; }
};

/// Divides a signal at its quantiles; equal values lie in one bin. A signal that does not vary gets no bins.
BinnedSignal binned(const RegimeSignal& signal, int bins) {
  BinnedSignal out;
  out.signal = &signal;
  std::vector<double> sorted;
  for (const double v : signal.values) {
    if (std::isfinite(v)) sorted.push_back(v);
  }
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty() || sorted.front() == sorted.back()) return out;
  out.edges.push_back(sorted.front());
  for (int b = 1; b < bins; ++b) {
    const double edge =
        sorted[sorted.size() * static_cast<std::size_t>(b) / static_cast<std::size_t>(bins)];
    if (edge > out.edges.back() && edge < sorted.back()) out.edges.push_back(edge);
  }
  out.edges.push_back(sorted.back());
  out.bin.assign(static_cast<std::size_t>(signal.values.size()), -1);
  for (Index k = 0; k < signal.values.size(); ++k) {
    const double v = signal.values[k];
    if (!std::isfinite(v)) continue;
    const auto above = std::upper_bound(out.edges.begin() + 1, out.edges.end() - 1, v);
    out.bin[static_cast<std::size_t>(k)] = static_cast<int>(above - out.edges.begin()) - 1;
  }
  return out;
}

struct Candidate {
  double score = 0.0, error = 0.0, samples = 0.0;
  const BinnedSignal* first = nullptr;
  const BinnedSignal* second = nullptr;
  int first_lo = 0, first_hi = 0, second_lo = 0, second_hi = 0;  ///< bins lo .. hi-1
};

double score_of(double error_share, double sample_share) {
  const double e = std::min(error_share, 1.0), s = std::min(sample_share, 1.0);
  if (s <= 0.0 || e <= s) return 0.0;
  const double rest = e < 1.0 ? (1.0 - e) * std::log((1.0 - e) / std::max(1.0 - s, 1e-12)) : 0.0;
  return e * std::log(e / s) + rest;
}

/// @return score of a region with these totals; 0 when it is below the thresholds of the options
double judged(double error, double samples, const Pool& pool, const RegionOptions& options) {
  if (samples < options.least_share * pool.samples || pool.error <= 0.0) return 0.0;
  const double e = error / pool.error, s = samples / pool.samples;
  if (e < options.least_error || e < options.contrast * options.contrast * s) return 0.0;
  return score_of(e, s);
}

/// Sums over [0, i) x [0, j), so that the sum of any rectangle of bins takes four look-ups.
struct Table {
  MatrixXd error, samples;
  Table(const ErrorGroup& group, const BinnedSignal& a, const BinnedSignal* b) {
    const int columns = b == nullptr ? 1 : b->bins();
    error = samples = MatrixXd::Zero(a.bins() + 1, columns + 1);
    for (Index k = 0; k < group.squared_error.size(); ++k) {
      const int i = a.bin[static_cast<std::size_t>(k)];
      const int j = b == nullptr ? 0 : b->bin[static_cast<std::size_t>(k)];
      if (i < 0 || j < 0) continue;
      error(i + 1, j + 1) += group.squared_error[k];
      samples(i + 1, j + 1) += 1.0;
    }
    for (MatrixXd* m : {&error, &samples}) {
      for (Index i = 1; i < m->rows(); ++i) m->row(i) += m->row(i - 1);
      for (Index j = 1; j < m->cols(); ++j) m->col(j) += m->col(j - 1);
    }
  }
  static double box(const MatrixXd& m, int i0, int i1, int j0, int j1) {
    return m(i1, j1) - m(i0, j1) - m(i1, j0) + m(i0, j0);
  }
};

/// @return interval (b null) or rectangle of bins with the highest score
Candidate scan(const ErrorGroup& group, const BinnedSignal& a, const BinnedSignal* b,
               const Pool& pool, const RegionOptions& options) {
  const Table table(group, a, b);
  const int columns = b == nullptr ? 1 : b->bins();
  Candidate best;
  for (int i0 = 0; i0 < a.bins(); ++i0) {
    for (int i1 = i0 + 1; i1 <= a.bins(); ++i1) {
      if (i1 - i0 == a.bins()) continue;  // the whole range restricts nothing
      for (int j0 = 0; j0 < columns; ++j0) {
        for (int j1 = j0 + 1; j1 <= columns; ++j1) {
          if (b != nullptr && j1 - j0 == columns) continue;
          const double error = Table::box(table.error, i0, i1, j0, j1);
          const double samples = Table::box(table.samples, i0, i1, j0, j1);
          const double score = judged(error, samples, pool, options);
          if (score > best.score) best = {score, error, samples, &a, b, i0, i1, j0, j1};
        }
      }
    }
  }
  return best;
}

/// @return indices of the `most` largest scores, in their order; of equal ones the first
std::vector<std::size_t> best_scores(const std::vector<double>& scores, std::size_t most) {
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (order.size() <= most) return order;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
  order.resize(most);
  std::sort(order.begin(), order.end());
  return order;
}

Candidate best_of(const ErrorGroup& group, const std::vector<BinnedSignal>& signals,
                  const Pool& pool, const RegionOptions& options) {
  Candidate whole;
  whole.error = group.squared_error.sum();
  whole.samples = static_cast<double>(group.squared_error.size());
  whole.score = judged(whole.error, whole.samples, pool, options);
  Candidate one, two;
  std::vector<double> alone;
  for (const BinnedSignal& signal : signals) {
    const Candidate c = scan(group, signal, nullptr, pool, options);
    alone.push_back(c.score);
    if (c.score > one.score) one = c;
  }
  const std::vector<std::size_t> tried = best_scores(alone, options.paired);
  for (std::size_t i = 0; i < tried.size(); ++i) {
    for (std::size_t j = i + 1; j < tried.size(); ++j) {
      const Candidate d = scan(group, signals[tried[i]], &signals[tried[j]], pool, options);
      if (d.score > two.score) two = d;
    }
  }
  Candidate best = whole;
  if (one.score > options.gain_per_signal * best.score) best = one;
  // Each additional signal must raise the score by the factor of the options.
  const int more = best.first == nullptr ? 2 : 1;
  if (two.score > std::pow(options.gain_per_signal, more) * best.score) best = two;
  return best;
}

/// Formats an interval with enough digits to distinguish its ends.
std::string interval(const RegionBound& bound) {
  const double width = bound.hi - bound.lo;
  const int digits =
      width >= 20.0 ? 0 : std::clamp(1 - static_cast<int>(std::floor(std::log10(width))), 0, 6);
  const auto without_minus_zero = [&](double v) {
    return std::abs(v) < 0.5 * std::pow(10.0, -digits) ? 0.0 : v;
  };
  return fmt::format("{} {:.{}f}..{:.{}f}{}{}", bound.words, without_minus_zero(bound.lo), digits,
                     without_minus_zero(bound.hi), digits, bound.unit.empty() ? "" : " ",
                     bound.unit);
}

std::string describe(const WorstRegion& region, const ErrorGroup& group) {
  std::string text = group.words;
  for (std::size_t i = 0; i < region.where.size(); ++i) {
    text += (i == 0 ? " with " : " and ") + interval(region.where[i]);
  }
  const std::string rmse = region.rmse >= 1000.0 ? fmt::format("{:.0f}", region.rmse)
                                                 : fmt::format("{:.3g}", region.rmse);
  return text + fmt::format(": {:.0f} % of {} in {:.0f} % of the samples (RMSE {} {})",
                            100.0 * region.share_of_error, group.pool_words,
                            100.0 * region.share_of_samples, rmse, region.unit);
}

WorstRegion region_of(const ErrorGroup& group, const Candidate& c, const Pool& pool) {
  WorstRegion region;
  region.stage = group.stage;
  region.at = group.at;
  region.regime = group.regime;
  const auto bound = [&](const BinnedSignal* s, int lo, int hi) {
    if (s == nullptr) return;
    region.where.push_back({s->signal->key, s->signal->words, s->signal->unit,
                            s->edges[static_cast<std::size_t>(lo)] / s->signal->scale,
                            s->edges[static_cast<std::size_t>(hi)] / s->signal->scale});
  };
  bound(c.first, c.first_lo, c.first_hi);
  bound(c.second, c.second_lo, c.second_hi);
  region.rmse = std::sqrt(c.error / c.samples) / group.scale;
  region.unit = group.unit;
  region.share_of_error = c.error / pool.error;
  region.share_of_samples = c.samples / pool.samples;
  region.score = c.score;
  region.sentence = describe(region, group);
  return region;
}

}  // namespace

std::vector<WorstRegion> worst_regions(const std::vector<ErrorGroup>& groups,
                                       const RegionOptions& options) {
  return worst_regions({groups.size(), [&groups](std::size_t i, bool) { return groups[i]; }},
                       options);
}

std::vector<WorstRegion> worst_regions(const ErrorGroups& groups, const RegionOptions& options) {
  std::map<std::string, Pool> pools;
  for (std::size_t i = 0; i < groups.count; ++i) {
    const ErrorGroup group = groups.gather(i, false);
    Pool& pool = pools[group.pool];
    pool.error += group.squared_error.sum();
    pool.samples += static_cast<double>(group.squared_error.size());
  }
  struct Ranked {
    double severity;
    WorstRegion region;
  };
  std::vector<Ranked> ranked;
  for (std::size_t i = 0; i < groups.count; ++i) {
    const ErrorGroup group = groups.gather(i, true);
    if (group.squared_error.size() == 0) continue;
    if (group.severity < options.least_severity) continue;
    std::vector<BinnedSignal> signals;
    for (const RegimeSignal& signal : group.signals) {
      BinnedSignal b = binned(signal, options.bins);
      if (b.bins() > 1) signals.push_back(std::move(b));
    }
    const Pool& pool = pools[group.pool];
    const Candidate best = best_of(group, signals, pool, options);
    if (best.score <= 0.0) continue;
    ranked.push_back({best.score * group.severity, region_of(group, best, pool)});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.severity > b.severity; });
  std::vector<WorstRegion> out;
  for (Ranked& r : ranked) {
    if (static_cast<int>(out.size()) < options.most) out.push_back(std::move(r.region));
  }
  return out;
}

}  // namespace sparflow
