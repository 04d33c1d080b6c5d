#include "diagnosis/evidence/noise_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "models/math/robust.h"

namespace sparflow {
namespace {

/// Passes of the moment estimate: means are shrunken by the offset variance of the pass before.
constexpr int kPasses = 3;

struct Reflection {
  double k1 = 0.0, k2 = 0.0;
};

Reflection reflections(const NoiseModel& m) {
  // inverse Levinson recursion: k2 = phi2, k1 = phi1 / (1 - phi2)
  return {m.phi1 / (1.0 - m.phi2), m.phi2};
}

constexpr double kFirstClass = 0.05, kClassRatio = 1.5;  // [s], [1]

/// Squares by the class of the time since a command changed. A class has the variance that its median square implies for normal
/// values, so that one motion out of many decides nothing.
struct SettlingClasses {
  static constexpr int kCount = SettlingTimes::kClasses;
  static constexpr double kMedianSquare = 0.4549;  // of a normal value of unit variance
  std::array<double, kCount> squares{}, rows{};

  SettlingClasses(const Eigen::Ref<const Eigen::VectorXd>& residual, const NoiseRows& of) {
    std::array<std::vector<double>, kCount> all;
    for (const auto& [first, last] : of.blocks) {
      for (Eigen::Index t = first; t < last; ++t)
        all[of.since_change->class_of(t)].push_back(residual[t] * residual[t]);
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (all[k].empty()) continue;
      const auto middle = all[k].begin() + std::ssize(all[k]) / 2;
      std::nth_element(all[k].begin(), middle, all[k].end());
      rows[k] = static_cast<double>(all[k].size());
      squares[k] = rows[k] * *middle / kMedianSquare;
    }
  }
  static double time(int k) { return SettlingTimes::time(k); }
  double rows_between(double from, double to) const {
    double n = 0.0;
    for (int k = 0; k < kCount; ++k)
      if (time(k) >= from && time(k) <= to) n += rows[static_cast<std::size_t>(k)];
    return n;
  }
  /// Of independent rows with the deviation s(t), up to a constant. [nats]
  double log_likelihood(const SettlingTimes::Law& law) const {
    double sum = 0.0, n = 0.0, logs = 0.0;
    for (std::size_t k = 0; k < kCount; ++k) {
      sum += squares[k] * law.inverse_squares[k];
      logs += rows[k] * law.logs[k];
      n += rows[k];
    }
    return -logs - 0.5 * n * std::log(std::max(sum / n, 1e-300));
  }
};

SettlingTimes::Law law_of(double ratio, double settling) {
  SettlingTimes::Law law{ratio, settling, {}, {}};
  for (int k = 0; k < SettlingTimes::kClasses; ++k) {
    const double s = 1.0 + (ratio - 1.0) * std::exp(-SettlingTimes::time(k) / settling);
    law.inverse_squares[static_cast<std::size_t>(k)] = 1.0 / (s * s);
    law.logs[static_cast<std::size_t>(k)] = std::log(s);
  }
  return law;
}

/// Sets `transient` and `settling` to the most likely ones.
void estimate_settling(const Eigen::Ref<const Eigen::VectorXd>& residual, const NoiseRows& rows,
                       const NoiseOptions& options, NoiseModel& m) {
  if (rows.since_change == nullptr) return;
  constexpr double kSteadyFrom = 3.0;  // time constants, after which e^-3 of the excess is left
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const SettlingClasses classes(residual, rows);
  const auto occurs = [&](double settling) {
    return std::min(classes.rows_between(0.0, settling),
                    classes.rows_between(kSteadyFrom * settling, kNever)) >=
           options.fewest_rows_of_kind;
  };
  double best = classes.log_likelihood(law_of(1.0, 1.0)) + options.least_settling_gain;
  for (const SettlingTimes::Law& law : rows.since_change->laws()) {
    const double likelihood = classes.log_likelihood(law);
    if (likelihood <= best || !occurs(law.settling)) continue;
    best = likelihood;
    m.transient = law.ratio;
    m.settling = law.settling;
  }
}

/// See NoiseModel::estimate; all rows have the same deviation.
NoiseModel estimate_evenly(const Eigen::Ref<const Eigen::VectorXd>& residual,
                           const std::vector<NoiseBlock>& blocks, bool offsets,
                           const NoiseOptions& options) {
  const double largest = options.largest_reflection;
  NoiseModel m;
  double tau2 = 0.0;
  Eigen::VectorXd means(static_cast<Eigen::Index>(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Eigen::Index n = blocks[b].last - blocks[b].first;
    means[static_cast<Eigen::Index>(b)] = n > 0 ? residual.segment(blocks[b].first, n).mean() : 0.0;
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    double c0 = 0.0, c1 = 0.0, c2 = 0.0;
    double n0 = 0.0, n1 = 0.0, n2 = 0.0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, last] = blocks[b];
      const auto n = static_cast<double>(last - first);
      if (n < 1) continue;
      const double sd = m.deviation();
      const double shrink =
          tau2 > 0.0 ? tau2 / (tau2 + sd * sd / std::max(1.0, n / options.rows_alike)) : 0.0;
      const double mean = shrink * means[static_cast<Eigen::Index>(b)];
      const auto lost = shrink / std::max(1.0, n);  // subtracting a mean reduces the variance
      for (Eigen::Index t = first; t < last; ++t) {
        const double r0 = residual[t] - mean;
        c0 += r0 * r0 * (1.0 + lost);
        if (t >= first + 1) c1 += r0 * (residual[t - 1] - mean);
        if (t >= first + 2) c2 += r0 * (residual[t - 2] - mean);
      }
      n0 += n;
      n1 += std::max(0.0, n - 1.0);
      n2 += std::max(0.0, n - 2.0);
    }
    if (n0 < 3.0 || c0 <= 0.0) {
      m.variance = n0 > 0.0 ? std::max(c0 / n0, 1e-300) : 1.0;
      return m;
    }
    const double coloured = 1.0 - options.white_share;
    const double g0 = c0 / n0, g1 = n1 > 0 ? coloured * c1 / n1 : 0.0,
                 g2 = n2 > 0 ? coloured * c2 / n2 : 0.0;
    const double k1 = std::clamp(g1 / g0, -largest, largest);
    const double e1 = g0 * (1.0 - k1 * k1);
    const double k2 = std::clamp((g2 - k1 * g1) / e1, -largest, largest);
    m.phi1 = k1 * (1.0 - k2);
    m.phi2 = k2;
    m.variance = std::max(e1 * (1.0 - k2 * k2), 1e-300);
    m.offset_variance = 0.0;
    if (!offsets || blocks.size() < static_cast<std::size_t>(options.fewest_blocks_for_offsets))
      return m;
    // variance of a block's mean by the autoregression alone: spectral density at zero frequency / n
    const double gain = 1.0 - m.phi1 - m.phi2;
    const double at_zero = m.variance / (gain * gain);
    double sum = 0.0, weight = 0.0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto n = static_cast<double>(blocks[b].last - blocks[b].first);
      if (n < 2) continue;
      const double noise = std::min(at_zero / n, g0);
      const double mean = means[static_cast<Eigen::Index>(b)];
      sum += n * (mean * mean - noise);
      weight += n;
    }
    tau2 = weight > 0.0 ? std::max(0.0, sum / weight) : 0.0;
    m.offset_variance = tau2;
    if (tau2 == 0.0) break;
  }
  return m;
}

/// The most likely deviations of the blocks, whose variances have a prior of the inverse gamma distribution about that of the model,
/// which makes a block's values Student's (Lange, Little, Taylor 1989, J. Am. Stat. Assoc. 84, 881), in turn with the model.
/// @param m of `values`  @param estimate of values of one deviation
template <typename Estimate>
NoiseModel with_block_scales(NoiseModel m, const Eigen::VectorXd& values,
                             const std::vector<NoiseBlock>& blocks, const NoiseOptions& options,
                             const Estimate& estimate) {
  constexpr int kScaleTurns = 2;
  const double freedom = options.block_freedom;
  if (!(freedom > 0.0) ||
      blocks.size() < static_cast<std::size_t>(options.fewest_blocks_for_scales))
    return m;
  const auto rows = [&](std::size_t b) {
    return static_cast<double>(blocks[b].last - blocks[b].first);
  };
  std::vector<double> scale(blocks.size(), 1.0), squares(blocks.size());
  for (int turn = 0; turn < kScaleTurns; ++turn) {
    Eigen::MatrixXd white = values;
    m.whiten(blocks, white);
    std::vector<double> means;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, last] = blocks[b];
      squares[b] = scale[b] * scale[b] * white.col(0).segment(first, last - first).squaredNorm();
      if (rows(b) > 0.0) means.push_back(squares[b] / rows(b));
    }
    // the variance of all values together is that of the loudest blocks
    const double variance =
        turn == 0 ? median(Eigen::Map<const Eigen::VectorXd>(means.data(), std::ssize(means)))
                  : m.variance;
    Eigen::VectorXd even = values;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      scale[b] =
          std::sqrt((freedom + squares[b] / std::max(variance, 1e-300)) / (freedom + rows(b)));
      even.segment(blocks[b].first, blocks[b].last - blocks[b].first) /= scale[b];
    }
    m = estimate(even);
    m.block_scale = scale;
    m.block_freedom = freedom;
  }
  return m;
}

/// Sum of the logarithms of values between 1 and NoiseOptions::largest_transient_ratio, few of which are taken.
double sum_of_logs(const Eigen::VectorXd& values) {
  constexpr Eigen::Index kAtOnce = 64;  // 30^64 < 1e95
  double sum = 0.0;
  for (Eigen::Index k = 0; k < values.size(); k += kAtOnce)
    sum += std::log(values.segment(k, std::min(kAtOnce, values.size() - k)).prod());
  return sum;
}

}  // namespace

SettlingTimes::SettlingTimes(const Eigen::VectorXd& since, const NoiseOptions& options)
    : settling_(options.settling.begin(), options.settling.end()) {
  const double per_class = 1.0 / std::log(kClassRatio);
  class_of_.reserve(static_cast<std::size_t>(since.size()));
  for (const double t : since) {
    const double at = t < kFirstClass
                          ? 0.0
                          : std::min(1.0 + std::log(t / kFirstClass) * per_class, kClasses - 1.0);
    class_of_.push_back(static_cast<unsigned char>(at));
  }
  for (const double settling : settling_)
    decay_.emplace_back((-since.array() / settling).exp().matrix());
  constexpr double kRatioStep = 1.4;  // between the ratios that are tried
  for (const double settling : settling_)
    for (double ratio = kRatioStep; ratio <= options.largest_transient_ratio; ratio *= kRatioStep)
      laws_.push_back(law_of(ratio, settling));
}

SettlingTimes SettlingTimes::of_rows(const std::vector<Eigen::Index>& rows) const {
  SettlingTimes out = *this;
  if (!known()) return out;
  out.class_of_.clear();
  for (const Eigen::Index r : rows) out.class_of_.push_back(class_of_[static_cast<std::size_t>(r)]);
  for (Eigen::VectorXd& d : out.decay_) d = d(rows).eval();
  return out;
}

double SettlingTimes::time(int k) {
  if (k == 0) return 0.5 * kFirstClass;
  if (k == kClasses - 1) return std::numeric_limits<double>::infinity();
  return kFirstClass * std::pow(kClassRatio, k - 0.5);
}

const Eigen::VectorXd& SettlingTimes::decay(double settling) const {
  const auto at = std::find(settling_.begin(), settling_.end(), settling);
  if (at == settling_.end()) throw std::logic_error("a time constant that is none of the options");
  return decay_[static_cast<std::size_t>(at - settling_.begin())];
}

double NoiseModel::deviation() const {
  const auto [k1, k2] = reflections(*this);
  return std::sqrt(variance / ((1.0 - k1 * k1) * (1.0 - k2 * k2)) + offset_variance);
}

Eigen::VectorXd NoiseModel::scale_of(const NoiseRows& rows) const {
  if (transient == 1.0 || rows.since_change == nullptr) return {};
  return 1.0 + (transient - 1.0) * rows.since_change->decay(settling).array();
}

double NoiseModel::log_prior() const {
  double sum = 0.0;
  for (const double k : block_scale)
    sum -= 0.5 * block_freedom * (2.0 * std::log(k) + 1.0 / (k * k) - 1.0);
  return sum;
}

NoiseModel NoiseModel::white_of(const Eigen::Ref<const Eigen::VectorXd>& values,
                                const NoiseRows& rows, const NoiseOptions& options) {
  const auto white = [](const Eigen::Ref<const Eigen::VectorXd>& of) {
    NoiseModel m;
    m.variance = std::max(of.squaredNorm() / static_cast<double>(of.size()), 1e-300);
    return m;
  };
  return with_block_scales(white(values), values, rows.blocks, options, white);
}

NoiseModel NoiseModel::settling_of(const Eigen::Ref<const Eigen::VectorXd>& values,
                                   const NoiseRows& rows, const NoiseOptions& options) {
  NoiseModel m;
  estimate_settling(values, rows, options, m);
  return m;
}

NoiseModel NoiseModel::estimate(const Eigen::Ref<const Eigen::VectorXd>& residual,
                                const NoiseRows& rows, bool offsets, const NoiseOptions& options) {
  const NoiseModel settling = settling_of(residual, rows, options);
  const Eigen::VectorXd scale = settling.scale_of(rows);
  const Eigen::VectorXd even =
      scale.size() > 0 ? residual.cwiseQuotient(scale).eval() : Eigen::VectorXd(residual);
  const auto evenly = [&](const Eigen::Ref<const Eigen::VectorXd>& of) {
    return estimate_evenly(of, rows.blocks, offsets, options);
  };
  NoiseModel m = with_block_scales(evenly(even), even, rows.blocks, options, evenly);
  m.transient = settling.transient;
  m.settling = settling.settling;
  return m;
}

double NoiseModel::log_likelihood(const Eigen::Ref<const Eigen::VectorXd>& residual,
                                  const NoiseRows& rows) const {
  Eigen::MatrixXd r = residual;
  const double log_determinant = whiten(rows, r);
  const auto n = static_cast<double>(r.size());
  return log_determinant - 0.5 * n * std::log(std::max(r.squaredNorm() / n, 1e-300));
}

NoiseModel NoiseModel::scaled_to(const Eigen::Ref<const Eigen::VectorXd>& residual,
                                 const NoiseRows& rows) const {
  NoiseModel m = *this;
  Eigen::MatrixXd r = residual;
  m.whiten(rows, r);
  const double scale = std::max(r.squaredNorm() / static_cast<double>(r.size()), 1e-300) / variance;
  m.variance *= scale;
  m.offset_variance *= scale;
  return m;
}

double NoiseModel::whiten(const NoiseRows& rows, Eigen::Ref<Eigen::MatrixXd> columns) const {
  const Eigen::VectorXd scale = scale_of(rows);
  if (scale.size() > 0) columns.array().colwise() *= scale.array().inverse().eval();
  const bool by_block = !block_scale.empty() && block_scale.size() == rows.blocks.size();
  for (std::size_t b = 0; by_block && b < block_scale.size(); ++b)
    columns.middleRows(rows.blocks[b].first, rows.blocks[b].last - rows.blocks[b].first) /=
        block_scale[b];
  const Reflection reflection = reflections(*this);
  const double k1 = reflection.k1, k2 = reflection.k2;
  // standard deviations of the first two samples in units of the innovation's
  const double s1 = 1.0 / std::sqrt(1.0 - k2 * k2);
  const double s0 = s1 / std::sqrt(1.0 - k1 * k1);
  const double ratio = offset_variance / variance;
  double log_determinant = 0.0;
  if (scale.size() > 0) log_determinant -= sum_of_logs(scale);
  if (by_block) log_determinant += log_prior();
  for (std::size_t b = 0; by_block && b < block_scale.size(); ++b)
    log_determinant -=
        static_cast<double>(rows.blocks[b].last - rows.blocks[b].first) * std::log(block_scale[b]);
  Eigen::VectorXd one, before;
  for (const auto& [first, last] : rows.blocks) {
    const Eigen::Index n = last - first;
    if (n <= 0) continue;
    log_determinant -= std::log(s0) + (n > 1 ? std::log(s1) : 0.0);
    const auto whiten_one = [&](auto&& x) {
      if (n > 2) {
        before = x;
        x.tail(n - 2) -= phi1 * before.segment(1, n - 2) + phi2 * before.head(n - 2);
      }
      if (n > 1) x[1] = (x[1] - k1 * x[0]) / s1;
      x[0] /= s0;
    };
    for (Eigen::Index c = 0; c < columns.cols(); ++c) whiten_one(columns.col(c).segment(first, n));
    if (ratio > 0.0) {
      one.setOnes(n);
      whiten_one(one.head(n));
      const double s = one.squaredNorm();
      const double root = std::sqrt(1.0 + ratio * s);
      const double kappa = (1.0 - 1.0 / root) / s;
      for (Eigen::Index c = 0; c < columns.cols(); ++c) {
        auto x = columns.col(c).segment(first, n);
        x -= kappa * one.dot(x) * one;
      }
      log_determinant -= std::log(root);
    }
  }
  return log_determinant;
}

}  // namespace sparflow
