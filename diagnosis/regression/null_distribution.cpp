#include "diagnosis/regression/null_distribution.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double p_of(const std::vector<double>& sorted, double gain) {
  const auto above = sorted.end() - std::lower_bound(sorted.begin(), sorted.end(), gain);
  return (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(sorted.size()));
}

/// The value below which a share `level` of `v` lies, without interpolation.
double value_at(VectorXd v, double level) {
  const auto at = v.data() + static_cast<Index>(level * static_cast<double>(v.size()));
  std::nth_element(v.data(), at, v.data() + v.size());
  return *at;
}

/// Products of a candidate's columns with its own residual in units of that residual's standard deviation, with random
/// signs of whole blocks. The part that the candidate explains is subtracted first: an effect of a few motions (a
/// cushion, a limit) would otherwise compete with itself after a change of sign.
MatrixXd flipped_scores(const MatrixXd& x, const VectorXd& residual, const VectorXd& own,
                        const std::vector<NoiseBlock>& blocks, const MatrixXd& signs) {
  const VectorXd left = residual - x * own;
  MatrixXd by_block(x.cols(), static_cast<Index>(blocks.size()));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Index first = blocks[b].first, length = blocks[b].last - first;
    by_block.col(static_cast<Index>(b)) =
        x.middleRows(first, length).transpose() * left.segment(first, length);
  }
  const double variance = left.squaredNorm() / static_cast<double>(left.size());
  return product(by_block, signs) / std::sqrt(std::max(variance, 1e-300));
}

}  // namespace

double NullDistribution::threshold(double level) const {
  const auto quantile = [&](const std::vector<double>& v) {
    return v.empty()
               ? 0.0
               : v[static_cast<std::size_t>((1.0 - level) * static_cast<double>(v.size() - 1))];
  };
  return std::max(quantile(normal), quantile(flipped));
}

double NullDistribution::p_value(double gain, std::size_t candidate) const {
  const double scaled = (gain + penalty[candidate]) / scale[candidate] - penalty[candidate];
  return std::max(p_of(normal, scaled), p_of(flipped, scaled));
}

NullDistribution simulate_null_distribution(const Evidence& evidence,
                                            const std::vector<NullCandidate>& candidates,
                                            const std::vector<const EffectDesign*>& accepted,
                                            const EffectFit& fit, int simulations,
                                            std::mt19937_64& random,
                                            const RegressionOptions& options) {
  const std::size_t channels = evidence.channels.size();
  std::vector<MatrixXd> noise(channels), signs(channels), fixed(channels);
  std::vector<VectorXd> residual(channels);
  std::normal_distribution<double> normal;
  for (std::size_t c = 0; c < channels; ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    Index width = 0;
    for (const EffectDesign* d : accepted) width += d->columns[c].cols();
    MatrixXd columns(channel.rows(), width);
    Index at = 0;
    for (const EffectDesign* d : accepted) {
      const Index w = d->columns[c].cols();
      if (w > 0) columns.middleCols(at, w) = d->columns[c];
      at += w;
    }
    const MatrixXd rows = whitened_rows(channel, fit.noise[c], columns);
    fixed[c] = rows.leftCols(width);
    VectorXd r = rows.col(width);
    if (width > 0) {  // orthonormal, so that a projection is one product
      fixed[c] = span_of(fixed[c]);
      r -= fixed[c] * (fixed[c].transpose() * r);
    }
    residual[c] = std::move(r);
    noise[c].resize(channel.rows(), simulations);
    for (Index i = 0; i < noise[c].size(); ++i) noise[c].data()[i] = normal(random);
    signs[c].resize(static_cast<Index>(channel.blocks.size()), simulations);
    for (Index i = 0; i < signs[c].size(); ++i)
      signs[c].data()[i] = (random() & 1U) != 0U ? 1.0 : -1.0;
  }
  NullDistribution out;
  VectorXd largest = VectorXd::Constant(2 * simulations, -1e300);
  for (const NullCandidate& candidate : candidates) {
    VectorXd best = VectorXd::Constant(2 * simulations, -1e300);
    for (const EffectDesign& d : *candidate.designs) {
      MatrixXd n = MatrixXd::Zero(d.linear, d.linear),
               z = MatrixXd::Zero(d.linear, 2 * simulations);
      VectorXd g = VectorXd::Zero(d.linear);
      std::vector<MatrixXd> columns(channels);
      for (std::size_t c = 0; c < channels; ++c) {
        if (!d.touches(c)) continue;
        MatrixXd x =
            whitened_rows(evidence.channels[c], fit.noise[c], d.columns[c]).leftCols(d.linear);
        if (fixed[c].cols() > 0) {
          const VectorXd whole = x.colwise().squaredNorm();
          x -= product(fixed[c], transposed_product(fixed[c], x));
          for (Index i = 0; i < x.cols();
               ++i) {  // in the span of accepted effects: only rounding is left
            if (x.col(i).squaredNorm() < 1e-16 * whole[i]) x.col(i).setZero();
          }
        }
        x /= std::sqrt(fit.noise[c].variance);
        n += transposed_product(x, x);
        z.leftCols(simulations) += transposed_product(x, noise[c]);
        g += x.transpose() * residual[c] / std::sqrt(fit.noise[c].variance);
        columns[c] = std::move(x);
      }
      const VectorXd scale = n.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
      n = scale.asDiagonal() * n * scale.asDiagonal();
      n.diagonal().array() += 1e-9;
      const VectorXd own = scale.cwiseProduct(solve_symmetric(n, scale.cwiseProduct(g)));
      for (std::size_t c = 0; c < channels; ++c) {
        if (columns[c].cols() == 0) continue;
        z.rightCols(simulations) +=
            flipped_scores(columns[c], residual[c] / std::sqrt(fit.noise[c].variance), own,
                           evidence.channels[c].blocks, signs[c]);
      }
      z = scale.asDiagonal() * z;
      const double besides = d.optional ? candidate.optional_penalty : 0.0;
      const VectorXd gains =
          0.5 * z.cwiseProduct(solve_symmetric_columns(n, z)).colwise().sum().transpose();
      best = best.cwiseMax((gains.array() - besides).matrix());
    }
    const double usual = value_at(best.head(simulations), options.scale_quantile);
    const double scale =
        usual > 0.0
            ? std::max(1.0, value_at(best.tail(simulations), options.scale_quantile) / usual)
            : 1.0;
    out.scale.push_back(scale);
    out.penalty.push_back(candidate.penalty);
    best.tail(simulations) /= scale;
    largest = largest.cwiseMax((best.array() - candidate.penalty).matrix());
  }
  out.normal.assign(largest.begin(), largest.begin() + simulations);
  out.flipped.assign(largest.begin() + simulations, largest.end());
  std::sort(out.normal.begin(), out.normal.end());
  std::sort(out.flipped.begin(), out.flipped.end());
  return out;
}

}  // namespace sparflow
