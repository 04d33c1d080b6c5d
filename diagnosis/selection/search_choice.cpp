#include "diagnosis/selection/search_choice.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/math/parallel.h"

namespace sparflow {
namespace {

/// The rival with the largest significant advantage over `best` by least-squares comparison; null if there is none.
const CandidateScore* best_by_least_squares(const SearchState& search,
                                            const std::vector<const EffectDesign*>& base,
                                            const std::vector<const CandidateScore*>& rivals,
                                            const EffectDesign& best) {
  const LeastSquaresResidual one = search.scores.least_squares(base, best);
  std::vector<double> advantage(rivals.size());
  parallel(rivals.size(), [&](std::size_t i) {
    const EffectDesign& d = search.design_of(*rivals[i]);
    if (search.meet(d, best))
      advantage[i] = least_squares_advantage(search.evidence, search.scores.least_squares(base, d),
                                             one, search.options.regression);
  });
  const auto most = std::max_element(advantage.begin(), advantage.end());
  return most == advantage.end() || *most <= 0.0
             ? nullptr
             : rivals[static_cast<std::size_t>(most - advantage.begin())];
}

/// Whether the least-squares comparison prefers `one` to `other` significantly.
bool better_by_least_squares(const SearchState& search,
                             const std::vector<const EffectDesign*>& base, const EffectDesign& one,
                             const EffectDesign& other) {
  return least_squares_advantage(search.evidence, search.scores.least_squares(base, one),
                                 search.scores.least_squares(base, other),
                                 search.options.regression) > 0.0;
}

/// The same candidate at that point of its grid which the least-squares comparison prefers significantly, if any.
CandidateScore shaped(const SearchState& search, const std::vector<const EffectDesign*>& base,
                      const CandidateScore& score) {
  std::vector<CandidateScore> others;
  for (std::size_t d = 0; d < search.candidates[score.candidate].designs.size(); ++d) {
    if (d != score.design) others.push_back({score.candidate, d, score.gain});
  }
  std::vector<const CandidateScore*> pointers;
  pointers.reserve(others.size());
  for (const CandidateScore& o : others) pointers.push_back(&o);
  const CandidateScore* better =
      best_by_least_squares(search, base, pointers, search.design_of(score));
  const bool acts = search.mechanisms().act(Mechanism::kSquaresShape, better != nullptr);
  return acts ? *better : score;
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
  const CandidateScore* larger =
      best_by_least_squares(search, base, passing, search.design_of(*first));
  if (search.mechanisms().act(Mechanism::kSquaresChoice, larger != nullptr)) {
    if (tracing())
      fmt::print(stderr, "  {} leaves less than {}\n",
                 search.key(search.candidates[larger->candidate].effect),
                 search.key(search.candidates[first->candidate].effect));
    first = larger;
  }
  const EffectAt& best = search.candidates[first->candidate].effect;
  for (const CandidateScore* s : passing) {
    const EffectAt& e = search.candidates[s->candidate].effect;
    if (e.at != best.at || e.effect->info().id != best.effect->info().refines) continue;
    const bool plainer =
        s->gain > search.options.plainer_share * first->gain ||
        search.mechanisms().act(
            Mechanism::kSquaresPlainer,
            !better_by_least_squares(search, base, search.design_of(*first), search.design_of(*s)));
    if (search.mechanisms().act(Mechanism::kPlainer, plainer)) {
      return shaped(search, base, *s);
    }
  }
  return shaped(search, base, *first);
}

}  // namespace sparflow
