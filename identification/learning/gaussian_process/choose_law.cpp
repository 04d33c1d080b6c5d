#include "identification/learning/gaussian_process/choose_law.h"

#include <algorithm>
#include <cmath>

#include "identification/learning/gaussian_process/sparse_gp.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Divides the groups, in the order of their numbers, into parts with about the same number of samples.
/// @return [samples] part of each sample; empty with fewer than two groups
std::vector<int> parts_of(const std::vector<int>& group, int most) {
  std::vector<int> names = group;
  std::sort(names.begin(), names.end());
  const std::vector<int> ordered = names;
  names.erase(std::unique(names.begin(), names.end()), names.end());
  if (names.size() < 2) return {};
  const int parts = std::min(most, static_cast<int>(names.size()));
  std::vector<int> part_of_name(names.size());
  if (parts == static_cast<int>(names.size())) {
    for (std::size_t i = 0; i < names.size(); ++i) part_of_name[i] = static_cast<int>(i);
  } else {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto before =
          std::lower_bound(ordered.begin(), ordered.end(), names[i]) - ordered.begin();
      part_of_name[i] = static_cast<int>(static_cast<double>(before) * parts /
                                         static_cast<double>(ordered.size()));
    }
  }
  std::vector<int> out;
  for (const int g : group) {
    const auto at = std::lower_bound(names.begin(), names.end(), g) - names.begin();
    out.push_back(part_of_name[static_cast<std::size_t>(at)]);
  }
  return out;
}

/// Every k-th of these rows, at most so many (LearnGpOptions::most_samples).
std::vector<Index> thinned_rows(const std::vector<Index>& rows, long most) {
  const auto step = static_cast<std::size_t>((static_cast<long>(rows.size()) + most - 1) / most);
  std::vector<Index> few;
  for (std::size_t i = step / 2; i < rows.size(); i += std::max<std::size_t>(1, step))
    few.push_back(rows[i]);
  return few;
}

/// Sum of the squared errors at `test` of a law whose coefficients are learned from `train`.
double squared_error(const GpPoints& train, const GpPoints& test, const GpHyper& hyper,
                     const LearnGpOptions& options) {
  const double tolerance = options.sparse_tolerance * std::exp(hyper[3] - hyper[2]);
  SparseGp sparse(train,
                  choose_inducing(train.x1, train.x2, hyper, options.max_centres, tolerance).rows);
  const GpPosterior posterior = sparse.posterior(hyper);
  VectorXd error = test.y - test.basis * posterior.beta;
  error.noalias() -=
      kernel_matrix(test.x1, test.x2, posterior.x1, posterior.x2, hyper) * posterior.weight;
  return error.squaredNorm();
}

}  // namespace

bool plane_is_not_worse(const LawChoice& choice, const LearnGpOptions& options, GpReport& report) {
  const std::vector<int> part = parts_of(choice.group, options.most_folds);
  if (part.empty()) return false;
  const int parts = 1 + *std::max_element(part.begin(), part.end());
  const auto n = static_cast<double>(choice.points.size());
  std::vector<double> difference;  // of the squared errors, for each sample of the log on average
  double plane = 0.0, process = 0.0;
  for (int fold = 0; fold < parts; ++fold) {
    std::vector<Index> train, test;
    for (std::size_t i = 0; i < part.size(); ++i)
      (part[i] == fold ? test : train).push_back(static_cast<Index>(i));
    if (test.empty() || static_cast<int>(train.size()) < options.min_samples) continue;
    const GpPoints others = choice.points.select(thinned_rows(train, options.most_samples)),
                   left_out = choice.points.select(test);
    const double by_plane = squared_error(others, left_out, choice.plane, options);
    const double by_process = squared_error(others, left_out, choice.process, options);
    plane += by_plane;
    process += by_process;
    difference.push_back((by_plane - by_process) / n);
  }
  const auto folds = static_cast<double>(difference.size());
  if (folds < 2.0) return false;
  report.plane_left_out = std::sqrt(plane / n);
  report.process_left_out = std::sqrt(process / n);
  double sum = 0.0, squares = 0.0;
  for (const double d : difference) sum += d;
  for (const double d : difference) squares += (d - sum / folds) * (d - sum / folds);
  // the sum of the parts' differences has the variance of one, times their number
  const double deviation = std::sqrt(folds * squares / (folds - 1.0));
  return sum <= options.not_worse * deviation;
}

}  // namespace sparflow
