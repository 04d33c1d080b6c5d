#include "diagnosis/selection/search_choice.h"

#include <fmt/format.h>

#include <algorithm>

#include "models/math/parallel.h"

namespace sparflow {
namespace {

/// That of `rivals` which is most of all better than `best` where every row counts the same, or `best`.
const CandidateScore* ordinarily_best(const SearchState& search,
                                      const std::vector<const EffectDesign*>& base,
                                      const std::vector<const CandidateScore*>& rivals,
                                      const EffectDesign& best) {
  const OrdinaryResidual one = search.scores.ordinary(base, best);
  std::vector<double> advantage(rivals.size());
  parallel(rivals.size(), [&](std::size_t i) {
    const EffectDesign& d = search.design_of(*rivals[i]);
    if (search.meet(d, best))
      advantage[i] = ordinary_advantage(search.evidence, search.scores.ordinary(base, d), one);
  });
  const auto most = std::max_element(advantage.begin(), advantage.end());
  return most == advantage.end() || *most <= 0.0
             ? nullptr
             : rivals[static_cast<std::size_t>(most - advantage.begin())];
}

/// The same candidate with those nonlinear parameters of its grid that leave significantly less where every row
/// counts the same, if any do.
CandidateScore shaped(const SearchState& search, const std::vector<const EffectDesign*>& base,
                      const CandidateScore& score) {
  std::vector<CandidateScore> others;
  for (std::size_t d = 0; d < search.candidates[score.candidate].designs.size(); ++d) {
    if (d != score.design) others.push_back({score.candidate, d, score.gain});
  }
  std::vector<const CandidateScore*> pointers;
  pointers.reserve(others.size());
  for (const CandidateScore& o : others) pointers.push_back(&o);
  const CandidateScore* better = ordinarily_best(search, base, pointers, search.design_of(score));
  return better == nullptr ? score : *better;
}

}  // namespace

bool ordinarily_better(const SearchState& search, const std::vector<const EffectDesign*>& base,
                       const EffectDesign& one, const EffectDesign& other) {
  return ordinary_advantage(search.evidence, search.scores.ordinary(base, one),
                            search.scores.ordinary(base, other)) > 0.0;
}

CandidateScore chosen(const SearchState& search, const std::vector<CandidateScore>& scores,
                      const NullGate& gate, double level,
                      const std::vector<const EffectDesign*>& base) {
  std::vector<const CandidateScore*> passing;
  for (const CandidateScore& s : scores) {
    if (gate.p_value(s.gain, s.candidate) < level) passing.push_back(&s);
  }
  if (passing.empty()) return scores.front();
  const CandidateScore* first = passing.front();
  const CandidateScore* larger = ordinarily_best(search, base, passing, search.design_of(*first));
  if (larger != nullptr) {
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
    if (s->gain > 0.5 * first->gain ||
        !ordinarily_better(search, base, search.design_of(*first), search.design_of(*s))) {
      return shaped(search, base, *s);
    }
  }
  return shaped(search, base, *first);
}

}  // namespace sparflow
