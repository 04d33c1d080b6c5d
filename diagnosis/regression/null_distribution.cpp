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

/// The simulated residuals of all channels, whitened and orthogonal to the accepted effects.
class NullSimulation {
 public:
  /// @param null must outlive this  @param count simulations of either kind
  NullSimulation(const NullModel& null, int count, std::mt19937_64& random);

  /// Gains of a design on normal innovations, then on flipped residuals. [2 x simulations, nats]
  VectorXd gains(const EffectDesign& design) const;

 private:
  std::size_t channels() const { return null_.evidence.channels.size(); }
  /// Fills in the span of the accepted effects and the residual beside it.
  void project_accepted(std::size_t c);
  /// Whitened columns of a design, orthogonal to the accepted effects, for innovations of unit variance.
  MatrixXd own_columns(const EffectDesign& design, std::size_t c) const;
  /// [rows] residual of the accepted effects for innovations of unit variance
  VectorXd unit_residual(std::size_t c) const {
    return residual_[c] / std::sqrt(null_.fit.noise[c].variance);
  }

  const NullModel& null_;
  int count_;
  std::vector<MatrixXd> noise_;     // [channels]: [rows x simulations] normal innovations
  std::vector<MatrixXd> signs_;     // [channels]: [blocks x simulations] -1 or 1
  std::vector<MatrixXd> accepted_;  // [channels] orthonormal basis of the accepted effects' columns
  std::vector<VectorXd> residual_;  // [channels]
};

NullSimulation::NullSimulation(const NullModel& null, int count, std::mt19937_64& random)
    : null_(null),
      count_(count),
      noise_(null.evidence.channels.size()),
      signs_(null.evidence.channels.size()),
      accepted_(null.evidence.channels.size()),
      residual_(null.evidence.channels.size()) {
  std::normal_distribution<double> normal;
  for (std::size_t c = 0; c < channels(); ++c) {
    project_accepted(c);
    const EvidenceChannel& channel = null.evidence.channels[c];
    noise_[c].resize(channel.rows(), count);
    for (Index i = 0; i < noise_[c].size(); ++i) noise_[c].data()[i] = normal(random);
    signs_[c].resize(static_cast<Index>(channel.blocks.size()), count);
    for (Index i = 0; i < signs_[c].size(); ++i)
      signs_[c].data()[i] = (random() & 1U) != 0U ? 1.0 : -1.0;
  }
}

void NullSimulation::project_accepted(std::size_t c) {
  const EvidenceChannel& channel = null_.evidence.channels[c];
  const MatrixXd columns = columns_of(null_.accepted, c, channel.rows());
  const Index width = columns.cols();
  const MatrixXd rows = whitened_rows(channel, null_.fit.noise[c], columns);
  accepted_[c] = rows.leftCols(width);
  VectorXd r = rows.col(width);
  if (width > 0) {  // orthonormal, so that a projection is one product
    accepted_[c] = span_of(accepted_[c]);
    r -= accepted_[c] * (accepted_[c].transpose() * r);
  }
  residual_[c] = std::move(r);
}

MatrixXd NullSimulation::own_columns(const EffectDesign& design, std::size_t c) const {
  MatrixXd x = whitened_rows(null_.evidence.channels[c], null_.fit.noise[c], design.columns[c])
                   .leftCols(design.linear);
  if (accepted_[c].cols() > 0) {
    const VectorXd whole = x.colwise().squaredNorm();
    x -= product(accepted_[c], transposed_product(accepted_[c], x));
    for (Index i = 0; i < x.cols();
         ++i) {  // in the span of accepted effects: only rounding is left
      if (x.col(i).squaredNorm() < 1e-16 * whole[i]) x.col(i).setZero();
    }
  }
  x /= std::sqrt(null_.fit.noise[c].variance);
  return x;
}

VectorXd NullSimulation::gains(const EffectDesign& design) const {
  const Index m = design.linear;
  MatrixXd n = MatrixXd::Zero(m, m), z = MatrixXd::Zero(m, 2 * count_);
  VectorXd g = VectorXd::Zero(m);
  std::vector<MatrixXd> columns(channels());
  for (std::size_t c = 0; c < channels(); ++c) {
    if (!design.touches(c)) continue;
    MatrixXd x = own_columns(design, c);
    n += transposed_product(x, x);
    z.leftCols(count_) += transposed_product(x, noise_[c]);
    g += x.transpose() * residual_[c] / std::sqrt(null_.fit.noise[c].variance);
    columns[c] = std::move(x);
  }
  const VectorXd scale = n.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  n = scale.asDiagonal() * n * scale.asDiagonal();
  n.diagonal().array() += 1e-9;
  const VectorXd own = scale.cwiseProduct(solve_symmetric(n, scale.cwiseProduct(g)));
  for (std::size_t c = 0; c < channels(); ++c) {
    if (columns[c].cols() == 0) continue;
    z.rightCols(count_) += flipped_scores(columns[c], unit_residual(c), own,
                                          null_.evidence.channels[c].blocks, signs_[c]);
  }
  z = scale.asDiagonal() * z;
  return 0.5 * z.cwiseProduct(solve_symmetric_columns(n, z)).colwise().sum().transpose();
}

/// Ratio of the gains on flipped residuals to those on normal innovations, at least one.
/// @param gains [2 x simulations] normal, then flipped
double scale_of(const VectorXd& gains, const RegressionOptions& options) {
  const Index half = gains.size() / 2;
  const double usual = value_at(gains.head(half), options.scale_quantile);
  if (!(usual > 0.0)) return 1.0;
  return std::max(1.0, value_at(gains.tail(half), options.scale_quantile) / usual);
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

NullDistribution simulate_null_distribution(const NullModel& null,
                                            const std::vector<NullCandidate>& candidates,
                                            int simulations, std::mt19937_64& random,
                                            const RegressionOptions& options) {
  const NullSimulation simulation(null, simulations, random);
  NullDistribution out;
  VectorXd largest = VectorXd::Constant(2 * simulations, -1e300);
  for (const NullCandidate& candidate : candidates) {
    VectorXd best = VectorXd::Constant(2 * simulations, -1e300);
    for (const EffectDesign& d : *candidate.designs) {
      const double besides = d.optional ? candidate.optional_penalty : 0.0;
      best = best.cwiseMax((simulation.gains(d).array() - besides).matrix());
    }
    const double scale = scale_of(best, options);
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
