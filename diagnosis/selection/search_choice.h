#pragma once
/// Chooses between several effects that all pass the threshold. Used by effect_search.cpp and its parts only.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// The candidate with the largest gain of those that pass the threshold (of all if none does). If it refines a plainer
/// effect that explains most of the same, the plainer effect is chosen: later steps decide whether the refinement is
/// needed, and `prune` drops whichever becomes superfluous. Where the least-squares comparison significantly prefers
/// another point of the chosen effect's grid, that one is taken.
/// @param level false-alarm rate  @param base effects already found
CandidateScore chosen(const SearchState& search, const std::vector<CandidateScore>& scores,
                      const NullDistribution& null, double level,
                      const std::vector<const EffectDesign*>& base);

}  // namespace sparflow
