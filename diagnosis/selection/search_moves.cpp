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

/// Linear parameters of found[i] in a fit of all found.
Eigen::VectorXd theta_of(const std::vector<FoundEffect>& found, std::size_t i,
                         const EffectFit& fit) {
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < i; ++k) first += found[k].design.linear;
  return fit.theta.segment(first, found[i].design.linear);
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
  const std::vector<bool> choices =
      shape_choices(*found[i].design.effect.effect, found[i].design.shape);
  if (std::find(choices.begin(), choices.end(), true) == choices.end()) return false;
  const std::vector<const EffectDesign*> others = designs_of(found, i);
  const EffectFit without = fit_effects(search.evidence, others, &current, {});
  const double least =
      search.scores.gain(others, found[i].design, without) + search.options.least_reshape_gain;
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
  for (CandidateScore& s : variants)
    s.gain = search.scores.gain(others, search.design_of(s), without);
  std::erase_if(variants, [&](const CandidateScore& s) { return !(s.gain > least); });
  std::stable_sort(
      variants.begin(), variants.end(),
      [](const CandidateScore& a, const CandidateScore& b) { return a.gain > b.gain; });
  // A variant whose parameters leave what is plausible would be refused; it does not take the place of one that is not.
  std::vector<FoundEffect> with = found;
  EffectFit fit;
  const auto plausible = [&](const CandidateScore& s) {
    with[i] = {};
    with[i].design = search.scores.refined(others, s, without);
    with[i].p_value = found[i].p_value;
    fit = search.fit(designs_of(with));
    return !rests_on_bound(with[i].design, theta_of(with, i, fit)) ||
           rests_on_bound(found[i].design, theta_of(found, i, current));
  };
  if (!search.mechanisms().act(Mechanism::kReshape,
                               std::any_of(variants.begin(), variants.end(), plausible)))
    return false;
  if (tracing()) {
    fmt::print(stderr, "  {} changes shape [{:.4g}] -> [{:.4g}]\n",
               search.key(with[i].design.effect), fmt::join(found[i].design.shape, " "),
               fmt::join(with[i].design.shape, " "));
  }
  found = std::move(with);
  current = std::move(fit);
  return true;
}

bool exchange(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
              EffectFit& current) {
  std::vector<bool> skip = search.skipped(found);
  for (std::size_t k = 0; k < skip.size(); ++k) skip[k] = skip[k] || !search.judged_anew[k];
  if (std::find(skip.begin(), skip.end(), false) == skip.end()) return false;
  const std::vector<const EffectDesign*> others = designs_of(found, i);
  const EffectFit without = fit_effects(search.evidence, others, &current, {});
  const EffectDesign& place = found[i].design;
  const std::vector<CandidateScore> scores = search.scores.instead_of(place, others, without, skip);
  const double least = search.scores.gain_instead(place, place, others, without) -
                       search.penalty_of(place) + search.options.least_reshape_gain;
  if (scores.empty() || scores.front().gain < least) return false;
  std::vector<FoundEffect> with = found;
  with[i] = {};
  with[i].design = search.scores.refined(others, scores.front(), without);
  with[i].p_value = found[i].p_value;
  EffectFit fit = search.fit(designs_of(with));
  search.judge(with, i, fit);
  if (!why_not_named(with[i], search.options, search.mechanisms()).empty()) return false;
  if (tracing())
    fmt::print(stderr, "  {} takes the place of {}\n", search.key(with[i].design.effect),
               search.key(place.effect));
  found = std::move(with);
  current = std::move(fit);
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
