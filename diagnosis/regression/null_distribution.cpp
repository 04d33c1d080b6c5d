#include "diagnosis/regression/null_distribution.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"
#include "models/math/parallel.h"

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

/// Random innovations and signs, see NullSimulator.
struct RandomRows {
  const std::vector<Eigen::MatrixXf>& noise;
  const std::vector<MatrixXd>& signs;
  int count = 0;
};

/// x^T noise, a few rows at a time, so that the noise never stands in memory as doubles.
MatrixXd noise_product(const MatrixXd& x, const Eigen::MatrixXf& noise) {
  constexpr Index kRows = 1024;  // 2.5 MB of doubles for 300 simulations
  MatrixXd z = MatrixXd::Zero(x.cols(), noise.cols());
  for (Index first = 0; first < x.rows(); first += kRows) {
    const Index rows = std::min(kRows, x.rows() - first);
    z +=
        transposed_product(x.middleRows(first, rows), noise.middleRows(first, rows).cast<double>());
  }
  return z;
}

/// The simulated residuals of all channels, whitened and orthogonal to the accepted effects.
class NullSimulation {
 public:
  /// Both must outlive this.
  NullSimulation(const NullModel& null, const RandomRows& random);

  /// Gains of each design on normal innovations, then on flipped residuals. [2 x simulations, nats]
  std::vector<VectorXd> gains(const std::vector<EffectDesign>& designs) const;

 private:
  std::size_t channels() const { return null_.evidence.channels.size(); }
  /// Fills in the span of the accepted effects and the residual beside it.
  void project_accepted(std::size_t c);
  /// What the gains of a design are made of, summed over channels.
  struct Sums {
    MatrixXd normal;            // [linear x linear] normal equations
    MatrixXd z;                 // [linear x 2 simulations] right sides
    VectorXd g;                 // [linear] right side of the residual itself
    std::vector<MatrixXd> own;  // [channels] own_columns
  };
  /// Whitened columns, orthogonal to the accepted effects, for innovations of unit variance.
  MatrixXd own_columns(const MatrixXd& columns, std::size_t c) const;
  /// Adds a channel to the sums of all designs; their columns are whitened and multiplied side by side.
  void add_channel(const std::vector<EffectDesign>& designs, std::size_t c,
                   std::vector<Sums>& sums) const;
  VectorXd gains_of(const EffectDesign& design, Sums& sums) const;
  /// [rows] residual of the accepted effects for innovations of unit variance
  VectorXd unit_residual(std::size_t c) const {
    return residual_[c] / std::sqrt(null_.fit.noise[c].variance);
  }

  const NullModel& null_;
  const RandomRows& random_;
  WhitenedChannels white_;
  std::vector<MatrixXd> accepted_;  // [channels] orthonormal basis of the accepted effects' columns
  std::vector<VectorXd> residual_;  // [channels]
};

NullSimulation::NullSimulation(const NullModel& null, const RandomRows& random)
    : null_(null),
      random_(random),
      white_(WhitenedChannels::by(null.evidence, null.fit.noise)),
      accepted_(null.evidence.channels.size()),
      residual_(null.evidence.channels.size()) {
  for (std::size_t c = 0; c < channels(); ++c) project_accepted(c);
}

void NullSimulation::project_accepted(std::size_t c) {
  const EvidenceChannel& channel = null_.evidence.channels[c];
  const MatrixXd columns = columns_of(null_.accepted, c, channel.rows());
  const Index width = columns.cols();
  const MatrixXd rows = white_.baseline[c].rows(columns);
  accepted_[c] = rows.leftCols(width);
  VectorXd r = rows.col(width);
  if (width > 0) {  // orthonormal, so that a projection is one product
    accepted_[c] = span_of(accepted_[c]);
    r -= accepted_[c] * (accepted_[c].transpose() * r);
  }
  residual_[c] = std::move(r);
}

MatrixXd NullSimulation::own_columns(const MatrixXd& columns, std::size_t c) const {
  MatrixXd x = white_.baseline[c].rows(columns).leftCols(columns.cols());
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

void NullSimulation::add_channel(const std::vector<EffectDesign>& designs, std::size_t c,
                                 std::vector<Sums>& sums) const {
  std::vector<const EffectDesign*> all;
  all.reserve(designs.size());
  for (const EffectDesign& d : designs) all.push_back(&d);
  const MatrixXd columns = columns_of(all, c, null_.evidence.channels[c].rows());
  if (columns.cols() == 0) return;
  const MatrixXd x = own_columns(columns, c);
  const MatrixXd z = noise_product(x, random_.noise[c]);
  const VectorXd g = x.transpose() * residual_[c] / std::sqrt(null_.fit.noise[c].variance);
  Index at = 0;
  for (std::size_t d = 0; d < designs.size(); ++d) {
    const Index m = designs[d].columns[c].cols();
    if (m == 0) continue;
    sums[d].own[c] = x.middleCols(at, m);
    sums[d].normal += transposed_product(sums[d].own[c], sums[d].own[c]);
    sums[d].z.leftCols(random_.count) += z.middleRows(at, m);
    sums[d].g += g.segment(at, m);
    at += m;
  }
}

VectorXd NullSimulation::gains_of(const EffectDesign& design, Sums& sums) const {
  MatrixXd n = std::move(sums.normal);
  const VectorXd scale = n.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  n = scale.asDiagonal() * n * scale.asDiagonal();
  n.diagonal().array() += 1e-9;
  const VectorXd own = scale.cwiseProduct(solve_symmetric(n, scale.cwiseProduct(sums.g)));
  for (std::size_t c = 0; c < channels(); ++c) {
    if (!design.touches(c)) continue;
    sums.z.rightCols(random_.count) += flipped_scores(
        sums.own[c], unit_residual(c), own, null_.evidence.channels[c].blocks, random_.signs[c]);
  }
  const MatrixXd z = scale.asDiagonal() * sums.z;
  return 0.5 * z.cwiseProduct(solve_symmetric_columns(n, z)).colwise().sum().transpose();
}

std::vector<VectorXd> NullSimulation::gains(const std::vector<EffectDesign>& designs) const {
  std::vector<Sums> sums;
  sums.reserve(designs.size());
  for (const EffectDesign& d : designs)
    sums.push_back({MatrixXd::Zero(d.linear, d.linear), MatrixXd::Zero(d.linear, 2 * random_.count),
                    VectorXd::Zero(d.linear), std::vector<MatrixXd>(channels())});
  for (std::size_t c = 0; c < channels(); ++c) add_channel(designs, c, sums);
  std::vector<VectorXd> out;
  out.reserve(designs.size());
  for (std::size_t d = 0; d < designs.size(); ++d) out.push_back(gains_of(designs[d], sums[d]));
  return out;
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

NullSimulator::NullSimulator(const Evidence& evidence, int simulations, std::mt19937_64& random)
    : count_(simulations) {
  std::normal_distribution<double> normal;
  for (const EvidenceChannel& channel : evidence.channels) {
    Eigen::MatrixXf& noise = noise_.emplace_back(channel.rows(), simulations);
    for (Index i = 0; i < noise.size(); ++i) noise.data()[i] = static_cast<float>(normal(random));
    MatrixXd& signs = signs_.emplace_back(static_cast<Index>(channel.blocks.size()), simulations);
    for (Index i = 0; i < signs.size(); ++i) signs.data()[i] = (random() & 1U) != 0U ? 1.0 : -1.0;
  }
}

NullDistribution NullSimulator::distribution(const NullModel& null,
                                             const std::vector<NullCandidate>& candidates,
                                             const RegressionOptions& options,
                                             const std::vector<bool>& unchanged) {
  const RandomRows random{noise_, signs_, count_};
  const NullSimulation simulation(null, random);
  best_.resize(candidates.size());
  parallel(candidates.size(), [&](std::size_t k) {
    if (!unchanged.empty() && unchanged[k] && best_[k].size() > 0) return;
    best_[k] = VectorXd::Constant(2 * count_, -1e300);
    const std::vector<EffectDesign>& designs = *candidates[k].designs;
    const std::vector<VectorXd> gains = simulation.gains(designs);
    for (std::size_t d = 0; d < designs.size(); ++d) {
      const double besides = (designs[d].optional ? candidates[k].optional_penalty : 0.0) +
                             candidates[k].optional_shape_penalty * optional_shapes(designs[d]);
      best_[k] = best_[k].cwiseMax((gains[d].array() - besides).matrix());
    }
  });
  NullDistribution out;
  VectorXd largest = VectorXd::Constant(2 * count_, -1e300);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    VectorXd best = best_[k];
    const double scale = scale_of(best, options);
    out.scale.push_back(scale);
    out.penalty.push_back(candidates[k].penalty);
    best.tail(count_) /= scale;
    largest = largest.cwiseMax((best.array() - candidates[k].penalty).matrix());
  }
  out.normal.assign(largest.begin(), largest.begin() + count_);
  out.flipped.assign(largest.begin() + count_, largest.end());
  std::sort(out.normal.begin(), out.normal.end());
  std::sort(out.flipped.begin(), out.flipped.end());
  return out;
}

NullDistribution simulate_null_distribution(const NullModel& null,
                                            const std::vector<NullCandidate>& candidates,
                                            int simulations, std::mt19937_64& random,
                                            const RegressionOptions& options) {
  return NullSimulator(null.evidence, simulations, random).distribution(null, candidates, options);
}

}  // namespace sparflow
