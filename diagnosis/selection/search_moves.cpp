#include "diagnosis/selection/search_moves.h"

#include <fmt/format.h>

#include <algorithm>

#include "diagnosis/regression/acceptance_statistics.h"
#include "diagnosis/selection/acceptance_tests.h"

namespace sparflow {
namespace {

bool merge_two(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
               std::size_t j, EffectFit& current) {
  std::vector<FoundEffect> trial = found;
  trial.erase(trial.begin() + static_cast<std::ptrdiff_t>(j));
  trial.erase(trial.begin() + static_cast<std::ptrdiff_t>(i));
  const EffectFit without = search.fit(designs_of(trial));
  const double penalty = search.penalty_of(found[i].design) + search.penalty_of(found[j].design);
  const double pair = current.total() - without.total() - penalty;
  const std::vector<CandidateScore> scores =
      search.scores.beside(designs_of(trial), without, search.skipped(trial));
  if (scores.empty() || scores.front().gain < search.options.merge_share * pair) return false;
  FoundEffect one;
  one.design = search.scores.refined(designs_of(trial), scores.front(), without);
  one.p_value = std::min(found[i].p_value, found[j].p_value);
  trial.push_back(one);
  EffectFit fit = search.fit(designs_of(trial));
  const double gain = fit.total() - without.total() - search.penalty_of(one.design);
  if (tracing())
    fmt::print(stderr, "  {} for {} and {}: {:.1f} against {:.1f} nats\n",
               search.key(one.design.effect), search.key(found[i].design.effect),
               search.key(found[j].design.effect), gain, pair);
  if (gain < pair) return false;
  search.judge(trial, trial.size() - 1, fit);
  trial.back().gain = gain;
  if (!why_not_named(trial.back(), search.options, search.mechanisms()).empty()) return false;
  if (!search.mechanisms().act(Mechanism::kMerge)) return false;
  found = std::move(trial);
  current = std::move(fit);
  return true;
}

}  // namespace

bool merge(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = i + 1; j < found.size(); ++j) {
      if (search.meet(found[i].design, found[j].design) && merge_two(search, found, i, j, current))
        return true;
    }
  }
  return false;
}

bool reshape(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
             EffectFit& current) {
  const std::vector<bool> choices = shape_choices(*found[i].design.effect.effect);
  if (std::find(choices.begin(), choices.end(), true) == choices.end()) return false;
  const std::vector<const EffectDesign*> others = designs_of(found, i);
  const EffectFit without = fit_effects(search.evidence, others, &current, {});
  double most =
      search.scores.gain(others, found[i].design, without) + search.options.least_reshape_gain;
  const CandidateScore* best = nullptr;
  std::vector<CandidateScore> variants;
  for (std::size_t c = 0; c < search.candidates.size(); ++c) {
    if (!(search.candidates[c].effect == found[i].design.effect)) continue;
    variants.reserve(search.candidates[c].designs.size());
    for (std::size_t d = 0; d < search.candidates[c].designs.size(); ++d) {
      const std::vector<double>& shape = search.candidates[c].designs[d].shape;
      bool other = false;
      for (std::size_t k = 0; k < shape.size(); ++k)
        other = other || (choices[k] && shape[k] != found[i].design.shape[k]);
      if (other) variants.push_back({c, d, 0.0});
    }
  }
  for (CandidateScore& s : variants) {
    s.gain = search.scores.gain(others, search.design_of(s), without);
    if (s.gain > most) most = s.gain, best = &s;
  }
  if (!search.mechanisms().act(Mechanism::kReshape, best != nullptr)) return false;
  FoundEffect variant;
  variant.design = search.scores.refined(others, *best, without);
  variant.p_value = found[i].p_value;
  if (tracing()) {
    fmt::print(stderr, "  {} changes shape [{:.4g}] -> [{:.4g}]\n",
               search.key(variant.design.effect), fmt::join(found[i].design.shape, " "),
               fmt::join(variant.design.shape, " "));
  }
  found[i] = std::move(variant);
  current = search.fit(designs_of(found));
  return true;
}

void list_rivals(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
                 const EffectFit& current) {
  FoundEffect& f = found[i];
  const std::vector<const EffectDesign*> others = designs_of(found, i);
  const EffectFit without = fit_effects(search.evidence, others, &current, {});
  const std::vector<CandidateScore> scores =
      search.scores.instead_of(f.design, others, without, search.skipped(found));
  f.gain =
      search.scores.gain_instead(f.design, f.design, others, without) - search.penalty_of(f.design);
  f.alternatives.clear();
  const double listed =
      std::max(search.options.largest_alternative_loss, same_within(f, search.options));
  for (const CandidateScore& s : scores) {
    if (s.gain < f.gain - listed) break;
    record_optional(search, s);
    f.alternatives.emplace_back(search.candidates[s.candidate].effect, f.gain - s.gain);
  }
}

}  // namespace sparflow
