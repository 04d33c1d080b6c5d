#include "diagnosis/verdict/common_law.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <utility>

#include "diagnosis/selection/search_scores.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/designs_by_group.h"
#include "diagnosis/verdict/diagnosed_effect.h"
#include "models/math/student.h"

namespace sparflow {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Designs = std::vector<const EffectDesign*>;

/// Squared whitened residuals over the noise's variance, by stretch of motion of the channels in which `about` acts.
std::vector<double> squares_by_stretch(const Evidence& evidence, const Designs& designs,
                                       const VectorXd& theta, const std::vector<NoiseModel>& noise,
                                       const EffectDesign& about) {
  std::vector<double> squares;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c) {
    if (!about.touches(c)) continue;
    const EvidenceChannel& channel = evidence.channels[c];
    const MatrixXd columns = columns_of(designs, c, channel.rows());
    VectorXd of_columns(columns.cols());
    Index first = 0, column = 0;
    for (const EffectDesign* d : designs) {
      const Index here = d->columns[c].cols();
      of_columns.segment(column, here) = theta.segment(first, here);
      column += here;
      first += d->linear;
    }
    const MatrixXd rows = whitened_rows(channel, noise[c], columns);
    const VectorXd left = rows.rightCols(1) - rows.leftCols(columns.cols()) * of_columns;
    for (const NoiseBlock& block : channel.blocks)
      squares.push_back(left.segment(block.first, block.last - block.first).squaredNorm() /
                        noise[c].variance);
  }
  return squares;
}

/// Probability that the first squares exceed the second ones by chance: Student's test over the stretches where they differ.
double chance_of_excess(const std::vector<double>& first, const std::vector<double>& second) {
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (std::size_t b = 0; b < first.size(); ++b) {
    const double excess = first[b] - second[b];
    if (excess == 0.0) continue;
    sum += excess;
    squares += excess * excess;
    count += 1.0;
  }
  if (count < 2.0) return 1.0;
  const double variance = (squares - sum * sum / count) / (count - 1.0);
  return variance > 0.0 ? student_tail(sum / std::sqrt(count * variance), count - 1.0) : 1.0;
}

/// The design in all logs that explains them best beside others.
EffectDesign best_in_all_logs(const Diagnosis& d, const EffectDesign& found, const Designs& others,
                              const SearchOptions& options) {
  std::vector<SearchCandidate> candidates = search_candidates(d.evidence, {found.effect});
  if (candidates.empty()) candidates.push_back({found.effect, {}});
  candidates.front().designs.push_back(found);
  for (EffectDesign& design : candidates.front().designs)
    design = in_all_logs(design, design_in(d.evidence, design, ActingLogs::kReferences));
  Evidence all = d.evidence;
  all.suspects = all.series.size();  // so that a trial between grid points acts in all logs as well
  const SearchScores scores(all, candidates, options);
  const EffectFit without = fit_effects(all, others, &d.search.final);
  return scores.refined(others, scores.beside(others, without, {false}).front(), without);
}

}  // namespace

std::optional<CommonLaw> common_law(const Diagnosis& d, std::size_t found,
                                    const SearchOptions& options) {
  const FoundEffect& f = d.search.found[found];
  if (f.design.shape.empty()) return {};
  const OtherEffects beside(d, found);
  const EffectDesign everywhere = best_in_all_logs(d, f.design, beside.designs, options);
  const bool shared = is_shared(d.evidence, f);
  const Evidence evidence = shared ? d.evidence : with_law_fixed(d.evidence, f.design.effect);
  const EffectDesign reference = design_in(evidence, f.design, ActingLogs::kReferences);
  Designs of_one = beside.designs, own = beside.designs;
  of_one.push_back(&everywhere);
  own.push_back(&f.design);
  if (!shared && reference.acts()) own.push_back(&reference);
  const EffectFit one = fit_effects(evidence, of_one, &d.search.final),
                  apart = fit_effects(evidence, own, &d.search.final);
  CommonLaw common;
  common.law = f;
  common.law.design =
      make_design(evidence, f.design.effect, everywhere.shape, f.design.about, everywhere.optional);
  const VectorXd theta = one.theta.tail(everywhere.linear);
  common.law.values.assign(theta.begin(), theta.end());
  common.law.values.insert(common.law.values.end(), everywhere.shape.begin(),
                           everywhere.shape.end());
  common.law.covariance.resize(0, 0);
  common.acts_in_references =
      design_in(evidence, common.law.design, ActingLogs::kReferences).acts();
  const EffectDesign both = in_all_logs(f.design, reference);
  common.chance = chance_of_excess(squares_by_stretch(evidence, of_one, one.theta, one.noise, both),
                                   squares_by_stretch(evidence, own, apart.theta, one.noise, both));
  if (tracing())
    fmt::print(stderr,
               "    one law for both logs: {:.4g}{}; laws of their own better by chance {:.2g}\n",
               fmt::join(common.law.values, " "),
               common.acts_in_references ? "" : ", not in the references", common.chance);
  return common;
}

}  // namespace sparflow
