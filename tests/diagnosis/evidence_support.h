#pragma once
/// Evidence made by hand: a series in blocks with noise of a known model and columns that are plain matrices, so that a
/// dense computation on small matrices gives the right answer.
#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "diagnosis/regression/effect_fit.h"

namespace sparflow::testing_support {

inline std::vector<NoiseBlock> blocks_of(const std::vector<Eigen::Index>& lengths) {
  std::vector<NoiseBlock> blocks;
  Eigen::Index at = 0;
  for (const Eigen::Index n : lengths) {
    blocks.push_back({at, at + n});
    at += n;
  }
  return blocks;
}

inline Eigen::Index rows_of(const std::vector<NoiseBlock>& blocks) {
  return blocks.empty() ? 0 : blocks.back().last;
}

inline Eigen::VectorXd white(Eigen::Index n, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd e(n);
  for (double& v : e) v = normal(random);
  return e;
}

/// A draw of the noise: each block is stationary (after 200 discarded values) and has an offset of its own.
/// @param offsets the drawn ones [blocks], may be null
inline Eigen::VectorXd draw(const NoiseModel& m, const std::vector<NoiseBlock>& blocks,
                            std::mt19937_64& random, Eigen::VectorXd* offsets = nullptr) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd y(rows_of(blocks));
  if (offsets != nullptr) offsets->resize(static_cast<Eigen::Index>(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const double offset = std::sqrt(m.offset_variance) * normal(random);
    if (offsets != nullptr) (*offsets)[static_cast<Eigen::Index>(b)] = offset;
    double before = 0.0, before2 = 0.0;
    for (Eigen::Index t = blocks[b].first - 200; t < blocks[b].last; ++t) {
      const double next =
          m.phi1 * before + m.phi2 * before2 + std::sqrt(m.variance) * normal(random);
      before2 = before;
      before = next;
      if (t >= blocks[b].first) y[t] = next + offset;
    }
  }
  return y;
}

/// [rows x rows] covariance of the series from its definition: the Yule-Walker equations for the autoregression, a
/// constant inside a block for its offset.
inline Eigen::MatrixXd dense_covariance(const NoiseModel& m,
                                        const std::vector<NoiseBlock>& blocks) {
  const Eigen::Index n = rows_of(blocks);
  Eigen::VectorXd gamma(std::max<Eigen::Index>(n, 3));
  gamma[0] = m.variance * (1.0 - m.phi2) /
             ((1.0 + m.phi2) * ((1.0 - m.phi2) * (1.0 - m.phi2) - m.phi1 * m.phi1));
  gamma[1] = gamma[0] * m.phi1 / (1.0 - m.phi2);
  for (Eigen::Index k = 2; k < gamma.size(); ++k)
    gamma[k] = m.phi1 * gamma[k - 1] + m.phi2 * gamma[k - 2];
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (const NoiseBlock& b : blocks) {
    for (Eigen::Index i = b.first; i < b.last; ++i) {
      for (Eigen::Index j = b.first; j < b.last; ++j)
        covariance(i, j) = gamma[std::abs(i - j)] + m.offset_variance;
    }
  }
  return covariance;
}

/// An evidence channel that belongs to no machine.
inline EvidenceChannel plain_channel(const std::vector<NoiseBlock>& blocks,
                                     const Eigen::VectorXd& y,
                                     const Eigen::MatrixXd& baseline = {}) {
  EvidenceChannel c;
  c.blocks = blocks;
  c.log.assign(blocks.size(), 0);
  c.y = y;
  c.baseline = baseline.size() > 0 ? baseline : Eigen::MatrixXd(y.size(), 0);
  return c;
}

/// An effect given by its signature in each channel, with wide bounds.
inline EffectDesign plain_design(std::vector<Eigen::MatrixXd> columns, double lower = -1e9,
                                 double upper = 1e9) {
  EffectDesign d;
  for (const Eigen::MatrixXd& c : columns)
    d.linear = std::max(d.linear, static_cast<int>(c.cols()));
  d.columns = std::move(columns);
  d.lower.assign(static_cast<std::size_t>(d.linear), lower);
  d.upper.assign(static_cast<std::size_t>(d.linear), upper);
  return d;
}

/// A regressor as motions make them: slow, and different in each block.
inline Eigen::VectorXd slow_column(const std::vector<NoiseBlock>& blocks, std::mt19937_64& random) {
  NoiseModel slow;
  slow.phi1 = 0.95;
  slow.variance = 1.0 - 0.95 * 0.95;
  slow.offset_variance = 0.5;
  return draw(slow, blocks, random);
}

}  // namespace sparflow::testing_support
