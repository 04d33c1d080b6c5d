#pragma once
/// What the parts of a search share: evidence, candidates with their gains, what was refused. Used by effect_search.cpp
/// and its parts only.
#include <string>
#include <vector>

#include "diagnosis/regression/null_gate.h"
#include "diagnosis/selection/effect_search.h"
#include "diagnosis/selection/search_scores.h"

namespace sparflow {

/// Times the least gain of a name: an effect that fits only with implausible parameters must be beyond doubt itself
/// before its absence of a name means something.
inline constexpr double kSurelySomething = 3.0;

struct SearchState {
  /// All must outlive this.
  SearchState(const Evidence& evidence, const std::vector<EffectAt>& effects,
              const SearchOptions& options, const SearchProgress& progress);
  SearchState(const SearchState&) = delete;  // scores look at candidates
  SearchState& operator=(const SearchState&) = delete;

  const Evidence& evidence;
  const SearchOptions& options;
  const SearchProgress& progress;
  std::vector<SearchCandidate> candidates;
  SearchScores scores;
  std::vector<bool> refused;  ///< candidates that failed a proof in this search

  void report(std::size_t found, const std::string& what) const;
  std::string key(const EffectAt& e) const;
  const EffectDesign& design_of(const CandidateScore& score) const {
    return candidates[score.candidate].designs[score.design];
  }
  double price_of(const EffectDesign& design) const;  ///< [nats]
  /// Whether both show in one channel.
  bool meet(const EffectDesign& a, const EffectDesign& b) const;
  /// By candidate: refused before, or found already.
  std::vector<bool> skipped(const std::vector<FoundEffect>& found) const;
  /// @param fit of all found
  void judge(std::vector<FoundEffect>& found, std::size_t index, const EffectFit& fit) const;
  /// With residuals and covariance, noise to the end. @param start noise to start from; may be null
  EffectFit fit(const std::vector<const EffectDesign*>& designs,
                const EffectFit* start = nullptr) const;
};

std::vector<const EffectDesign*> designs_of(const std::vector<FoundEffect>& found,
                                            std::size_t without = static_cast<std::size_t>(-1));

/// Diagnosis of the diagnosis: SPARFLOW_TRACE=1 prints every step to stderr.
bool tracing();
void trace_scores(const SearchState& search, int step, const std::vector<CandidateScore>& scores,
                  const NullGate& gate);
/// @param fit of all found
void trace_found(const SearchState& search, const std::vector<FoundEffect>& found,
                 const EffectFit& fit);

}  // namespace sparflow
