#include "diagnosis/regression/scatter_of_sizes.h"

#include <algorithm>
#include <cmath>

namespace sparflow {
namespace {

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

}  // namespace

Variation variation_of(const std::vector<const std::vector<BlockSize>*>& groups) {
  Moments m;
  for (const std::vector<BlockSize>* g : groups) add_moments(*g, m);
  Variation scaled, added;
  scaled.freedom = added.freedom = m.freedom;
  if (m.freedom > 0.0) scaled.factor = std::max(1.0, m.q / m.freedom);
  if (m.factor > 0.0) added.added = std::max(0.0, (m.q - m.freedom) / m.factor);
  const auto likelihood = [&](const Variation& v) {
    double sum = 0.0;
    for (const std::vector<BlockSize>* g : groups) sum += log_likelihood(*g, v);
    return sum;
  };
  return likelihood(scaled) > likelihood(added) ? scaled : added;
}

MeanSize mean_size(const std::vector<BlockSize>& blocks, const Variation& v) {
  MeanSize out;
  double weights = 0.0;
  out.size = weighted_mean(blocks, v, weights);
  out.standard_error = weights > 0.0 ? 1.0 / std::sqrt(weights) : 0.0;
  return out;
}

}  // namespace sparflow
