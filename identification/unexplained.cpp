#include "identification/unexplained.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "identification/robust.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
constexpr int kHats = 6;
constexpr int kFourier = 60;
/// A line this far above the median of its surroundings: by chance once in a hundred channels of 2000 rows
/// (exponential law: 2^-(ratio) per frequency).
constexpr double kLineRatio = 18.0;

/// Hat functions between quantiles, so that each holds the same number of rows.
MatrixXd hats(const VectorXd& x) {
  std::vector<double> knots;
  for (int k = 0; k < kHats; ++k) {
    const double v = quantile(x, 0.01 + 0.98 * k / (kHats - 1));
    if (knots.empty() || v > knots.back() + 1e-9 * (1.0 + std::abs(v))) knots.push_back(v);
  }
  const auto m = static_cast<Index>(knots.size());
  if (m < 2) return MatrixXd(x.size(), 0);
  MatrixXd h = MatrixXd::Zero(x.size(), m);
  for (Index i = 0; i < x.size(); ++i) {
    const double v = std::clamp(x[i], knots.front(), knots.back());
    auto k = std::upper_bound(knots.begin(), knots.end(), v) - knots.begin();
    k = std::clamp<std::ptrdiff_t>(k, 1, m - 1);
    const double w = (v - knots[static_cast<std::size_t>(k - 1)]) /
                     (knots[static_cast<std::size_t>(k)] - knots[static_cast<std::size_t>(k - 1)]);
    h(i, k - 1) = 1.0 - w;
    h(i, k) = w;
  }
  return h;
}

/// Cross-validated ridge: out-of-fold prediction at the strength that predicts best.
struct Ridge {
  VectorXd prediction;
  double explained = -1.0;  // 1 - squared error / variance, out of fold
};

Ridge cross_validated(const MatrixXd& x, const VectorXd& y, const std::vector<int>& fold,
                      int folds) {
  const Index m = x.cols();
  std::vector<MatrixXd> gram(static_cast<std::size_t>(folds), MatrixXd::Zero(m, m));
  std::vector<VectorXd> cross(static_cast<std::size_t>(folds), VectorXd::Zero(m));
  std::vector<std::vector<Index>> rows(static_cast<std::size_t>(folds));
  for (Index i = 0; i < y.size(); ++i)
    rows[static_cast<std::size_t>(fold[static_cast<std::size_t>(i)])].push_back(i);
  MatrixXd all = MatrixXd::Zero(m, m);
  VectorXd g_all = VectorXd::Zero(m);
  for (std::size_t f = 0; f < rows.size(); ++f) {
    const MatrixXd xf = x(rows[f], Eigen::all);
    gram[f].noalias() = xf.transpose() * xf;
    cross[f].noalias() = xf.transpose() * y(rows[f]);
    all += gram[f];
    g_all += cross[f];
  }
  Ridge best;
  const double scale = all.diagonal().mean();
  for (const double strength : {0.003, 0.03, 0.3}) {
    VectorXd prediction(y.size());
    for (std::size_t f = 0; f < rows.size(); ++f) {
      MatrixXd n = all - gram[f];
      n.diagonal().array() += strength * scale;
      const VectorXd w = n.llt().solve(g_all - cross[f]);
      for (const Index i : rows[f]) prediction[i] = x.row(i).dot(w);
    }
    const double explained = 1.0 - (y - prediction).squaredNorm() / y.squaredNorm();
    if (explained > best.explained) best = {prediction, explained};
  }
  return best;
}

/// An oscillation whose frequency wanders draws no line: the deepest dip of the autocorrelation between a twentieth
/// and one second of what is faster than a second. White noise has none, a step decays without one.
struct Swing {
  double dip = 0.0;        // autocorrelation there, of what exceeds white noise
  double frequency = 0.0;  // [Hz] half a period to the dip
  double rms = 0.0, noise = 0.0;
};

Swing strongest_swing(const Evidence& evidence, const EvidenceChannel& channel) {
  Swing best;
  for (std::size_t log = 0; log < channel.raw.size(); ++log) {
    const MachineSeries& s = evidence.series[log];
    const auto half = static_cast<Index>(std::lround(0.5 / s.step));
    const auto longest = static_cast<Index>(std::lround(0.7 / s.step)),
               shortest = std::max<Index>(2, static_cast<Index>(std::lround(0.05 / s.step)));
    VectorXd c = VectorXd::Zero(longest + 1);
    double n = 0.0, white = 0.0;
    for (const auto& [first, last] : s.runs) {
      const Index length = last - first;
      if (length < 8 * half) continue;
      const VectorXd x = channel.raw[log].segment(first, length);
      VectorXd h = VectorXd::Constant(length, std::numeric_limits<double>::quiet_NaN());
      for (Index i = half; i + half < length; ++i)
        h[i] = x[i] - x.segment(i - half, 2 * half + 1).mean();
      // starts and stops of motions are steps, not swings: larger than five times the usual is left out
      std::vector<double> sizes;
      for (const double v : h) {
        if (std::isfinite(v)) sizes.push_back(std::abs(v));
      }
      if (sizes.size() < 200) continue;
      const double usual =
          1.4826 * median(Eigen::Map<VectorXd>(sizes.data(), static_cast<Index>(sizes.size())));
      for (Index i = 0; i + longest < length; ++i) {
        if (!(std::abs(h[i]) < 5.0 * usual)) continue;
        bool whole = true;
        for (Index l = 0; l <= longest && whole; ++l) whole = std::abs(h[i + l]) < 5.0 * usual;
        if (!whole) continue;
        for (Index l = 0; l <= longest; ++l) c[l] += h[i] * h[i + l];
        n += 1.0;
      }
      for (Index i = 3; i < length; ++i) {
        const double d = x[i] - 3.0 * x[i - 1] + 3.0 * x[i - 2] - x[i - 3];
        if (std::isfinite(d)) white += std::min(d * d / 20.0, 25.0 * usual * usual);
      }
      white /= static_cast<double>(length);
    }
    if (n < 200.0) continue;
    c /= n;
    const double coloured = c[0] - white;
    if (coloured < 0.5 * white) continue;  // no larger than the noise
    for (Index l = shortest; l < longest; ++l) {
      if (c[l] / coloured < best.dip && c[l] <= c[l - 1] && c[l] <= c[l + 1]) {
        best = {c[l] / coloured, 0.5 / (static_cast<double>(l) * s.step), std::sqrt(coloured),
                std::sqrt(white)};
      }
    }
  }
  return best;
}

std::vector<int> folds_of(const EvidenceChannel& channel, int folds) {
  std::vector<int> fold(static_cast<std::size_t>(channel.rows()));
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      fold[static_cast<std::size_t>(i)] = static_cast<int>(b) % folds;
    }
  }
  return fold;
}

/// Rows of suspect logs only.
std::vector<Index> suspect_rows(const Evidence& evidence, const EvidenceChannel& channel) {
  std::vector<Index> rows;
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    if (static_cast<std::size_t>(channel.log[b]) >= evidence.suspects) continue;
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) rows.push_back(i);
  }
  return rows;
}

struct Line {
  double frequency = 0.0, share = 0.0;
};

/// Strongest line of the residual, in time; zero share when none stands out.
Line strongest_line(const Evidence& evidence, const EvidenceChannel& channel,
                    const VectorXd& residual) {
  const std::vector<Index> rows = suspect_rows(evidence, channel);
  const auto n = static_cast<double>(rows.size());
  if (n < 100) return {};
  // a few logs' time axes are one after the other: phases differ, so lines are summed log by log
  const double step = evidence.stride * evidence.series[0].step;
  const double span = n * step;
  const double highest = 0.45 / step;
  const auto count = static_cast<int>(std::min(4000.0, 2.0 * highest * span));
  std::vector<double> power(static_cast<std::size_t>(count), 0.0);
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
  for (int k = 1; k < count; ++k) {
    const double f = highest * k / count;
    for (std::size_t log = 0; log < by_log.size(); ++log) {
      const MachineSeries& s = evidence.series[log];
      double c = 0.0, d = 0.0;
      if (by_log[log].size() < 50) continue;
      for (const Index i : by_log[log]) {
        const double phase =
            2.0 * std::numbers::pi * f * s.time[channel.sample[static_cast<std::size_t>(i)]];
        c += (residual[i] - mean) * std::cos(phase);
        d += (residual[i] - mean) * std::sin(phase);
      }
      power[static_cast<std::size_t>(k)] +=
          2.0 * (c * c + d * d) / static_cast<double>(by_log[log].size());
    }
  }
  Line best;
  for (int k = 1; k < count; ++k) {
    const int half = std::max(20, count / 40);
    const int lo = std::max(1, k - half), hi = std::min(count, k + half);
    std::vector<double> around(power.begin() + lo, power.begin() + hi);
    std::nth_element(around.begin(),
                     around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2), around.end());
    const double median = around[around.size() / 2];
    const double share = power[static_cast<std::size_t>(k)] / total;
    // slow drifts are the flexible look's business
    if (highest * k / count * span > 20.0 &&
        power[static_cast<std::size_t>(k)] > kLineRatio * median && share > best.share) {
      best = {highest * k / count, share};
    }
  }
  return best;
}

}  // namespace

std::vector<SignalColumn> channel_signals(const Evidence& evidence,
                                          const EvidenceChannel& channel) {
  std::vector<SignalColumn> out;
  const Machine& machine = *evidence.series[0].machine;
  // A signal that shares its sensor with the channel explains the sensor's noise, nothing else.
  const bool pressures = channel.kind != EvidenceKind::kForce &&
                         channel.kind != EvidenceKind::kFlow && channel.kind != EvidenceKind::kPump;
  const auto shares_sensor = [&](std::size_t cylinder, bool pressure) {
    if (pressures && static_cast<int>(cylinder) == channel.index)
      return true;  // the learned process' own inputs
    const bool own =
        channel.kind != EvidenceKind::kPump && static_cast<int>(cylinder) == channel.index;
    if (channel.kind == EvidenceKind::kPump) return pressure;
    return own &&
           (pressure ? channel.kind != EvidenceKind::kFlow : channel.kind == EvidenceKind::kFlow);
  };
  const auto add = [&](const std::string& name, auto&& of) {
    VectorXd v = VectorXd::Zero(channel.rows());
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const MachineSeries& s = evidence.series[static_cast<std::size_t>(channel.log[b])];
      for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
        v[i] = of(s, channel.sample[static_cast<std::size_t>(i)], channel.blocks[b], i);
        if (!std::isfinite(v[i])) v[i] = 0.0;
      }
    }
    if (v.maxCoeff() > v.minCoeff()) out.push_back({name, std::move(v)});
  };
  const auto at = [](const VectorXd& v, Index k) { return k < v.size() ? v[k] : 0.0; };
  for (int j = 0; j < machine.joint_count(); ++j) {
    add("q_" + machine.joints[static_cast<std::size_t>(j)].name,
        [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return s.q(k, j); });
  }
  for (std::size_t i = 0; i < machine.cylinders.size(); ++i) {
    const std::string& name = machine.cylinders[i].name;
    using C = const CylinderSeries;
    const auto cylinder = [&](const std::string& text, auto of) {
      add(text, [&, of](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
        return of(s.cylinders[i], k);
      });
    };
    if (!shares_sensor(i, false)) {
      cylinder("v_" + name, [&](C& c, Index k) { return c.speed[k]; });
      cylinder("a_" + name, [&](C& c, Index k) { return c.acceleration[k]; });
    }
    if (!(pressures && static_cast<int>(i) == channel.index)) {
      cylinder("F_" + name, [&](C& c, Index k) { return c.static_force[k]; });
      cylinder("u_" + name, [&](C& c, Index k) { return at(c.command, k); });
    }
    if (!shares_sensor(i, true)) {
      cylinder("pA_" + name, [&](C& c, Index k) { return at(c.pressure_a, k); });
      cylinder("pB_" + name, [&](C& c, Index k) { return at(c.pressure_b, k); });
    }
    cylinder("du/dt_" + name, [&](C& c, Index k) {
      return c.command.size() > k + 1 && k > 0 ? c.command[k + 1] - c.command[k - 1] : 0.0;
    });
  }
  for (std::size_t p = 0; p < machine.pumps.size(); ++p) {
    if (channel.kind == EvidenceKind::kPump) continue;
    add("p_" + machine.pumps[p].name, [&](const MachineSeries& s, Index k, const NoiseBlock&,
                                          Index) { return at(s.pumps[p].pressure, k); });
  }
  add("total flow", [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) {
    double sum = 0.0;
    for (const CylinderSeries& c : s.cylinders) sum += c.flow[k];
    return sum;
  });
  add("payload",
      [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return at(s.payload, k); });
  add("oil",
      [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return at(s.oil, k); });
  add("time", [&](const MachineSeries& s, Index k, const NoiseBlock&, Index) { return s.time[k]; });
  add("time since the motion's start",
      [&](const MachineSeries&, Index, const NoiseBlock& b, Index i) {
        return std::min(20.0, static_cast<double>(i - b.first));
      });
  return out;
}

namespace {

/// Products of hat functions of own flow and own measured force.
MatrixXd own_process_basis(const Evidence& evidence, const EvidenceChannel& channel,
                           const std::vector<Index>& rows) {
  VectorXd flow(channel.rows()), force(channel.rows());
  for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
    const CylinderSeries& c = evidence.series[static_cast<std::size_t>(channel.log[b])]
                                  .cylinders[static_cast<std::size_t>(channel.index)];
    for (Index i = channel.blocks[b].first; i < channel.blocks[b].last; ++i) {
      const Index k = channel.sample[static_cast<std::size_t>(i)];
      flow[i] = c.flow[k];
      force[i] = c.force.size() > k ? c.force[k] : c.static_force[k];
    }
  }
  const MatrixXd a = hats(flow(rows)), b = hats(force(rows));
  if (a.cols() == 0 || b.cols() == 0) return MatrixXd::Ones(static_cast<Index>(rows.size()), 1);
  MatrixXd basis(static_cast<Index>(rows.size()), a.cols() * b.cols());
  for (Index i = 0; i < a.cols(); ++i) {
    for (Index j = 0; j < b.cols(); ++j)
      basis.col(i * b.cols() + j) = a.col(i).cwiseProduct(b.col(j));
  }
  return basis;
}

}  // namespace

namespace {

/// Below these nobody cares, however regular it is: 0.05 bar, 0.05 mm/s, a tenth of a percent of the largest force.
double smallest_of_interest(const EvidenceChannel& channel) {
  if (channel.kind == EvidenceKind::kFlow) return 5e-5;
  if (channel.kind != EvidenceKind::kForce) return 5e3;
  return 1e-3 * channel.largest_force;
}

}  // namespace

std::vector<Leftover> find_leftovers(const Evidence& evidence, const EffectFit& fit,
                                     const LeftoverOptions& options) {
  std::vector<Leftover> found;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    const VectorXd& whole = fit.residual[c];
    const std::vector<Index> rows = suspect_rows(evidence, channel);
    if (rows.size() < 80 || whole.size() == 0) continue;
    VectorXd y = whole(rows).array() - whole(rows).mean();
    if (channel.kind != EvidenceKind::kForce && channel.kind != EvidenceKind::kFlow &&
        channel.kind != EvidenceKind::kPump) {
      // a learned process follows any smooth law of the cylinder's own flow and force: that is no riddle
      const MatrixXd own = own_process_basis(evidence, channel, rows);
      MatrixXd gram = own.transpose() * own;
      gram.diagonal().array() += 1e-3 * gram.diagonal().mean();
      y -= own * gram.llt().solve(own.transpose() * y);
      y.array() -= y.mean();
    }
    const std::vector<int> all_folds = folds_of(channel, options.folds);
    std::vector<int> fold;
    fold.reserve(rows.size());
    for (const Index i : rows) fold.push_back(all_folds[static_cast<std::size_t>(i)]);
    const std::vector<SignalColumn> signals = channel_signals(evidence, channel);
    std::vector<MatrixXd> parts;
    MatrixXd standard(static_cast<Index>(rows.size()), static_cast<Index>(signals.size()));
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const VectorXd v = signals[s].values(rows);
      const double sd = std::sqrt((v.array() - v.mean()).square().mean());
      standard.col(static_cast<Index>(s)) =
          sd > 0.0 ? VectorXd((v.array() - v.mean()) / sd) : VectorXd::Zero(v.size());
      MatrixXd h = hats(v);
      h.rowwise() -= h.colwise().mean().eval();
      parts.push_back(std::move(h));
    }
    // all signals together: random directions, a fifth of the signals in each
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.0, 2.0 * std::numbers::pi);
    MatrixXd fourier(standard.rows(), kFourier);
    for (int k = 0; k < kFourier; ++k) {
      VectorXd w = VectorXd::Zero(standard.cols());
      for (int pick = 0; pick < 4; ++pick)
        w[static_cast<Index>(random() % static_cast<unsigned>(w.size()))] = 0.7 * normal(random);
      fourier.col(k) = ((standard * w).array() + uniform(random)).cos();
    }
    fourier.rowwise() -= fourier.colwise().mean().eval();
    Index width = kFourier;
    for (const MatrixXd& p : parts) width += p.cols();
    MatrixXd x(standard.rows(), width);
    x.leftCols(kFourier) = 0.5 * fourier;
    Index at = kFourier;
    for (const MatrixXd& p : parts) {
      x.middleCols(at, p.cols()) = p;
      at += p.cols();
    }
    const Ridge ridge = cross_validated(x, y, fold, options.folds);
    Leftover left;
    left.channel = c;
    const double variance = y.squaredNorm() / static_cast<double>(y.size());
    const Line line = strongest_line(evidence, channel, whole);
    left.explained = std::max(ridge.explained, line.share);
    left.rms = std::sqrt(std::max(0.0, left.explained) * variance);
    left.noise = std::sqrt(std::max(0.0, 1.0 - left.explained) * variance);
    const Swing swing = strongest_swing(evidence, channel);
    if (swing.dip < options.deepest_dip && left.explained < options.least_share) {
      left.explained = swing.rms * swing.rms / (swing.rms * swing.rms + swing.noise * swing.noise);
      left.rms = swing.rms;
      left.noise = swing.noise;
      left.frequency = swing.frequency;
      left.depends_on.push_back(fmt::format("time, a swing near {:.1f} Hz", swing.frequency));
      found.push_back(std::move(left));
      continue;
    }
    if (left.rms < smallest_of_interest(channel)) continue;
    if (left.explained < options.least_share || left.rms < options.least_size * left.noise)
      continue;
    if (line.share > 0.5 * left.explained) {
      left.frequency = line.frequency;
      left.depends_on.push_back(fmt::format("time, {:.2f} Hz", line.frequency));
    }
    // which signals: each alone, out of fold
    std::vector<std::pair<double, std::string>> alone;
    for (std::size_t s = 0; s < signals.size(); ++s) {
      if (parts[s].cols() == 0) continue;
      alone.emplace_back(cross_validated(parts[s], y, fold, options.folds).explained,
                         signals[s].name);
    }
    std::sort(alone.rbegin(), alone.rend());
    for (const auto& [share, name] : alone) {
      if (share < 0.2 * left.explained || left.depends_on.size() >= 4) break;
      left.depends_on.push_back(name);
    }
    if (left.depends_on.empty()) left.depends_on.emplace_back("several signals together");
    found.push_back(std::move(left));
  }
  std::sort(found.begin(), found.end(),
            [](const Leftover& a, const Leftover& b) { return a.rms / a.noise > b.rms / b.noise; });
  return found;
}

}  // namespace sparflow
