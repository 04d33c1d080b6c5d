#include "diagnosis/regression/size_by_logs.h"

#include <algorithm>
#include <cmath>

#include "models/math/linear_algebra.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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
         std::hypot(suspects.standard_error, references.standard_error);
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

SizeByLogs size_by_logs(const Evidence& evidence, const ComparedEffect& effect,
                        const EffectFit& fit) {
  std::vector<BlockSize> suspects, references;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    const EvidenceChannel& channel = evidence.channels[c];
    MatrixXd x = MatrixXd::Zero(channel.rows(), 2);
    for (const EffectDesign* d : {&effect.suspect, &effect.reference}) {
      if (!d->touches(c)) continue;
      x.col(0) += d->columns[c] * effect.common;
      x.col(1) += d->columns[c] * effect.direction;
    }
    if (x.col(1).isZero(0.0)) continue;
    const MatrixXd others = columns_of(effect.others, c, channel.rows());
    const Index at = others.cols();
    MatrixXd columns(channel.rows(), at + 2);
    columns << others, x;
    const MatrixXd rows = whitened_rows(channel, fit.noise[c], columns);
    MatrixXd own(rows.rows(), 2);
    own << rows.col(at + 1), rows.col(at + 2) - rows.col(at);
    if (at > 0) own = without_projection(own, rows.leftCols(at));
    for (std::size_t b = 0; b < channel.blocks.size(); ++b) {
      const Index first = channel.blocks[b].first, length = channel.blocks[b].last - first;
      // where it does not act it has no size, although the baseline's projection leaves a column there
      if (x.col(1).segment(first, length).isZero(0.0)) continue;
      const auto column = own.col(0).segment(first, length);
      const double information = column.squaredNorm() / fit.noise[c].variance;
      if (!(information > 0.0)) continue;
      const double size =
          column.dot(own.col(1).segment(first, length)) / fit.noise[c].variance / information;
      (static_cast<std::size_t>(channel.log[b]) < evidence.suspects ? suspects : references)
          .push_back({size, information});
    }
  }
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
  return {size_in_logs(suspects, v), size_in_logs(references, v), m.freedom, std::sqrt(v.added)};
}

}  // namespace sparflow
