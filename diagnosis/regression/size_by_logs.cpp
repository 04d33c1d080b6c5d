#include "diagnosis/regression/size_by_logs.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Least share of a signature's squares in the one group of logs that is not that of the other one, below which their sizes cannot be
/// told apart.
/// @threshold [1] 0..1; chosen: far above rounding; standard errors are a thousand times larger there than with a size alone
constexpr double kIndependent = 1e-6;

/// Size and information in one stretch of motion.
struct BlockSize {
  double size, information;
};

/// Variances of the sizes: factor / information + added.
struct Variation {
  double factor = 1.0, added = 0.0;
  double variance(const BlockSize& b) const { return factor / b.information + added; }
};

double weighted_mean(const std::vector<BlockSize>& blocks, const Variation& v, double& weights) {
  double sum = 0.0;
  weights = 0.0;
  for (const BlockSize& b : blocks) {
    const double w = 1.0 / v.variance(b);
    weights += w;
    sum += w * b.size;
  }
  return weights > 0.0 ? sum / weights : 0.0;
}

/// Cochran's Q of one group, its degrees of freedom, and the factor of an added variance in its expectation.
struct Moments {
  double q = 0.0, freedom = 0.0, factor = 0.0;
};

void add_moments(const std::vector<BlockSize>& blocks, Moments& m) {
  if (blocks.size() < 2) return;
  double weights = 0.0, squares = 0.0;
  const double mean = weighted_mean(blocks, {}, weights);
  for (const BlockSize& b : blocks) {
    squares += b.information * b.information;
    m.q += b.information * std::pow(b.size - mean, 2);
  }
  m.freedom += static_cast<double>(blocks.size() - 1);
  m.factor += weights - squares / weights;
}

double log_likelihood(const std::vector<BlockSize>& blocks, const Variation& v) {
  double weights = 0.0, sum = 0.0;
  const double mean = weighted_mean(blocks, v, weights);
  for (const BlockSize& b : blocks)
    sum -= 0.5 * (std::log(v.variance(b)) + std::pow(b.size - mean, 2) / v.variance(b));
  return sum;
}

SizeInLogs size_in_logs(const std::vector<BlockSize>& blocks, const Variation& v) {
  SizeInLogs s;
  s.blocks = static_cast<int>(blocks.size());
  double weights = 0.0;
  s.size = weighted_mean(blocks, v, weights);
  s.standard_error = weights > 0.0 ? 1.0 / std::sqrt(weights) : 0.0;
  return s;
}

}  // namespace

double SizeByLogs::difference() const {
  if (suspects.blocks == 0 || references.blocks == 0) return 0.0;
  return (suspects.size - references.size) /
         std::sqrt(std::pow(suspects.standard_error, 2) + std::pow(references.standard_error, 2) -
                   2.0 * covariance);
}

double SizeByLogs::mean() const {
  double weights = 0.0, sum = 0.0;
  for (const SizeInLogs* s : {&suspects, &references}) {
    if (s->blocks == 0) continue;
    const double w = 1.0 / (s->standard_error * s->standard_error);
    weights += w;
    sum += w * s->size;
  }
  return weights > 0.0 ? sum / std::sqrt(weights) : 0.0;
}

namespace {

/// One channel's rows without what baseline and other effects follow: signature in suspect and in reference logs, and what is measured.
struct Signatures {
  std::size_t channel = 0;
  MatrixXd columns;        // [rows, 3]
  std::vector<char> acts;  // by block
};

std::vector<Signatures> signatures_of(const Evidence& evidence, const ComparedEffect& effect,
                                      const EffectFit& fit) {
  std::vector<Signatures> out;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    MatrixXd x = MatrixXd::Zero(channel.rows(), 3);  // common, suspects, references
    Index group = 0;
    for (const EffectDesign* d : {&effect.suspect, &effect.reference}) {
      ++group;
      if (!d->touches(c)) continue;
      x.col(0) += d->columns[c] * effect.common;
      x.col(group) = d->columns[c] * effect.direction;
    }
    if (x.rightCols(2).isZero(0.0)) continue;
    const MatrixXd others = columns_of(effect.others, c, channel.rows());
    const Index at = others.cols();
    MatrixXd columns(channel.rows(), at + 3);
    columns << others, x;
    const MatrixXd rows = whitened_rows(channel, fit.noise[c], columns);
    MatrixXd own(rows.rows(), 3);
    own << rows.middleCols(at + 1, 2), rows.col(at + 3) - rows.col(at);
    if (at > 0) own = without_projection(own, rows.leftCols(at));
    out.push_back({c, own / std::sqrt(fit.noise[c].variance), {}});
    for (const NoiseBlock& b : channel.blocks)
      out.back().acts.push_back(!x.middleRows(b.first, b.last - b.first).rightCols(2).isZero(0.0));
  }
  return out;
}

/// Sizes in both groups of logs, estimated together with what the baseline follows in all of them.
struct JointSizes {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  Eigen::Vector2d information = Eigen::Vector2d::Zero();  ///< inverse variances; 0: no estimate
  double covariance = 0.0;
};

JointSizes joint_sizes(const std::vector<Signatures>& all) {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Signatures& s : all) products += s.columns.transpose() * s.columns;
  const double a = products(0, 0), b = products(1, 1), ab = products(0, 1);
  JointSizes joint;
  // A signature that the baseline follows but for rounding has no size.
  const double independent = a > 0.0 && b > 0.0 ? 1.0 - ab * ab / (a * b) : 1.0;
  if (!(independent > kIndependent)) return joint;
  joint.information << a * independent, b * independent;
  if (a > 0.0 && b > 0.0) joint.covariance = -ab / (a * b * independent);
  if (a > 0.0)
    joint.size[0] =
        (products(0, 2) - (b > 0.0 ? ab * products(1, 2) / b : 0.0)) / joint.information[0];
  if (b > 0.0)
    joint.size[1] =
        (products(1, 2) - (a > 0.0 ? ab * products(0, 2) / a : 0.0)) / joint.information[1];
  return joint;
}

/// Sizes of the stretches of motion of one group of logs: they scatter by what the joint estimate leaves, about the joint size and with its
/// information. What the baseline follows of the one group's effect shows in the other group as well, so that a size of each
/// stretch by itself would take the difference of both groups for a common size.
std::vector<BlockSize> block_sizes(const Evidence& evidence, const std::vector<Signatures>& all,
                                   const JointSizes& joint, Index group) {
  std::vector<BlockSize> blocks;
  double information = 0.0, sum = 0.0;
  for (const Signatures& s : all) {
    const EvidenceChannel& channel = evidence.channels[s.channel];
    const VectorXd left = s.columns.col(2) - s.columns.leftCols(2) * joint.size;
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      // where it does not act it has no size, although the baseline's projection leaves a column there
      if (!s.acts[b] ||
          (static_cast<std::size_t>(channel.log[b]) < evidence.suspects) != (group == 0))
        continue;
      const Index first = channel.blocks[b].first, length = channel.blocks[b].last - first;
      const auto column = s.columns.col(group).segment(first, length);
      const double own = column.squaredNorm();
      if (!(own > 0.0)) continue;
      const double deviation = column.dot(left.segment(first, length));
      information += own;
      sum += deviation;
      blocks.push_back({deviation / own, own});
    }
  }
  for (BlockSize& b : blocks) {
    b.size += joint.size[group] - sum / information;
    b.information *= joint.information[group] / information;
  }
  return blocks;
}

}  // namespace

SizeByLogs size_by_logs(const Evidence& evidence, const ComparedEffect& effect,
                        const EffectFit& fit) {
  const std::vector<Signatures> all = signatures_of(evidence, effect, fit);
  const JointSizes joint = joint_sizes(all);
  std::vector<BlockSize> suspects, references;
  if (joint.information[0] > 0.0) suspects = block_sizes(evidence, all, joint, 0);
  if (joint.information[1] > 0.0) references = block_sizes(evidence, all, joint, 1);
  Moments m;
  add_moments(suspects, m);
  add_moments(references, m);
  Variation scaled, added;
  if (m.freedom > 0.0) scaled.factor = std::max(1.0, m.q / m.freedom);
  if (m.factor > 0.0) added.added = std::max(0.0, (m.q - m.freedom) / m.factor);
  const auto likelihood = [&](const Variation& v) {
    return log_likelihood(suspects, v) + log_likelihood(references, v);
  };
  const Variation v = likelihood(scaled) > likelihood(added) ? scaled : added;
  return {size_in_logs(suspects, v), size_in_logs(references, v), v.factor * joint.covariance,
          m.freedom, std::sqrt(v.added)};
}

}  // namespace sparflow
