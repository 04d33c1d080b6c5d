#include "diagnosis/selection/search_candidates.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "models/math/linear_algebra.h"
#include "models/math/parallel.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Every point with every value appended.
std::vector<std::vector<double>> with_each(const std::vector<std::vector<double>>& points,
                                           const std::vector<double>& values) {
  std::vector<std::vector<double>> next;
  next.reserve(points.size() * values.size());
  for (const auto& point : points) {
    for (const double v : values) {
      next.push_back(point);
      next.back().push_back(v);
    }
  }
  return next;
}

std::vector<std::vector<double>> grid_of(const EffectAt& effect, const Evidence& evidence) {
  const MachineSeries& log = grid_log(evidence);
  std::vector<std::vector<double>> points = {{}}, plain = {{}};
  bool optional = false;
  int shape = 0;
  for (const EffectParameter& p : effect.effect->info().parameters) {
    if (p.linear) continue;
    const std::vector<double> values = effect.effect->grid(log, effect.at, shape++);
    points = with_each(points, values);
    plain = with_each(plain, p.optional ? std::vector<double>{0.0} : values);
    optional = optional || p.optional;
  }
  // without the optional parameters first: of equal gains the first counts
  if (optional) points.insert(points.begin(), plain.begin(), plain.end());
  if (!evidence.has_reference())
    std::erase_if(points, [&](const std::vector<double>& point) {
      return effect.effect->needs_reference(point);
    });
  return points;
}

/// Guards the logarithm of the penalty where there is no evidence; channels have more rows.
constexpr double kLeastRows = 10.0;
/// Least square of a column and least singular value of scaled columns, relative to the largest ones: below, only
/// rounding is left.
constexpr double kRoundingOfColumn = 1e-12, kRoundingOfRank = 1e-6;

/// Largest number of linear parameters with independent columns. A mass on the first link, for example, acts by its
/// moment alone, so one of its two columns is not independent.
int independent_columns(const std::vector<EffectDesign>& designs) {
  Index linear = 1;
  for (const EffectDesign& d : designs) {
    MatrixXd gram = MatrixXd::Zero(d.linear, d.linear);
    for (const MatrixXd& c : d.columns) {
      if (c.cols() > 0) gram += transposed_product(c, c) / std::max(c.squaredNorm(), 1e-300);
    }
    const VectorXd scale = gram.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    Index here = 0;
    for (Index i = 0; i < d.linear; ++i)
      here += gram(i, i) > kRoundingOfColumn * gram.diagonal().maxCoeff() ? 1 : 0;
    const MatrixXd correlation = scale.asDiagonal() * gram * scale.asDiagonal();
    here = std::min(here, rank(correlation, kRoundingOfRank));
    linear = std::max(linear, here);
  }
  return static_cast<int>(linear);
}

/// Penalty of the nonlinear parameters: `each` for one that has a scale, the logarithm of their number for variants of a law, among
/// which nothing is estimated.
double shape_penalty(const SearchCandidate& c, double each) {
  double sum = 0.0;
  std::size_t k = 0;
  for (const EffectParameter& p : c.effect.effect->info().parameters) {
    if (p.linear) continue;
    if (p.optional) {
      ++k;
      continue;
    }
    std::vector<double> values;
    for (const EffectDesign& d : c.designs) values.push_back(d.shape[k]);
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    sum += p.choice ? std::log(static_cast<double>(values.size())) : each;
    ++k;
  }
  return sum;
}

int values_from_measurement(const Evidence& evidence, const SearchCandidate& candidate) {
  int sum = 0;
  for (std::size_t log = 0; log < evidence.suspects; ++log)
    sum += candidate.effect.effect->values_from_measurement(evidence.series[log]);
  return sum;
}

}  // namespace

const MachineSeries& grid_log(const Evidence& evidence) {
  std::size_t longest = 0;
  for (std::size_t k = 1; k < evidence.suspects; ++k) {
    if (evidence.series[k].samples() > evidence.series[longest].samples()) longest = k;
  }
  return evidence.series[longest];
}

std::vector<SearchCandidate> search_candidates(const Evidence& evidence,
                                               const std::vector<EffectAt>& effects) {
  double rows = kLeastRows;
  for (const EvidenceChannel& c : evidence.channels)
    rows = std::max(rows, static_cast<double>(c.rows()));
  std::vector<SearchCandidate> all(effects.size());
  parallel(effects.size(), [&](std::size_t i) {
    all[i].effect = effects[i];
    for (auto& shape : grid_of(effects[i], evidence)) {
      EffectDesign d = make_design(evidence, effects[i], std::move(shape));
      if (d.acts()) all[i].designs.push_back(std::move(d));
    }
  });
  std::erase_if(all, [](const SearchCandidate& c) { return c.designs.empty(); });
  for (SearchCandidate& c : all) {
    const double each = 0.5 * std::log(rows);
    c.optional_shape_penalty = each;
    c.linear = independent_columns(c.designs);
    const bool optional = std::any_of(c.designs.begin(), c.designs.end(),
                                      [](const EffectDesign& d) { return d.optional; });
    if (optional && evidence.options.mechanisms.enabled(Mechanism::kOptional)) {
      std::vector<EffectDesign> all_designs;
      all_designs.reserve(2 * c.designs.size());
      for (const EffectDesign& d : c.designs) all_designs.push_back(without_optional(d));
      const int whole = std::exchange(c.linear, independent_columns(all_designs));
      c.optional_penalty = each * (whole - c.linear);
      std::move(c.designs.begin(), c.designs.end(), std::back_inserter(all_designs));
      c.designs = std::move(all_designs);
    }
    c.penalty =
        each * c.linear + shape_penalty(c, each) + each * values_from_measurement(evidence, c);
  }
  return all;
}

}  // namespace sparflow
