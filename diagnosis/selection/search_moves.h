#pragma once
/// Moves that correct choices which forward selection made too early: dropping, merging, changing the variant of a law,
/// swapping. Used by effect_search.cpp only. `current` is the fit of all found effects, before and after.
#include "diagnosis/selection/search_state.h"

namespace sparflow {

/// Drops effects whose gain beside the others is no more than SearchOptions::least_gain.
void prune(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current);

/// Replaces two effects by one that explains as much. The first effect of such a pair was chosen while it explained
/// two causes at once, and the second compensated its error for one of them. @return whether a pair was replaced
bool merge(const SearchState& search, std::vector<FoundEffect>& found, EffectFit& current);

/// Replaces an effect by another variant of it (the other sensor, the other law) that explains more now that others
/// were found; one of those may become superfluous. @return whether found[i] was replaced
bool reshape(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
             EffectFit& current);

/// Replaces found[i] by a rival that explains more, or else lists its rivals in FoundEffect::alternatives.
/// @return whether it was replaced
bool rivals(const SearchState& search, std::vector<FoundEffect>& found, std::size_t i,
            EffectFit& current);

}  // namespace sparflow
