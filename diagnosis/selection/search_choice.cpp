#include "diagnosis/selection/search_choice.h"

#include <algorithm>

#include "models/math/parallel.h"

namespace sparflow {
namespace {

/// The same candidate at that point of its grid which the least-squares comparison prefers most, if significantly.
CandidateScore shaped(const SearchState& search, const std::vector<const EffectDesign*>& base,
                      const CandidateScore& score) {
  const std::vector<EffectDesign>& designs = search.candidates[score.candidate].designs;
  const EffectDesign& best = designs[score.design];
  const LeastSquaresResidual one = search.scores.least_squares(base, best);
  std::vector<double> advantage(designs.size());
  parallel(designs.size(), [&](std::size_t d) {
    if (d != score.design && search.meet(designs[d], best))
      advantage[d] =
          least_squares_advantage(search.evidence, search.scores.least_squares(base, designs[d]),
                                  one, search.options.regression);
  });
  const auto most = std::max_element(advantage.begin(), advantage.end());
  if (!search.mechanisms().act(Mechanism::kSquaresShape, *most > 0.0)) return score;
  return {score.candidate, static_cast<std::size_t>(most - advantage.begin()), score.gain};
}

}  // namespace

CandidateScore chosen(const SearchState& search, const std::vector<CandidateScore>& scores,
                      const NullDistribution& null, double level,
                      const std::vector<const EffectDesign*>& base) {
  std::vector<const CandidateScore*> passing;
  for (const CandidateScore& s : scores) {
    if (null.p_value(s.gain, s.candidate) < level) passing.push_back(&s);
  }
  if (passing.empty()) return scores.front();
  const CandidateScore* first = passing.front();
  const EffectAt& best = search.candidates[first->candidate].effect;
  for (const CandidateScore* s : passing) {
    const EffectAt& e = search.candidates[s->candidate].effect;
    if (e.at != best.at || e.effect->info().id != best.effect->info().refines) continue;
    const bool plainer = s->gain > search.options.plainer_share * first->gain;
    if (search.mechanisms().act(Mechanism::kPlainer, plainer)) {
      return shaped(search, base, *s);
    }
  }
  return shaped(search, base, *first);
}

}  // namespace sparflow
