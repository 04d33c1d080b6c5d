#include "diagnosis/selection/search_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "diagnosis/selection/acceptance_tests.h"

namespace sparflow {
namespace {

/// Progress that a fit makes later would count as another effect's gain.
constexpr int kPassesToConvergence = 12;

}  // namespace

SearchState::SearchState(const Evidence& e, const std::vector<EffectAt>& effects,
                         const SearchOptions& o, const SearchProgress& p)
    : evidence(e),
      options(o),
      progress(p),
      candidates(search_candidates(e, effects)),
      scores(e, candidates, o),
      refused(candidates.size(), false),
      refused_beside(candidates.size()),
      judged_anew(candidates.size(), false) {}

void SearchState::report(std::size_t found, const std::string& what) const {
  if (progress) progress(std::min(0.9, 0.15 + 0.2 * static_cast<double>(found)), what);
}

std::string SearchState::key(const EffectAt& e) const {
  return effect_key(e.effect->info(), *evidence.series[0].machine, e.at);
}

double SearchState::penalty_of(const EffectDesign& design) const {
  for (const SearchCandidate& c : candidates) {
    if (c.effect == design.effect) return c.penalty_of(design);
  }
  return 0.0;
}

bool SearchState::meet(const EffectDesign& a, const EffectDesign& b) const {
  bool both = false;
  for (std::size_t c = 0; c < evidence.channels.size(); ++c)
    both = both || (a.touches(c) && b.touches(c));
  return both;
}

void SearchState::refuse(std::size_t candidate, const FoundEffect& tested,
                         const std::vector<FoundEffect>& found, bool form_error_alone) {
  refused[candidate] = true;
  refused_beside[candidate].clear();
  if (!form_error_alone) return;
  for (const FoundEffect& f : found)
    if (meet(f.design, tested.design)) refused_beside[candidate].push_back(f.design.effect);
}

void SearchState::allow_beside(const EffectAt& removed) {
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::vector<EffectAt>& beside = refused_beside[k];
    if (std::find(beside.begin(), beside.end(), removed) == beside.end()) continue;
    refused[k] = false;
    refused_beside[k].clear();
    judged_anew[k] = true;
  }
}

void SearchState::drop(std::vector<FoundEffect>& found, std::size_t index) {
  const FoundEffect dropped = std::move(found[index]);
  found.erase(found.begin() + static_cast<std::ptrdiff_t>(index));
  allow_beside(dropped.design.effect);
  const bool form_error_alone =
      !dropped.not_significant && passes_without_form_error(dropped, options, mechanisms());
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (candidates[k].effect == dropped.design.effect) refuse(k, dropped, found, form_error_alone);
  }
}

std::vector<bool> SearchState::skipped(const std::vector<FoundEffect>& found) const {
  const auto is_in = [&](const EffectAt& e) {
    return std::any_of(found.begin(), found.end(),
                       [&](const FoundEffect& f) { return f.design.effect == e; });
  };
  std::vector<bool> skip = refused;
  for (std::size_t k = 0; k < skip.size(); ++k) skip[k] = skip[k] || is_in(candidates[k].effect);
  return skip;
}

void SearchState::judge(std::vector<FoundEffect>& found, std::size_t index,
                        const EffectFit& fit) const {
  judge_effect(evidence, options, fit, found, index);
}

EffectFit SearchState::fit(const std::vector<const EffectDesign*>& designs,
                           const EffectFit* start) const {
  FitControl c;
  c.keep_residuals = true;
  c.noise_passes = kPassesToConvergence;
  c.covariance = true;
  return fit_effects(evidence, designs, start, c);
}

std::vector<const EffectDesign*> designs_of(const std::vector<FoundEffect>& found,
                                            std::size_t without) {
  std::vector<const EffectDesign*> d;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i != without) d.push_back(&found[i].design);
  }
  return d;
}

bool tracing() {
  static const bool on = std::getenv("SPARFLOW_TRACE") != nullptr;
  return on;
}

void trace_scores(const SearchState& search, int step, const std::vector<CandidateScore>& scores,
                  const NullDistribution& null) {
  fmt::print(stderr, "step {} threshold {:.1f}\n", step,
             null.threshold(search.options.false_alarm));
  for (std::size_t i = 0; i < std::min<std::size_t>(8, scores.size()); ++i) {
    const SearchCandidate& c = search.candidates[scores[i].candidate];
    fmt::print(stderr, "   {:28s} gain {:9.1f} shape [{:.4g}]\n", search.key(c.effect),
               scores[i].gain, fmt::join(c.designs[scores[i].design].shape, " "));
  }
}
void trace_found(const SearchState& search, const std::vector<FoundEffect>& found,
                 const EffectFit& fit) {
  const FoundEffect& f = found.back();
  fmt::print(stderr,
             "  + {} shape [{:.4g}] theta [{:.5g}] size {:.2f} over form {:.2g} absorbed {:.2f} "
             "held out {:.1f} "
             "+- {:.1f}, by chance {:.2g}\n",
             search.key(f.design.effect), fmt::join(f.design.shape, " "),
             fmt::join(std::vector<double>(fit.theta.begin(), fit.theta.end()), " "), f.size,
             f.over_form, f.absorbed, f.held_out, f.held_out_error, f.held_out_chance);
  for (std::size_t c = 0; c < search.evidence.channels.size(); ++c) {
    const EvidenceChannel& ch = search.evidence.channels[c];
    fmt::print(stderr,
               "     {:40s} n {} sd {:.3g} floor {:.3g} {} phi {:.2f} {:.2f} off {:.3g}, "
               "settles {:.1f} in {:.2f} s\n",
               ch.text, ch.rows(), fit.noise[c].deviation() / ch.unit.si,
               ch.noise_floor / ch.unit.si, ch.unit.name, fit.noise[c].phi1, fit.noise[c].phi2,
               std::sqrt(fit.noise[c].offset_variance) / ch.unit.si, fit.noise[c].transient,
               fit.noise[c].settling);
  }
}

}  // namespace sparflow
