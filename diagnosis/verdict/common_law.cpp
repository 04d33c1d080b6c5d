#include "diagnosis/verdict/common_law.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "diagnosis/selection/search_scores.h"
#include "diagnosis/selection/search_state.h"
#include "diagnosis/verdict/designs_by_group.h"
#include "diagnosis/verdict/diagnosed_effect.h"

namespace sparflow {
namespace {

using Eigen::VectorXd;
using Designs = std::vector<const EffectDesign*>;

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

std::optional<FoundEffect> common_law(const Diagnosis& d, std::size_t found,
                                      const SearchOptions& options) {
  const FoundEffect& f = d.search.found[found];
  if (f.design.shape.empty()) return {};
  const OtherEffects beside(d, found);
  const EffectDesign everywhere = best_in_all_logs(d, f.design, beside.designs, options);
  FoundEffect law = f;
  law.design = make_design(d.evidence, f.design.effect, everywhere.shape, f.design.about,
                           everywhere.optional);
  if (!design_in(d.evidence, law.design, ActingLogs::kReferences).acts()) return {};
  Designs all = beside.designs;
  all.push_back(&everywhere);
  const VectorXd theta =
      fit_effects(d.evidence, all, &d.search.final).theta.tail(everywhere.linear);
  law.values.assign(theta.begin(), theta.end());
  law.values.insert(law.values.end(), everywhere.shape.begin(), everywhere.shape.end());
  law.covariance.resize(0, 0);
  if (tracing())
    fmt::print(stderr, "    one law for both logs: {:.4g}\n", fmt::join(law.values, " "));
  return law;
}

}  // namespace sparflow
