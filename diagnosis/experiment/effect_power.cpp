#include "diagnosis/experiment/effect_power.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Upper tail of the central chi-square, by its closed recursion over the degrees of freedom.
double central_tail(double x, int freedom) {
  if (x <= 0.0) return 1.0;
  const bool even = freedom % 2 == 0;
  double tail = even ? std::exp(-0.5 * x) : std::erfc(std::sqrt(0.5 * x));
  // term that every two further degrees of freedom add
  double term = even ? std::exp(-0.5 * x) * 0.5 * x
                     : std::exp(-0.5 * x) * std::sqrt(2.0 * x / std::numbers::pi);
  for (int k = even ? 2 : 1; k < freedom; k += 2) {
    tail += term;
    term *= x / static_cast<double>(k + 2);
  }
  return std::min(1.0, tail);
}

/// min 1/2 b'Nb - g'b inside the design's bounds, by coordinate descent scaled by each parameter's curvature.
VectorXd inside_bounds(const MatrixXd& n, const VectorXd& g, const EffectDesign& design) {
  const VectorXd scale = n.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  MatrixXd h = scale.asDiagonal() * n * scale.asDiagonal();
  h.diagonal().array() += 1e-9;  // only matters where the data do not determine b
  const VectorXd gs = scale.cwiseProduct(g);
  VectorXd b = solve_symmetric(h, gs), lower(g.size()), upper(g.size());
  for (Index i = 0; i < g.size(); ++i) {
    lower[i] = design.lower[static_cast<std::size_t>(i)] / scale[i];
    upper[i] = design.upper[static_cast<std::size_t>(i)] / scale[i];
  }
  if ((b.array() < lower.array()).any() || (b.array() > upper.array()).any()) {
    b = b.cwiseMax(lower).cwiseMin(upper);
    for (int sweep = 0; sweep < 200; ++sweep) {
      const VectorXd before = b;
      for (Index i = 0; i < g.size(); ++i)
        b[i] = std::clamp(b[i] + (gs[i] - h.row(i).dot(b)) / h(i, i), lower[i], upper[i]);
      if ((b - before).norm() < 1e-9 * (1.0 + b.norm())) break;
    }
  }
  return scale.cwiseProduct(b);
}

}  // namespace

double chance_above(double x, int freedom, double lambda) {
  const double half = 0.5 * lambda;
  if (half > 600.0) {  // far beyond any threshold: normal approximation
    const double mean = freedom + lambda, deviation = std::sqrt(2.0 * (freedom + 2.0 * lambda));
    return 0.5 * std::erfc((x - mean) / deviation / std::numbers::sqrt2);
  }
  double weight = std::exp(-half), sum = 0.0, mass = 0.0;
  for (int j = 0; mass < 1.0 - 1e-12 && j < 4000; ++j) {
    sum += weight * central_tail(x, freedom + 2 * j);
    mass += weight;
    weight *= half / (j + 1.0);
  }
  return std::min(1.0, sum);
}

double noncentrality_for(double nats, double power, int freedom) {
  const double x = 2.0 * nats;
  double lo = 0.0, hi = 4.0 * (x + freedom + 20.0);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lo + hi);
    (chance_above(x, freedom, middle) < power ? lo : hi) = middle;
  }
  return hi;
}

VectorXd draw_noise(const NoiseModel& noise, const NoiseRows& of, Index rows,
                    std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double k2 = noise.phi2, k1 = noise.phi1 / (1.0 - noise.phi2);
  const double innovation = std::sqrt(noise.variance), offset = std::sqrt(noise.offset_variance);
  const double s1 = innovation / std::sqrt(1.0 - k2 * k2), s0 = s1 / std::sqrt(1.0 - k1 * k1);
  VectorXd y = VectorXd::Zero(rows);
  for (const auto& [first, last] : of.blocks) {
    for (Index t = first; t < last; ++t) {
      if (t == first) {
        y[t] = s0 * normal(random);
      } else if (t == first + 1) {
        y[t] = k1 * y[t - 1] + s1 * normal(random);
      } else {
        y[t] = noise.phi1 * y[t - 1] + noise.phi2 * y[t - 2] + innovation * normal(random);
      }
    }
    y.segment(first, last - first).array() += offset * normal(random);
  }
  const VectorXd scale = noise.scale_of(of);
  return scale.size() > 0 ? VectorXd(y.cwiseProduct(scale)) : y;
}

double Signature::squares() const {
  double sum = 0.0;
  for (const VectorXd& w : white) sum += w.squaredNorm();
  return sum;
}

Signature signature(const ProjectedDesign& design, const VectorXd& theta) {
  Signature s;
  for (std::size_t c = 0; c < design.white.size(); ++c) {
    const bool acts = design.white[c].cols() > 0;
    s.white.push_back(acts ? VectorXd(design.white[c] * theta) : VectorXd());
    s.plain.push_back(acts ? VectorXd(design.plain[c] * theta) : VectorXd());
  }
  return s;
}

Signature left_by(const Signature& effect, const ProjectedDesign& rival) {
  const auto m = static_cast<Index>(rival.design->linear);
  VectorXd g = VectorXd::Zero(m);
  for (std::size_t c = 0; c < rival.white.size(); ++c) {
    if (rival.white[c].cols() > 0 && effect.white[c].size() > 0)
      g += rival.white[c].transpose() * effect.white[c];
  }
  const VectorXd b = inside_bounds(rival.gram, g, *rival.design);
  Signature left = effect;
  for (std::size_t c = 0; c < rival.white.size(); ++c) {
    if (rival.white[c].cols() == 0 || left.white[c].size() == 0) continue;
    left.white[c] -= rival.white[c] * b;
    left.plain[c] -= rival.plain[c] * b;
  }
  return left;
}

PowerStudy::PowerStudy(const Evidence& evidence, const EffectFit& fit, unsigned seed,
                       const PowerOptions& options)
    : evidence_(evidence), noise_(fit.noise) {
  std::mt19937_64 random(seed);
  for (int d = 0; d < options.draws; ++d) {
    drawn_.emplace_back();
    drawn_likelihood_.emplace_back();
    for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
      const EvidenceChannel& channel = evidence.channels[c];
      drawn_.back().push_back(draw_noise(noise_[c], channel.noise_rows(), channel.rows(), random));
      drawn_likelihood_.back().push_back(log_likelihood(c, drawn_.back().back()));
    }
  }
}

ProjectedDesign PowerStudy::project(const EffectDesign& design) const {
  ProjectedDesign p;
  p.design = &design;
  p.white.resize(evidence_.channels.size());
  p.plain.resize(evidence_.channels.size());
  p.gram = MatrixXd::Zero(design.linear, design.linear);
  for (std::size_t c = 0; c < evidence_.channels.size(); ++c) {
    if (!design.touches(c)) continue;
    const EvidenceChannel& channel = evidence_.channels[c];
    MatrixXd coefficients;
    const Index m = design.columns[c].cols();
    p.white[c] =
        whitened_rows(channel, noise_[c], design.columns[c], nullptr, &coefficients).leftCols(m) /
        std::sqrt(noise_[c].variance);
    p.gram += transposed_product(p.white[c], p.white[c]);
    p.plain[c] = design.columns[c];
    if (coefficients.rows() > 0) p.plain[c] -= product(channel.baseline, coefficients.leftCols(m));
  }
  return p;
}

double PowerStudy::log_likelihood(std::size_t channel, const VectorXd& residual) const {
  const NoiseRows rows = evidence_.channels[channel].noise_rows();
  const NoiseModel noise = NoiseModel::estimate(residual, rows, true, evidence_.options.noise);
  MatrixXd white = residual;
  const double determinant = noise.whiten(rows, white);
  const auto n = static_cast<double>(residual.size());
  const double variance = std::max(white.squaredNorm() / n, 1e-300);
  return determinant - 0.5 * n * (std::log(2.0 * std::numbers::pi * variance) + 1.0);
}

double PowerStudy::gain(const Signature& s, double times) const {
  double sum = 0.0;
  for (std::size_t c = 0; c < s.plain.size(); ++c) {
    if (s.plain[c].size() == 0) continue;
    for (std::size_t d = 0; d < drawn_.size(); ++d) {
      const VectorXd& r = drawn_[d][c];
      sum += drawn_likelihood_[d][c] - 0.5 * (log_likelihood(c, r + times * s.plain[c]) +
                                              log_likelihood(c, r - times * s.plain[c]));
    }
  }
  return std::max(0.0, sum / static_cast<double>(drawn_.size()));
}

}  // namespace sparflow
