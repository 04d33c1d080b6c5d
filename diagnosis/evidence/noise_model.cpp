#include "diagnosis/evidence/noise_model.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

double NoiseModel::deviation() const {
  const auto [k1, k2] = reflections(*this);
  return std::sqrt(variance / ((1.0 - k1 * k1) * (1.0 - k2 * k2)) + offset_variance);
}

NoiseModel NoiseModel::estimate(const Eigen::Ref<const Eigen::VectorXd>& residual,
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
    const double g0 = c0 / n0, g1 = n1 > 0 ? c1 / n1 : 0.0, g2 = n2 > 0 ? c2 / n2 : 0.0;
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

double NoiseModel::log_likelihood(const Eigen::Ref<const Eigen::VectorXd>& residual,
                                  const std::vector<NoiseBlock>& blocks) const {
  Eigen::MatrixXd r = residual;
  const double log_determinant = whiten(blocks, r);
  const auto n = static_cast<double>(r.size());
  return log_determinant - 0.5 * n * std::log(std::max(r.squaredNorm() / n, 1e-300));
}

NoiseModel NoiseModel::scaled_to(const Eigen::Ref<const Eigen::VectorXd>& residual,
                                 const std::vector<NoiseBlock>& blocks) const {
  NoiseModel m = *this;
  Eigen::MatrixXd r = residual;
  m.whiten(blocks, r);
  const double scale = std::max(r.squaredNorm() / static_cast<double>(r.size()), 1e-300) / variance;
  m.variance *= scale;
  m.offset_variance *= scale;
  return m;
}

double NoiseModel::whiten(const std::vector<NoiseBlock>& blocks,
                          Eigen::Ref<Eigen::MatrixXd> columns) const {
  const Reflection reflection = reflections(*this);
  const double k1 = reflection.k1, k2 = reflection.k2;
  // standard deviations of the first two samples in units of the innovation's
  const double s1 = 1.0 / std::sqrt(1.0 - k2 * k2);
  const double s0 = s1 / std::sqrt(1.0 - k1 * k1);
  const double ratio = offset_variance / variance;
  double log_determinant = 0.0;
  Eigen::VectorXd one;
  for (const auto& [first, last] : blocks) {
    const Eigen::Index n = last - first;
    if (n <= 0) continue;
    log_determinant -= std::log(s0) + (n > 1 ? std::log(s1) : 0.0);
    const auto whiten_one = [&](auto&& x) {
      for (Eigen::Index t = n - 1; t >= 2; --t) x[t] -= phi1 * x[t - 1] + phi2 * x[t - 2];
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
