#pragma once
/// State that the parts of a search share: evidence, candidates with their gains, rejected candidates. Used by
/// effect_search.cpp and its parts only.
#include <string>
#include <vector>

#include "diagnosis/regression/null_distribution.h"
#include "diagnosis/selection/effect_search.h"
#include "diagnosis/selection/search_scores.h"

namespace sparflow {

struct SearchState {
  /// All must outlive this.
  SearchState(const Evidence& evidence, const std::vector<EffectAt>& effects,
              const SearchOptions& options, const SearchProgress& progress);
  SearchState(const SearchState&) = delete;  // scores refer to candidates
  SearchState& operator=(const SearchState&) = delete;

  const Evidence& evidence;
  const SearchOptions& options;
  const SearchProgress& progress;
  std::vector<SearchCandidate> candidates;
  SearchScores scores;
  std::vector<bool> refused;  ///< by candidate: failed an acceptance test in this search
  /// By candidate: the effects beside whose model-form error alone it was refused.
  std::vector<std::vector<EffectAt>> refused_beside;
  std::vector<bool> judged_anew;  ///< by candidate: such a refusal has become void

  const Mechanisms& mechanisms() const { return evidence.options.mechanisms; }
  void report(std::size_t found, const std::string& what) const;
  std::string key(const EffectAt& e) const;
  const EffectDesign& design_of(const CandidateScore& score) const {
    return candidates[score.candidate].designs[score.design];
  }
  double penalty_of(const EffectDesign& design) const;  ///< [nats] penalty
  /// Whether both act in a common channel.
  bool meet(const EffectDesign& a, const EffectDesign& b) const;
  /// By candidate: whether it was refused before or is found already.
  std::vector<bool> skipped(const std::vector<FoundEffect>& found) const;
  /// Refuses a candidate that fails an acceptance test beside what was found, of which it is not yet a part.
  void refuse(std::size_t candidate, const FoundEffect& tested,
              const std::vector<FoundEffect>& found, bool form_error_alone);
  /// Takes an effect out that fails an acceptance test since later effects were found, and refuses it: where only their model-form
  /// error speaks against it, until one of them is taken out.
  void drop(std::vector<FoundEffect>& found, std::size_t index);
  /// Makes the refusals void that rest on the model-form error of an effect that is no longer found.
  void allow_beside(const EffectAt& removed);
  /// Computes the statistics of the acceptance tests of found[index]. @param fit of all found
  void judge(std::vector<FoundEffect>& found, std::size_t index, const EffectFit& fit) const;
  /// Fit with residuals and covariance, its noise models iterated to convergence.
  /// @param start fit whose noise models are the initial guess; may be null
  EffectFit fit(const std::vector<const EffectDesign*>& designs,
                const EffectFit* start = nullptr) const;
};

/// Records that a candidate with optional parameters is among those that count.
inline void record_optional(const SearchState& search, const CandidateScore& score) {
  search.mechanisms().act(Mechanism::kOptional,
                          search.candidates[score.candidate].designs.back().optional);
}

std::vector<const EffectDesign*> designs_of(const std::vector<FoundEffect>& found,
                                            std::size_t without = static_cast<std::size_t>(-1));

/// Whether SPARFLOW_TRACE is set: every step of the search is then printed to stderr.
bool tracing();
void trace_scores(const SearchState& search, int step, const std::vector<CandidateScore>& scores,
                  const NullDistribution& null);
/// @param fit of all found
void trace_found(const SearchState& search, const std::vector<FoundEffect>& found,
                 const EffectFit& fit);

}  // namespace sparflow
