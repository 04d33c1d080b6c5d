#pragma once
/// Chooses between several effects that all pass the threshold. Used by effect_search.cpp and its parts only.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// The candidate with the largest gain of those that pass the threshold (of all if none does), replaced by one that the
/// least-squares comparison prefers significantly. If that choice refines a plainer effect that explains most of the
/// same, the plainer effect is chosen: later steps decide whether the refinement is needed, and `prune` drops whichever
/// becomes superfluous.
/// @param level false-alarm rate  @param base effects already found
CandidateScore chosen(const SearchState& search, const std::vector<CandidateScore>& scores,
                      const NullDistribution& null, double level,
                      const std::vector<const EffectDesign*>& base);

/// Records that a candidate with optional parameters is among those that count.
inline void record_optional(const SearchState& search, const CandidateScore& score) {
  search.mechanisms().act(Mechanism::kOptional,
                          search.candidates[score.candidate].designs.back().optional);
}

/// Whether the least-squares comparison prefers `one` to `other` significantly.
bool better_by_least_squares(const SearchState& search,
                             const std::vector<const EffectDesign*>& base, const EffectDesign& one,
                             const EffectDesign& other);

}  // namespace sparflow
